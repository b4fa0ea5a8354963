"""``pamsim replicate``: every printed number of the five papers, recomputed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer, exit_code, progress_bar, save_json, show_page

if TYPE_CHECKING:
    from pamsim.papers.replicate import Replication

_STATEMENT_WIDTH = 60


@click.command(name="replicate", cls=Command)
@click.option(
    "--paper",
    "papers",
    multiple=True,
    shell_complete=options.listed("pamsim.papers.replicate", "PAPERS"),
    help="matiskova2021, alraouf2025, nguyen2024, vandamme2008 or sarosi; may be given repeatedly.",
)
@options.page("Folder for page and figures.")
def command(papers: tuple[str, ...], out: Path | None, json_file: Path | None) -> int:
    """Recompute every printed number of the five source papers and report what agrees.

    Exit 0 when every claim was evaluated: a number that a paper prints wrongly is a finding about
    the paper and no failure of the run. Exit 1 when claims could not be evaluated, 2 on bad input.
    """
    from pamsim.papers.replicate import replicate

    with progress_bar() as progress:
        replication = replicate(
            [paper.strip().lower() for paper in papers] or None, progress=progress
        )
    result = replication.to_dict()
    save_json(json_file, result)
    _print(replication)
    if out is not None:
        from pamsim.papers.replicate import replication_figures
        from pamsim.report.replication_page import write_replication

        show_page(write_replication(result, replication_figures(replication.papers), out))
    return exit_code(not replication.failures)


def _print(replication: Replication) -> None:
    from pamsim.papers.replicate import PAPERS

    click.echo(
        f"{'id':16s} {'statement':{_STATEMENT_WIDTH}s} {'printed':>12s}"
        f" {'recomputed':>12s}  verdict"
    )
    for claim in replication.claims:
        statement = claim.statement
        if len(statement) > _STATEMENT_WIDTH:
            statement = statement[: _STATEMENT_WIDTH - 3] + "..."
        click.echo(
            f"{claim.id:16s} {statement:{_STATEMENT_WIDTH}s} {_short(claim.printed):>12s}"
            f" {_short(claim.recomputed):>12s}  {claim.verdict.value}"
            + (f", the fact of {claim.same_as}" if claim.same_as else "")
        )
    for failure in replication.failures:
        name = PAPERS[failure["paper"]]
        click.echo(
            f"{click.style('FAIL', fg='red')}  {name} could not be evaluated: {failure['error']}"
        )
    answer(replication.summary())


def _short(value: Any) -> str:
    """A value in a column: what does not fit stands in the JSON file and on the page."""
    if value is None:
        return "-"
    if isinstance(value, tuple):
        return f"{_short(value[0])} ..."
    return f"{value:.5g}" if isinstance(value, float) else "(words)"
