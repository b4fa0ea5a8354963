"""The optional packages that run muscles on a GPU."""

from __future__ import annotations

import sys
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

from pamsim.core.errors import InputError


def warp() -> Any:
    """Warp; it stays silent about what it compiles, unless the caller has imported it before.

    Raises:
        InputError: if it is not installed.
    """
    new = "warp" not in sys.modules
    with _installed():
        import warp as package
    if new:
        package.config.log_level = package.LOG_WARNING
    return package


def mujoco_warp() -> Any:
    """MuJoCo's engine in Warp; errors as of `warp`."""
    warp()
    with _installed():
        import mujoco_warp as package
    return package


@contextmanager
def _installed() -> Generator[None]:
    try:
        yield
    except ModuleNotFoundError as error:
        message = f"a GPU needs the package {error.name}: pip install 'pamsim[gpu]'"
        raise InputError(message) from None
