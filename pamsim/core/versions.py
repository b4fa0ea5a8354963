"""What a result was computed with."""

from __future__ import annotations

import importlib.metadata
import platform


def versions(*also: str) -> dict[str, str]:
    """Versions of Python, pamsim, MuJoCo and numpy, and of further packages, by name."""
    names = ("pamsim", "mujoco", "numpy", *also)
    return {
        "python": platform.python_version(),
        **{name: importlib.metadata.version(name) for name in names},
    }
