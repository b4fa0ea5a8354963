"""``pamsim replicate``: every printed number of the five papers, recomputed."""

from __future__ import annotations

import time
from collections import Counter
from pathlib import Path
from typing import Any

import click

from pamsim.cli.main import FINDING, OK
from pamsim.cli.output import progress_bar, save_json
from pamsim.core.errors import InputError, nearest
from pamsim.core.versions import versions

SCHEMA = "pamsim-replicate/1"
_WHAT_WIDTH = 62


@click.command(name="replicate")
@click.option("--paper", "papers", multiple=True, help="Letter A to E; may be given repeatedly.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for page and figures.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the result here.")
def command(papers: tuple[str, ...], out: Path | None, json_file: Path | None) -> int:
    """Recompute every printed number of the five source papers and say what agrees.

    Exit 0 when every claim was evaluated: a number that a paper prints wrongly is a finding about
    the paper and no failure of the run. Exit 1 when claims could not be evaluated, 2 on bad input.
    """
    from pamsim.papers.replicate import PAPERS

    wanted = [letter.strip().upper() for letter in papers] or list(PAPERS)
    for letter, given in zip(wanted, papers or wanted, strict=True):
        if letter not in PAPERS:
            raise InputError(f"no paper {given!r}; {nearest(letter, PAPERS)}")
    if out is not None and out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file; name a folder to write the page into")
    wanted = list(dict.fromkeys(wanted))

    result = _run(wanted)
    save_json(json_file, result)
    _print(result)
    if out is not None:
        from pamsim.papers.replication_figures import replication_figures
        from pamsim.report.replication_page import write_replication

        write_replication(result, replication_figures(wanted), out)
        click.echo(f"page: {out / 'index.html'}")
    return FINDING if result["failures"] else OK


def _run(letters: list[str]) -> dict[str, Any]:
    """Result of schema ``pamsim-replicate/1``; a paper that fails does not hide the others."""
    from pamsim.papers.claim import CITATIONS, Verdict
    from pamsim.papers.replicate import replicate

    started = time.monotonic()
    claims: list[dict[str, Any]] = []
    failures: list[dict[str, str]] = []
    with progress_bar() as progress:
        for index, letter in enumerate(letters):
            progress(index, len(letters), f"paper {letter}")
            try:
                claims += [claim.as_dict() for claim in replicate([letter])]
            except Exception as error:  # whatever it is, the other papers still count
                failures.append({"paper": letter, "error": f"{type(error).__name__}: {error}"})
        progress(len(letters), len(letters), "done")
    counted = Counter(claim["verdict"] for claim in claims)
    return {
        "schema": SCHEMA,
        "papers": {letter: CITATIONS[letter] for letter in letters},
        "claims": claims,
        "failures": failures,
        "counts": {verdict.value: counted[verdict.value] for verdict in Verdict},
        "versions": versions(),
        "wall_s": time.monotonic() - started,
    }


def _print(result: dict[str, Any]) -> None:
    click.echo(
        f"{'id':5s} {'statement':{_WHAT_WIDTH}s} {'printed':>12s} {'recomputed':>12s}  verdict"
    )
    for claim in result["claims"]:
        what = claim["what"]
        if len(what) > _WHAT_WIDTH:
            what = what[: _WHAT_WIDTH - 3] + "..."
        click.echo(
            f"{claim['id']:5s} {what:{_WHAT_WIDTH}s} {_short(claim['printed']):>12s}"
            f" {_short(claim['recomputed']):>12s}  {claim['verdict']}"
        )
    for failure in result["failures"]:
        click.echo(f"FAIL  paper {failure['paper']} could not be evaluated: {failure['error']}")
    listed = ", ".join(f"{count} {verdict}" for verdict, count in result["counts"].items())
    click.echo(f"{len(result['claims'])} claims: {listed}")


def _short(value: Any) -> str:
    """A value in a column: what does not fit stands in the JSON file and on the page."""
    if value is None:
        return "-"
    if isinstance(value, list):
        return "words" if not value else f"{_short(value[0])} ..."
    return f"{value:.5g}" if isinstance(value, int | float) else "(words)"
