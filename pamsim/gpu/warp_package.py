"""The optional packages that run muscles on a GPU."""

from __future__ import annotations

import importlib
import sys
from typing import Any

from pamsim.core.errors import InputError


def warp() -> Any:
    """Warp; it stays silent about what it compiles, unless the caller has imported it before.

    Raises:
        InputError: if it is not installed.
    """
    new = "warp" not in sys.modules
    package = _package("warp")
    if new:
        package.config.log_level = package.LOG_WARNING
    return package


def mujoco_warp() -> Any:
    """MuJoCo's engine in Warp; errors as of `warp`."""
    warp()
    return _package("mujoco_warp")


def _package(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise InputError(
            f"a GPU needs the package {error.name}: pip install 'pamsim[gpu]'"
        ) from None
