"""What every command does the same way: ``-q``, ``-v``, ``--json``, page, progress, answer last."""

from __future__ import annotations

import contextlib
import io
import json
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:  # `pamsim --help` needs no numpy
    from pamsim.core.computation import Progress

STANDARD_OUTPUT = "-"
"""Value of ``--json`` that asks for the result on standard output."""

_BEGAN, _ANSWER, _OUTPUT = "pamsim.began", "pamsim.answer", "pamsim.output"


def _note(context: click.Context, option: click.Parameter, value: bool) -> bool:
    context.meta[f"pamsim.{option.name}"] = value
    return value


NOTED: Mapping[str, Any] = {"is_flag": True, "callback": _note}
"""Settings of a flag that `given` knows; with ``expose_value=False``, no argument either."""


def given(flag: str) -> bool:
    """Whether the command that runs was given a flag that is `NOTED`, such as ``quiet``."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(f"pamsim.{flag}"))


class Command(click.Command):
    """A command of pamsim; its callback prints details as they come, and gives `answer`."""

    def __init__(self, *args: Any, **options: Any) -> None:
        """Add ``-q`` and ``-v`` to the command's own options."""
        super().__init__(*args, **options)
        for flags, help in (
            (("-q", "--quiet"), "Print only the answer."),
            (("-v", "--verbose"), "Print more details, and a log on standard error."),
        ):
            self.params.append(click.Option(flags, expose_value=False, help=help, **NOTED))
        for param in self.params:
            usual = param.default
            if isinstance(usual, str | int | float) and usual is not False and usual != "":
                param.show_default = True

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; print its answer after all else."""
        ctx.meta.update({_BEGAN: time.perf_counter(), _ANSWER: [], _OUTPUT: sys.stdout})
        # What reads a result on standard output gets nothing else.
        text = sys.stderr if str(ctx.params.get("json_file")) == STANDARD_OUTPUT else sys.stdout
        if verbose():
            from pamsim.core.computation import versions

            log(", ".join(f"{name} {version}" for name, version in versions().items()))
        with contextlib.redirect_stdout(io.StringIO() if quiet() else text):
            code = super().invoke(ctx)
        for line in ctx.meta[_ANSWER]:
            click.echo(line, file=text)
        if verbose():
            log("done")
        return code


@contextlib.contextmanager
def resumable(*, kept: bool = True) -> Iterator[None]:
    """Print how an interrupted run goes on, if what is finished is kept."""
    try:
        yield
    except KeyboardInterrupt:
        if kept:
            click.echo("nothing is lost: go on with the same command and --resume", err=True)
        raise


def exit_code(fine: bool) -> int:
    """Exit code of a command: 1 for a check that failed or an answer that is incomplete."""
    return 0 if fine else 1


def answer(*lines: str) -> None:
    """Give the answer of the command that runs: it is printed last, and alone with ``-q``."""
    click.get_current_context().meta[_ANSWER] += lines


def warn(text: str) -> None:
    """Print a warning about a result; with ``-q`` on standard error."""
    click.echo(f"{click.style('warning:', fg='yellow')} {text}", err=quiet())


def quiet() -> bool:
    """Whether only the answer is wanted."""
    return given("quiet")


def verbose() -> bool:
    """Whether more details and a log are wanted."""
    return given("verbose")


def log(text: str) -> None:
    """Print a line on standard error, with the time since the command began [s]."""
    seconds = time.perf_counter() - click.get_current_context().meta[_BEGAN]
    click.echo(f"{seconds:8.2f} s  {text}", err=True)


def save_json(path: Path | None, result: Mapping[str, Any]) -> None:
    """Write a result to the file given by ``--json``, if it was given."""
    from pamsim.core.encoding import write_json

    if str(path) == STANDARD_OUTPUT:
        standard_output = click.get_current_context().meta[_OUTPUT]
        print(json.dumps(result, indent=1, allow_nan=False), file=standard_output)
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
    if given("open"):
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
