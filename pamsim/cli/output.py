"""What every command writes the same way: its JSON file and its progress line."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from pamsim.cli.options import OPENED, OUTPUT, STANDARD_OUTPUT
from pamsim.core.progress import Progress
from pamsim.store.json_file import write_json


def save_json(path: Path | None, result: Mapping[str, Any]) -> None:
    """Write a result to the file given by ``--json``, if it was given.

    Raises:
        InputError: if it cannot be written.
    """
    if path == STANDARD_OUTPUT:
        stream = click.get_current_context().meta[OUTPUT]
        print(json.dumps(result, indent=1, allow_nan=False), file=stream)
    elif path is not None:
        write_json(path, result)


def show_page(page: Path) -> None:
    """Print where a page lies, and show it in a browser if ``--open`` was given."""
    click.echo(f"page: {page}")
    context = click.get_current_context(silent=True)
    if context is not None and context.meta.get(OPENED):
        click.launch(str(page.resolve()))


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
