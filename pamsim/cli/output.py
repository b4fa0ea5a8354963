"""What commands write the same way: JSON file, page, cards, progress line."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from pamsim.cli.command import STANDARD_OUTPUT, answer, log, quiet, standard_output, verbose, warn
from pamsim.cli.options import OPENED
from pamsim.core.computation import Progress
from pamsim.core.encoding import write_json


def save_json(path: Path | None, result: Mapping[str, Any]) -> None:
    """Write a result to the file given by ``--json``, if it was given."""
    if str(path) == STANDARD_OUTPUT:
        print(json.dumps(result, indent=1, allow_nan=False), file=standard_output())
    elif path is not None:
        write_json(path, result)


def present(result: Any, json_file: Path | None) -> dict[str, Any]:
    """Write a result to the file of ``--json`` and print it in words; return its content."""
    content = result.to_dict()
    save_json(json_file, content)
    show_summary(result.summary())
    return content


def show_page(page: Path) -> None:
    """Print where a page lies, and show it in a browser if ``--open`` was given."""
    click.echo(f"page: {page}")
    context = click.get_current_context(silent=True)
    if context is not None and context.meta.get(OPENED):
        click.launch(str(page.resolve()))


def show_list(title: str, rows: Iterable[tuple[str, str]]) -> None:
    """Print a list of names, each with some text; with ``-q`` the names alone."""
    rows = list(rows)
    width = max((len(name) for name, _ in rows), default=0)
    if quiet():
        answer(*(name for name, _ in rows))
    click.echo(f"{title}:")
    for name, text in rows:
        first, *more = text.splitlines() or [""]
        click.echo(f"  {name:{width}s}  {first}")
        for line in more:
            click.echo(f"  {'':{width}s}  {line}")


def show_summary(summary: str) -> None:
    """Print a result in words: its last line is the answer."""
    *details, last = summary.splitlines()
    for line in details:
        if line.startswith("warning: "):
            warn(line.removeprefix("warning: "))
        else:
            click.echo(line)
    answer(last)


def show_card(title: str, rows: Mapping[str, str]) -> None:
    """Print a card as the answer: a title and labelled texts, without those that are empty."""
    width = 1 + max((len(label) for label, text in rows.items() if text), default=0)
    answer(title, *(f"  {f'{label}:':{width}s}  {text}" for label, text in rows.items() if text))


@contextlib.contextmanager
def progress_bar(unit: str = "run") -> Iterator[Progress]:
    """A progress line on a terminal's standard error, with the share done and the time left.

    With ``-q`` there is none; with ``-v`` each stage is a line of the log, too.
    """
    from tqdm import tqdm

    hidden = quiet() or not sys.stderr.isatty()
    with tqdm(total=None, disable=hidden, leave=False, unit=unit) as bar:
        stage = ""

        def report(done: int, total: int | None, what: str) -> None:
            nonlocal stage
            bar.total = total
            bar.set_description(what, refresh=False)
            bar.update(done - bar.n)
            if verbose() and what != stage:
                stage = what
                with tqdm.external_write_mode(file=sys.stderr):
                    log(f"{what} ({done}{'' if total is None else f' of {total}'})")

        yield report
