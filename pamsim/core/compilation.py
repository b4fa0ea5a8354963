"""Compiled code: where it is kept, a line for whoever waits for it, functions made from a text."""

from __future__ import annotations
import __future__

import contextlib
import linecache
import os
import sys
import tempfile
import threading
import warnings
from collections.abc import Generator, Mapping
from pathlib import Path
from types import FunctionType
from typing import Any

VARIABLE = "NUMBA_CACHE_DIR"
_AFTER = 1.5
"""Time that loading compiled code does not take, but compiling does [s]."""


def choose_cache(package: Path) -> Path | None:
    """Let numba keep compiled code in a temporary folder where it has no other; warns if so.

    It tries the folder of the source, ``package``, and the user's cache. In a container that may
    write neither, it would fail. Processes that are started later use the same folder.
    """
    if os.environ.get(VARIABLE) or os.access(package, os.W_OK) or writable(_users()):
        return None
    folder = _temporary()
    os.environ[VARIABLE] = str(folder)
    warnings.warn(
        f"neither {package} nor {_users()} can be written; compiled code is kept in {folder}, and"
        f" compiled again, for about ten seconds, once that is gone. Set {VARIABLE} to a folder"
        " that stays",
        RuntimeWarning,
        stacklevel=3,
    )
    return folder


def writable(folder: Path) -> bool:
    """Whether a file can be made in a folder, which is created if need be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _users() -> Path:
    """The user's cache, as numba looks for it."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home()))
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def _temporary() -> Path:
    """A temporary folder that is the user's alone: others must not put code there."""
    user = os.getuid() if hasattr(os, "getuid") else None
    folder = Path(tempfile.gettempdir()) / ("pamsim" if user is None else f"pamsim-{user}")
    folder.mkdir(mode=0o700, exist_ok=True)
    status = folder.stat()
    if user is not None and (status.st_uid != user or status.st_mode & 0o077):
        return Path(tempfile.mkdtemp(prefix="pamsim-"))
    return folder


@contextlib.contextmanager
def compile_notice(what: str, about: str) -> Generator[None]:
    """Print on standard error what is being compiled, if a ``with`` block takes long.

    Only where someone reads it: on a terminal and in a notebook, with the words ``about`` its time.
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


def function_of_text(
    name: str, text: str, where: str, names: Mapping[str, Any], *, typed: bool = False
) -> FunctionType:
    """The function that a text defines, which refers to ``names``.

    Debuggers and compilers read it as that of a file ``where``. Its annotations are evaluated if it
    is ``typed``, for a compiler that asks for types.
    """
    linecache.cache[where] = (len(text), None, text.splitlines(keepends=True), where)
    space = dict(names)
    flags = 0 if typed else __future__.annotations.compiler_flag
    exec(compile(text, where, "exec", dont_inherit=True, flags=flags), space)
    return space[name]
