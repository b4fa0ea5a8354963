"""``pamsim check``: what recordings are and could show, before a long run."""

from __future__ import annotations

from pathlib import Path

import click

from pamsim.cli.command import Command
from pamsim.cli.main import FINDING, OK
from pamsim.cli.options import (
    RIG,
    effect_names,
    json_option,
    names_option,
    open_option,
    out_option,
    threads_option,
)
from pamsim.cli.output import progress_bar, save_json, show_page, show_summary


@click.command(name="check", cls=Command)
@click.argument("data", nargs=-1, required=True)
@click.option("--rig", type=RIG, help="Shipped rig or rig folder; the recordings' own if left out.")
@names_option("--effects", names=effect_names, help="Effects to look for, all if left out")
@names_option("--hold-out", help="Trials or protocols to judge by")
@threads_option
@out_option("Folder for a page with figures.")
@open_option
@json_option
def command(
    data: tuple[str, ...],
    rig: str | None,
    effects: tuple[str, ...],
    hold_out: tuple[str, ...],
    threads: int | None,
    out: Path | None,
    json_file: Path | None,
) -> int:
    """Report what was read of DATA, what is implausible, and which effects they could show.

    The gap per link shows in which part of the rig the simulation begins to differ. DATA are
    recording folders. Nothing is fitted: it takes seconds, before calibrate and diagnose.
    Exit 1 if anything is suspicious.
    """
    from pamsim.diagnosis.check import check

    with progress_bar() as progress:
        result = check(
            data,
            rig=rig,
            effects=effects,
            hold_out=hold_out,
            threads=threads,
            progress=progress,
        )
    content = result.to_dict()
    save_json(json_file, content)
    show_summary(result.summary())
    if out is not None:
        from pamsim.report.check_page import write_check

        result.save(out)
        show_page(write_check(content, result.comparisons, out))
    return FINDING if result.suspicions else OK
