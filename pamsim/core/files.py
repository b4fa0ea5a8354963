"""Read a file up to a size; write one completely or not at all, and none over another unasked."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Callable, Collection, Generator
from pathlib import Path
from typing import Any, cast

from pamsim.core.errors import InputError, first_few

LOCK = ".pamsim.lock"
"""In a folder while a run writes to it; what a killed run leaves of it means nothing."""

_PART = ".part-"
"""In the hidden name of a file that is being written; what a killed run leaves of it is waste."""


def read_bounded(path: Path, most: int, *, instead: str = "is it the right file?") -> bytes:
    """The content of a file of at most so many bytes that anyone may have written, or of a pipe.

    OSError if it cannot be read, InputError if it is larger; ``instead`` says what to do then.
    """
    with path.open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise InputError(f"{path} has more than {most / 2**20:,.0f} MiB, the most read; {instead}")
    return content


def read_document(
    path: Path,
    most: int,
    parse: Callable[[str], Any],
    language: str,
    schemas: Collection[str] = (),
) -> dict[str, Any]:
    """Names and values in a file, of at most so many bytes, that anyone may have written.

    Raises:
        FileNotFoundError: if there is no such file.
        InputError: if it cannot be read, is too large or not valid, or states none of the schemas.
    """
    try:
        content = parse(read_bounded(path, most).decode("utf-8-sig"))
    except FileNotFoundError:
        raise
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:  # also of UTF-8, or of a number's many digits
        raise InputError(f"{path}: not valid {language}: {error}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected names with values, not {content!r}")
    document = cast("dict[str, Any]", content)
    stated = document.get("schema")
    if schemas and stated not in schemas:
        known = " or ".join(map(repr, schemas))
        raise InputError(f"{path}: schema is {stated!r}; this pamsim reads {known}")
    return document


@contextlib.contextmanager
def complete_file(path: Path) -> Generator[Path]:
    """Write to another path in a ``with`` block, which then replaces ``path`` in one move.

    The folder is created. If the block fails or is interrupted, or the disk is full, ``path`` stays
    as it was.

    Raises:
        InputError: if the place cannot be written.
    """
    # A name of its own, so that two writers do not share it.
    part = path.parent / f".{path.stem}{_PART}{secrets.token_hex(8)}{path.suffix}"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            part.open("xb").close()
            yield part
            with part.open("r+b") as written:
                os.fsync(written.fileno())
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        # By its number: pyarrow gives the system's error in words of its own.
        reason = os.strerror(error.errno) if error.errno else error
        raise InputError(f"cannot write {path}: {reason}") from None


def is_part(name: str) -> bool:
    """Whether a file's name is that of one being written, or of one that was never completed."""
    return name.startswith(".") and _PART in name


def refuse_existing(path: Path, force: bool) -> Path:
    """A path to be written; InputError if a file is there, unless ``force`` replaces it."""
    if path.exists() and not force:
        raise InputError(f"{path} is there already; `force` replaces it")
    return path


def refuse_file(folder: Path) -> Path:
    """A path where a folder is to be; InputError if a file is there."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"cannot write {folder}: it is a file; name a folder")
    return folder


@contextlib.contextmanager
def results_folder(path: Path, *, force: bool = False, resume: bool = False) -> Generator[Path]:
    """Keep a folder, created if need be, for the results of one run, for a ``with`` block.

    Files in it may be replaced by ``force``, or if the run is to ``resume`` with what is there.

    Raises:
        InputError: if there are files in it that may not be replaced, another run writes to it, or
            it cannot be written.
    """
    from filelock import FileLock, Timeout

    if refuse_file(path).is_dir() and not (force or resume):
        names = (entry.name for entry in path.iterdir())
        there = sorted(name for name in names if name != LOCK and not is_part(name))
        if there:
            raise InputError(
                f"{path} holds results already ({first_few(there, 1)}); `force` replaces them, or"
                " name another folder"
            )
    lock = FileLock(path / LOCK, timeout=0)
    try:
        path.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout:
        raise InputError(
            f"another run writes to {path}; wait for it, or name another folder"
        ) from None
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from None
    try:
        # Nobody else writes here: what a killed run has left in it and its folders is waste.
        for left in [*path.glob(f".*{_PART}*"), *path.glob(f"*/.*{_PART}*")]:
            with contextlib.suppress(OSError):
                left.unlink()
        yield path
    finally:
        # While it is held: another run that has taken it since would be left without its file,
        # and a third could take a new one.
        with contextlib.suppress(OSError):
            (path / LOCK).unlink(missing_ok=True)
        lock.release()
        with contextlib.suppress(OSError):  # nothing was written: as it was before
            path.rmdir()
