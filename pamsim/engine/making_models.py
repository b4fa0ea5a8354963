"""Whether a model is being made: the engine then makes a step to try it, without the muscles."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager


class _Compiling(threading.local):
    """Whether this thread compiles a model, in which the engine makes a step to try it."""

    now = False


_compiling = _Compiling()


@contextmanager
def not_evaluated() -> Iterator[None]:
    """Leave out muscles in what the engine evaluates meanwhile in this thread, until loaded."""
    before, _compiling.now = _compiling.now, True
    try:
        yield
    finally:
        _compiling.now = before


def making_a_model() -> bool:
    """Whether this thread makes a model, in which the engine makes a step to try it."""
    return _compiling.now
