"""What every command writes the same way: JSON files and progress."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pamsim.store.json_file import write_json


def save_json(path: Path | None, result: Mapping[str, Any]) -> None:
    """Write a result where ``--json`` says, if it says anything."""
    if path is not None:
        write_json(path, result)


@contextlib.contextmanager
def progress_bar(unit: str = "run") -> Iterator[Callable[[int, int, str], None]]:
    """A bar on standard error, driven by ``progress(done, total, what)``; silent in a pipe."""
    from tqdm import tqdm

    with tqdm(total=None, disable=None, leave=False, unit=unit) as bar:

        def report(done: int, total: int, what: str) -> None:
            bar.total = total
            bar.set_description(what, refresh=False)
            bar.update(done - bar.n)

        yield report
