"""Named arrays in files of other formats: ``.npz``, ``.mat`` and ``.parquet``."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.files import read_bounded
from pamsim.core.limits import ARRAY_BYTES
from pamsim.recordings.column_guess import kind_of_unit, unit_in_name

_BYTES_OF_NUMBER = 8

# Of a MAT 5 file: bytes of its header, types of data elements, classes of arrays of numbers, and a
# flag of an array. Source: "MAT-File Format", The MathWorks, chapter 1.
_MAT_HEADER, _MATRIX, _COMPRESSED = 128, 14, 15
_NUMBERS = {
    **{1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4"},
    **{7: "f4", 9: "f8", 12: "i8", 13: "u8"},
}
_OF_NUMBERS, _COMPLEX = range(6, 16), 0x0800


def read_arrays(path: Path) -> Mapping[str, NDArray[Any]]:
    """Name -> array of an ``.npz``, ``.mat`` or ``.parquet``; InputError if it cannot be read."""
    reader = ARRAY_FILES.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(ARRAY_FILES)
        raise InputError(f"{path}: unknown type of file; the name must end with one of {known}")
    try:
        return reader(path)
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from None
    except Exception as error:  # whatever the libraries raise at a damaged file
        why = str(error) or type(error).__name__
        raise InputError(f"{path} cannot be read as {path.suffix}: {why}") from None


def _check_unfolded(path: Path, size: int) -> None:
    if size > ARRAY_BYTES:
        raise InputError(
            f"{path}: its arrays have {size / 2**20:,.0f} MiB, above the limit of"
            f" {ARRAY_BYTES / 2**20:,.0f}; cut it into several files, or leave out columns"
        )


def _of_numpy(path: Path) -> Mapping[str, NDArray[Any]]:
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
        _check_unfolded(path, sum(part.file_size for part in file.zip.infolist()))
        return {name: np.asarray(file[name]) for name in file.files}


def _of_matlab(path: Path) -> Mapping[str, NDArray[Any]]:
    """The arrays of real numbers; cells, structures and sparse arrays are passed over unread.

    Of MAT 5 they are read here: scipy trusts what a damaged file states, and may crash.
    """
    content = read_bounded(path, ARRAY_BYTES)
    order = {b"IM": "<", b"MI": ">"}.get(content[_MAT_HEADER - 2 : _MAT_HEADER])
    if order is None or 0 in content[:4]:  # four zero-free bytes set MAT 5 apart from MAT 4
        import scipy.io  # pyright: ignore[reportMissingTypeStubs]

        read: Mapping[str, Any] = scipy.io.loadmat(io.BytesIO(content))
        return {k: v for k, v in read.items() if getattr(v, "dtype", np.dtype("O")).kind in "iuf"}
    if 2 in content[_MAT_HEADER - 4 : _MAT_HEADER - 2]:
        raise InputError(f"{path} is a MATLAB file of version 7.3; save it with -v7, or as a CSV")
    found: dict[str, NDArray[Any]] = {}
    left = ARRAY_BYTES
    for kind, data in _elements(content[_MAT_HEADER:], order):
        if kind == _COMPRESSED:
            whole = zlib.decompressobj().decompress(data, left)
            left -= len(whole)
            if left <= 0:
                raise ValueError(f"its arrays are larger than {ARRAY_BYTES} bytes")
            kind, data = next(_elements(whole, order))
        if kind != _MATRIX:
            raise ValueError(f"data element of type {kind} where an array should be")
        parts = list(_elements(data, order))
        flags = int(np.frombuffer(parts[0][1], f"{order}u4")[0]) if parts else 0
        if flags & 0xFF not in _OF_NUMBERS:
            continue
        for part, _ in parts:
            if part not in _NUMBERS:
                raise ValueError(f"a data element of unknown type {part}")
        least = 4 + bool(flags & _COMPLEX)  # flags, dimensions, name, values
        if len(parts) < least:
            raise ValueError(f"an array of {len(parts)} parts where its flags ask for {least}")
        shape, name, values = (np.frombuffer(d, order + _NUMBERS[p]) for p, d in parts[1:4])
        text = name.tobytes().decode("latin-1")
        if text in found:
            raise ValueError("two of its arrays have one name")
        if text and least == 4:  # what has no name is of MATLAB itself
            found[text] = values.reshape(shape, order="F")
    return found


def _elements(content: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Type and data of each data element of a MAT 5 file, or of an array in it."""
    at = 0
    while at < len(content):
        tag = content[at : at + 8].ljust(8, b"\0")
        kind, size = struct.unpack(f"{order}II", tag)
        start, padding = at + 8, 0 if kind == _COMPRESSED else -size % 8
        if kind >> 16:  # four bytes at most, inside the tag
            kind, size, start = kind & 0xFFFF, kind >> 16, at + 4
            padding = 4 - size
        if start + size > len(content) or padding < 0:
            raise ValueError("it ends in the middle of an array")
        yield kind, content[start : start + size]
        at = start + size + padding


def _of_parquet(path: Path) -> Mapping[str, NDArray[Any]]:
    """The columns of a Parquet file; times of day as seconds from the first, durations in s."""
    try:
        from pyarrow import parquet
    except ImportError:
        raise InputError(
            f"{path}: Parquet needs the package pyarrow; install it with pip install"
            " 'pamsim[parquet]', or save the log as a CSV"
        ) from None
    with parquet.ParquetFile(path) as file:
        _check_unfolded(path, _BYTES_OF_NUMBER * file.metadata.num_rows * file.metadata.num_columns)
        table: Any = file.read()
    found: dict[str, NDArray[Any]] = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        values = column.to_numpy()
        stated = kind_of_unit(unit_in_name(name, ""))
        if values.dtype.kind in "mM" and stated not in ("", "time"):
            raise InputError(f"{path}: {name} holds dates or durations, no {stated}; mend its type")
        if values.dtype.kind == "M":
            values = values - values[0]
        if values.dtype.kind == "m":
            values = values / np.timedelta64(1, "s")
        found[name] = values
    return found


ARRAY_FILES: Mapping[str, Callable[[Path], Mapping[str, NDArray[Any]]]] = {
    ".npz": _of_numpy,
    ".mat": _of_matlab,
    ".parquet": _of_parquet,
}
"""End of a file's name -> reader of its arrays by name."""
