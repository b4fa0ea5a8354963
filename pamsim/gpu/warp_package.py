"""The optional packages that run muscles on a GPU."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

from pamsim.core.errors import InputError


def warp() -> Any:
    """Warp; it stays silent about what it compiles, unless the caller has imported it before.

    Raises:
        InputError: if it is not installed.
    """
    new = "warp" not in sys.modules
    try:
        import warp as package
    except ModuleNotFoundError as error:
        raise _missing(error) from None
    if new:
        package.config.log_level = package.LOG_WARNING
    return package


def mujoco_warp() -> ModuleType:
    """MuJoCo's engine in Warp.

    Raises:
        InputError: if it is not installed.
    """
    warp()
    try:
        import mujoco_warp as package
    except ModuleNotFoundError as error:
        raise _missing(error) from None
    return package


def _missing(error: ModuleNotFoundError) -> InputError:
    return InputError(f"a GPU needs the package {error.name}: pip install 'pamsim[gpu]'")
