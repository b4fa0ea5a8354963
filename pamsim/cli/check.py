"""``pamsim check``: what recordings are and could show, before a long run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, exit_code, present, progress_bar, show_page


@click.command(name="check", cls=Command)
@click.argument("data", nargs=-1, required=True)
@options.recorded_rig
@options.names("--effects", names=options.effect_names, help="Effects to look for, all if left out")
@options.names("--hold-out", help="Trials or protocols to judge by")
@options.threads
@options.page("Folder for a page with figures.")
def command(data: tuple[str, ...], out: Path | None, json_file: Path | None, **choices: Any) -> int:
    """Report what was read of DATA, what is implausible, and which effects they could show.

    The gap per link shows in which part of the rig the simulation begins to differ. DATA are
    recording folders. Nothing is fitted: it takes seconds, before calibrate and diagnose.
    Exit 1 if anything is suspicious.
    """
    from pamsim.diagnosis.check import check

    with progress_bar() as progress:
        result = check(data, progress=progress, **choices)
    content = present(result, json_file)
    if out is not None:
        from pamsim.report.check_page import write_check

        result.save(out)
        show_page(write_check(content, result.comparisons, out))
    return exit_code(not result.suspicions)
