"""The table of a sweep on disk: checksummed Parquet chunks, of which one file is made in the end.

A chunk is complete or not there. On resuming each is read and its checksums are verified: one that
is damaged counts as not there, and its runs are made again.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pamsim.core.errors import InputError
from pamsim.core.files import complete_file

FILE, CHUNKS = "runs.parquet", "chunks"
INDEX = "run"


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InputError(
            "a sweep writes Parquet, which needs the package pyarrow; install it with pip install"
            " 'pamsim[parquet]'"
        ) from None
    return pyarrow, parquet


class RunTable:
    """Rows of runs in the folder of a sweep, which is created if need be.

    Each column keeps its unit, ``text`` for text.
    """

    def __init__(self, folder: Path, columns: Mapping[str, str]) -> None:
        self._arrow, self._parquet = _pyarrow()
        self._folder = folder
        fields = [self._arrow.field(INDEX, self._arrow.int64())]
        for name, unit in columns.items():
            kind = self._arrow.string() if unit == "text" else self._arrow.float64()
            stated = {} if unit == "text" else {"unit": unit}
            fields.append(self._arrow.field(name, kind, metadata=stated))
        self._schema = self._arrow.schema(fields)

    @property
    def path(self) -> Path:
        """The finished table."""
        return self._folder / FILE

    def add(self, block: int, rows: Sequence[Mapping[str, Any]]) -> None:
        """Write the rows of a block, `INDEX` included, complete or not at all; NaN is missing."""
        found = [{name: None if v != v else v for name, v in row.items()} for row in rows]
        table = self._arrow.Table.from_pylist(found, schema=self._schema)
        with complete_file(self._chunk(block)) as part:
            self._parquet.write_table(table, part, write_page_checksum=True)

    def complete_blocks(self, count: int) -> set[int]:
        """Numbers of the blocks, out of ``count``, that are there and undamaged."""
        return {block for block in range(count) if self._read(block) is not None}

    def rows(self, count: int) -> list[dict[str, Any]]:
        """Rows of the finished table, or of the complete blocks out of ``count``, in order."""
        whole = self._table(self.path)
        found = [whole] if whole is not None else [self._read(block) for block in range(count)]
        return [row for table in found if table is not None for row in table.to_pylist()]

    def finish(self, count: int) -> None:
        """Make one file of all blocks, in their order, and remove the chunks."""
        with (
            complete_file(self.path) as part,
            self._parquet.ParquetWriter(part, self._schema, write_page_checksum=True) as writer,
        ):
            for block in range(count):
                writer.write_table(self._read(block))
        for block in range(count):
            self._chunk(block).unlink(missing_ok=True)
        (self._folder / CHUNKS).rmdir()

    def clear(self, kept: Iterable[int] = ()) -> None:
        """Remove the finished table and all chunks but those kept."""
        self.path.unlink(missing_ok=True)
        names = {self._chunk(block).name for block in kept}
        for path in (self._folder / CHUNKS).glob("*.parquet"):
            if path.name not in names:
                path.unlink()

    def is_finished(self, runs: int) -> bool:
        """Whether the finished table is there, undamaged, with a row for every run."""
        table = self._table(self.path)
        return table is not None and table.num_rows == runs

    def _chunk(self, block: int) -> Path:
        return self._folder / CHUNKS / f"{block:06d}.parquet"

    def _read(self, block: int) -> Any:
        return self._table(self._chunk(block))

    def _table(self, path: Path) -> Any:
        """A table with this schema; None where there is none, or it is damaged."""
        if not path.exists():
            return None
        try:
            table = self._parquet.read_table(path, page_checksum_verification=True)
        except (OSError, self._arrow.ArrowException):
            return None
        return table if table.schema.equals(self._schema) else None
