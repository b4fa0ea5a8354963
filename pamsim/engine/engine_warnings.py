"""The engine's own prints of its warnings, held back where a run's outcome reports them."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator

import mujoco

_lock = threading.Lock()
_holders: list[object] = []


@contextlib.contextmanager
def engine_warnings_held() -> Iterator[None]:
    """Let the engine print no warnings, and write no ``MUJOCO_LOG.TXT``, in a ``with`` block.

    It counts them all the same, and a run that has one reports it as its outcome. A handler that
    somebody has set by ``mujoco.set_mju_user_warning`` is left alone. It holds for the process.
    """
    holder = object()
    with _lock:
        if not _holders and mujoco.get_mju_user_warning() is None:
            mujoco.set_mju_user_warning(_held)
        _holders.append(holder)
    try:
        yield
    finally:
        with _lock:
            _holders.remove(holder)
            if not _holders and mujoco.get_mju_user_warning() is _held:
                mujoco.set_mju_user_warning(None)


def _held(_: str) -> None:
    """Take a warning of the engine and do nothing with it."""
