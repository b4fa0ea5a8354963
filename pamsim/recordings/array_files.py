"""Named arrays in files of other formats: ``.npz``, ``.mat`` and ``.parquet``."""

# scipy carries no types.
# pyright: reportMissingTypeStubs=false

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from numpy.typing import NDArray

from pamsim.core.bounded_read import read_bounded
from pamsim.core.errors import InputError
from pamsim.core.limits import ARRAY_BYTES
from pamsim.recordings.matlab_elements import check_elements

_loadmat: Any = scipy.io.loadmat
_BYTES_OF_NUMBER = 8


def read_arrays(path: Path) -> Mapping[str, NDArray[Any]]:
    """Name -> array of a file, whose format its ending states.

    Raises:
        InputError: if it cannot be read.
    """
    reader = ARRAY_FILES.get(path.suffix.lower())
    if reader is None:
        raise InputError(
            f"{path} is none of {', '.join(ARRAY_FILES)}; its ending states what it is"
        )
    try:
        return reader(path)
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from None
    except NotImplementedError:
        raise InputError(
            f"{path} is a MATLAB file of version 7.3; save it with -v7, or as a CSV"
        ) from None
    except Exception as error:  # whatever the libraries raise at a damaged file
        why = str(error) or type(error).__name__
        raise InputError(f"{path} cannot be read as {path.suffix}: {why}") from None


def _check_unfolded(path: Path, size: int) -> None:
    if size > ARRAY_BYTES:
        raise InputError(
            f"{path}: its arrays have {size / 2**20:,.0f} MiB, of {ARRAY_BYTES / 2**20:,.0f} that"
            " are read; cut it into several files, or leave out columns"
        )


def _of_numpy(path: Path) -> Mapping[str, NDArray[Any]]:
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
        _check_unfolded(path, sum(part.file_size for part in file.zip.infolist()))
        return {name: np.asarray(file[name]) for name in file.files}


def _of_matlab(path: Path) -> Mapping[str, NDArray[Any]]:
    content = read_bounded(path, ARRAY_BYTES)
    check_elements(content)
    found = _loadmat(io.BytesIO(content))
    return {k: np.asarray(v) for k, v in found.items() if not k.startswith("__")}


def _of_parquet(path: Path) -> Mapping[str, NDArray[Any]]:
    """The columns of a Parquet file; times of day as seconds from the first."""
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
        if values.dtype.kind == "M":
            values = (values - values[0]) / np.timedelta64(1, "s")
        found[name] = values
    return found


ARRAY_FILES: Mapping[str, Callable[[Path], Mapping[str, NDArray[Any]]]] = {
    ".npz": _of_numpy,
    ".mat": _of_matlab,
    ".parquet": _of_parquet,
}
"""End of a file's name -> reader of its arrays by name."""
