"""What every command does the same way: ``-q``, ``-v``, ``--json -``, its answer printed last."""

from __future__ import annotations

import contextlib
import io
import sys
import time
from typing import Any

import click

STANDARD_OUTPUT = "-"
"""Value of ``--json`` that asks for the result on standard output."""

_BEGAN, _QUIET, _VERBOSE = "pamsim.began", "pamsim.quiet", "pamsim.verbose"
_ANSWER, _OUTPUT = "pamsim.answer", "pamsim.output"


class Command(click.Command):
    """A command of pamsim; its callback prints details as they come, and gives `answer`."""

    def __init__(self, *args: Any, **options: Any) -> None:
        """Add ``-q`` and ``-v`` to the command's own options."""
        super().__init__(*args, **options)
        for flags, help in (
            (("-q", "--quiet"), "Print only the answer."),
            (("-v", "--verbose"), "Print more details, and a log on standard error."),
        ):
            self.params.append(click.Option(flags, is_flag=True, help=help))
        for param in self.params:
            usual = param.default
            if isinstance(usual, str | int | float) and usual is not False and usual != "":
                param.show_default = True

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; print its answer after all else."""
        ctx.meta[_BEGAN] = time.perf_counter()
        ctx.meta[_QUIET], ctx.meta[_VERBOSE] = ctx.params.pop("quiet"), ctx.params.pop("verbose")
        ctx.meta[_ANSWER], ctx.meta[_OUTPUT] = [], sys.stdout
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


def answer(*lines: str) -> None:
    """Give the answer of the command that runs: it is printed last, and alone with ``-q``."""
    click.get_current_context().meta[_ANSWER] += lines


def warn(text: str) -> None:
    """Print a warning about a result; with ``-q`` on standard error."""
    click.echo(f"{click.style('warning:', fg='yellow')} {text}", err=quiet())


def standard_output() -> Any:
    """The stream for a result that ``--json -`` asks for."""
    return click.get_current_context().meta[_OUTPUT]


def quiet() -> bool:
    """Whether only the answer is wanted."""
    return _noted(_QUIET)


def verbose() -> bool:
    """Whether more details and a log are wanted."""
    return _noted(_VERBOSE)


def log(text: str) -> None:
    """Print a line on standard error, with the time since the command began [s]."""
    seconds = time.perf_counter() - click.get_current_context().meta[_BEGAN]
    click.echo(f"{seconds:8.2f} s  {text}", err=True)


def _noted(key: str) -> bool:
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(key))
