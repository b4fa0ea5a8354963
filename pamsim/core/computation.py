"""What every long computation needs: one BLAS thread, a report of where it is, and its versions."""

# threadpoolctl carries no types.
# pyright: reportMissingTypeStubs=false

from __future__ import annotations

import importlib.metadata
import platform
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

import threadpoolctl

Progress = Callable[[int, "int | None", str], None]
"""Called as ``progress(done, total, what)``: steps done, of how many (None if unknown), and what is
being done now."""

_limits: Any = threadpoolctl.threadpool_limits


class Steps:
    """Reports to ``progress`` the steps of a computation, at first at most ``ahead``."""

    def __init__(self, progress: Progress | None, ahead: int) -> None:
        self._progress, self._done, self._total = progress, 0, ahead

    def expect(self, ahead: int) -> None:
        """Correct how many steps are still ahead, at most."""
        self._total = self._done + ahead

    def begin(self, what: str) -> None:
        """Report that a step begins."""
        if self._progress is not None:
            self._progress(self._done, max(self._total, self._done + 1), what)
        self._done += 1


@contextmanager
def one_blas_thread() -> Generator[None]:
    """Inside, or in a function that it decorates, every loaded BLAS has one thread.

    Its threads wait for work by spinning. Beside simulations that takes a third of the processors'
    time, and fits of many small matrices become several times slower.
    """
    with _limits(limits=1, user_api="blas"):
        yield


def versions(*also: str) -> dict[str, str]:
    """Versions of Python, pamsim, MuJoCo and numpy, and of further packages, by name."""
    names = ("pamsim", "mujoco", "numpy", *also)
    return {"python": platform.python_version()} | {n: importlib.metadata.version(n) for n in names}
