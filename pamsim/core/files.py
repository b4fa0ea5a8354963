"""Write a file completely or not at all, and none over another without being asked to."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Generator
from pathlib import Path

from pamsim.core.errors import InputError


@contextlib.contextmanager
def complete_file(path: Path) -> Generator[Path]:
    """Write to another path in a ``with`` block, which then replaces ``path`` in one move.

    If the block fails or is interrupted, ``path`` stays as it was.

    Args:
        path: of the file; its folder is created.

    Raises:
        InputError: if the place cannot be written.
    """
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield part
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from None


def refuse_existing(path: Path, force: bool) -> Path:
    """Refuse to write over a file.

    Args:
        path: to be written.
        force: whether it may be replaced.

    Returns:
        The path.

    Raises:
        InputError: if it is there and may not.
    """
    if path.exists() and not force:
        raise InputError(f"{path} is there already; `force` replaces it")
    return path
