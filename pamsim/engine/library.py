"""The engine's own library, for what its Python bindings leave out."""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path

import mujoco

from pamsim.core.errors import EngineError


@functools.cache
def engine_library() -> ctypes.CDLL:
    """MuJoCo's library, as the Python package has loaded it.

    Raises:
        EngineError: if it is not beside the Python package.
    """
    folder = Path(mujoco.__file__).parent
    found = [p for p in folder.iterdir() if p.name.startswith(("libmujoco.", "mujoco.dll"))]
    if not found:
        raise EngineError(f"the library of MuJoCo is not in {folder}; install mujoco again")
    return ctypes.CDLL(str(found[0]))
