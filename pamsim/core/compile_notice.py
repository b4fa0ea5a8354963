"""A line for whoever waits while code is compiled, which happens once per installation."""

from __future__ import annotations

import contextlib
import sys
import threading
from collections.abc import Generator

_AFTER = 1.5
"""Time that loading compiled code does not take, but compiling does [s]."""


@contextlib.contextmanager
def compile_notice(what: str, about: str) -> Generator[None]:
    """Print on standard error what is being compiled, if a ``with`` block takes long.

    Only where someone reads it: on a terminal and in a notebook.

    Args:
        what: is compiled.
        about: how long that takes, in words.
    """
    text = f"pamsim: compiling {what}, once for this installation ({about})"
    timer = threading.Timer(_AFTER, print, [text], {"file": sys.stderr, "flush": True})
    timer.daemon = True
    if sys.stderr.isatty() or "ipykernel" in sys.modules:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()
