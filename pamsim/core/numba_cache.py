"""Where numba keeps compiled code, if the places that it tries by itself cannot be written."""

from __future__ import annotations

import os
import sys
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"


def choose_cache(package: Path) -> bool:
    """Let numba keep compiled code in a temporary folder where it has no other; warns if so.

    It tries the folder of the source and the user's cache. In a container that may write neither,
    it would fail. Processes that are started later use the same folder.

    Args:
        package: folder of the source.

    Returns:
        Whether the folder is a temporary one.
    """
    if os.environ.get(VARIABLE) or os.access(package, os.W_OK) or writable(_users()):
        return False
    import warnings

    folder = _temporary()
    os.environ[VARIABLE] = str(folder)
    warnings.warn(
        f"neither {package} nor {_users()} can be written; compiled code is kept in {folder}, and"
        f" compiled again, for about ten seconds, once that is gone. Set {VARIABLE} to a folder"
        " that stays",
        RuntimeWarning,
        stacklevel=3,
    )
    return True


def writable(folder: Path) -> bool:
    """Whether a file can be made in a folder, which is created if need be."""
    import tempfile

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
    import tempfile

    name = f"pamsim-{os.getuid()}" if hasattr(os, "getuid") else "pamsim"
    folder = Path(tempfile.gettempdir()) / name
    folder.mkdir(mode=0o700, exist_ok=True)
    if hasattr(os, "getuid"):
        status = folder.stat()
        if status.st_uid != os.getuid() or status.st_mode & 0o077:
            return Path(tempfile.mkdtemp(prefix="pamsim-"))
    return folder
