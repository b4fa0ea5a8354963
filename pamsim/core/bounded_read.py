"""Read a file that anyone may have written, up to a size."""

from __future__ import annotations

from pathlib import Path

from pamsim.core.errors import InputError


def read_bounded(path: Path, most: int, *, instead: str = "is it the right file?") -> bytes:
    """The content of a file.

    Args:
        path: of the file, which may be a pipe.
        most: bytes that it may have.
        instead: what to do about a larger one, for the error.

    Raises:
        OSError: if it cannot be read.
        InputError: if it is larger.
    """
    with path.open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise InputError(f"{path} has more than {most / 2**20:,.0f} MiB, the most read; {instead}")
    return content
