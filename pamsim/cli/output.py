"""What every command writes the same way: its JSON file and its progress line."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pamsim.core.progress import Progress
from pamsim.store.json_file import write_json


def save_json(path: Path | None, result: Mapping[str, Any]) -> None:
    """Write a result to the file given by ``--json``, if it was given."""
    if path is not None:
        write_json(path, result)


@contextlib.contextmanager
def progress_bar(unit: str = "run") -> Iterator[Progress]:
    """A progress line on standard error; nothing where that is no terminal."""
    from tqdm import tqdm

    with tqdm(total=None, disable=None, leave=False, unit=unit) as bar:

        def report(done: int, total: int | None, what: str) -> None:
            bar.total = total
            bar.set_description(what, refresh=False)
            bar.update(done - bar.n)

        yield report
