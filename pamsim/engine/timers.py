"""The engine's timers, stopped: they would take a seventh of each step."""

from __future__ import annotations

import threading
import weakref

import mujoco

from pamsim.engine.plugin import load_kernel

_lock = threading.Lock()
_holders: set[int] = set()


class StoppedTimers:
    """Keeps ``data.timer`` at 0 until it is closed or forgotten, for all models of the process.

    Nothing else depends on it. A clock that somebody has set as ``mjcb_time`` is left alone.

    Raises:
        EngineError: as `load_kernel`.
    """

    def __init__(self) -> None:
        _hold(id(self))
        self._release = weakref.finalize(self, _release, id(self))
        self._release.atexit = False

    @property
    def closed(self) -> bool:
        """Whether it has been closed."""
        return not self._release.alive

    def close(self) -> None:
        """Let the timers run again, unless another holds them. May be called twice."""
        self._release()

    def __enter__(self) -> StoppedTimers:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _hold(holder: int) -> None:
    clock = load_kernel().clock
    with _lock:
        if not _holders and mujoco.get_mjcb_time() is None:
            mujoco.set_mjcb_time(clock)
        _holders.add(holder)


def _release(holder: int) -> None:
    clock = load_kernel().clock
    with _lock:
        _holders.discard(holder)
        if not _holders and mujoco.get_mjcb_time() is clock:
            mujoco.set_mjcb_time(None)
