"""``pamsim import``: a lab's own log into a recording."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer, save_json
from pamsim.core.errors import InputError


def _spans(
    context: object, parameter: click.Parameter, text: str
) -> dict[str, list[tuple[float, float]]]:
    """Read ``12:22,31.5:41.5`` or ``fill=12:22,vent=31.5:41.5``, by protocol."""
    spans: dict[str, list[tuple[float, float]]] = {}
    for part in text.split(",") if text else []:
        protocol, _, span = part.rpartition("=")
        begin, _, end = span.partition(":")
        try:
            ends = float(begin), float(end)
        except ValueError:
            ends = (math.nan, math.nan)
        if not all(map(math.isfinite, ends)):
            raise InputError(
                f"`segments` {text}: write BEGIN:END,BEGIN:END in seconds, or"
                " PROTOCOL=BEGIN:END,PROTOCOL=BEGIN:END"
            )
        spans.setdefault(protocol.strip(), []).append(ends)
    return spans


@click.command(name="import", cls=Command)
@click.argument("logs", nargs=-1, required=True)
@click.option(
    "--rig", type=options.RIG, required=True, help="Shipped rig or rig folder that the logs are of."
)
@click.option("--out", type=options.PATH, required=True, help="Folder to write.")
@click.option(
    "--column",
    "columns",
    multiple=True,
    help="What a column is: QUANTITY=NAME or QUANTITY=NAME:UNIT, such as knee.angle=-phi:deg,"
    " where - turns the sign, or knee.torque=F*0.0069m:N. column_1, column_2 in a log without"
    " header. Again for more; the others are guessed.",
)
@click.option("--ignore", multiple=True, help="A column to leave out. Again for more.")
@click.option(
    "--drive",
    default="",
    help="What drives the muscles: valve, pulse, pressure_set, measured or sealed; or of some"
    " muscles and joints: flexor=measured,knee=angle. What was commanded, or measured, if left"
    " out.",
)
@click.option(
    "--beside",
    type=options.PATH,
    multiple=True,
    help="Of each log, what another logger recorded meanwhile, with a clock of its own.",
)
@click.option(
    "--shared",
    default="",
    help="Columns of both with one signal, sync=trigger: by it the clocks' offset is found.",
)
@click.option(
    "--offset", default="", help="Or what the log's clock shows when the other is at 0: 1.25s."
)
@click.option(
    "--schedule",
    type=options.PATH,
    multiple=True,
    help="Of each log, or of all, a table of what was commanded when, if it was not logged; a row"
    " holds until the next.",
)
@click.option("--protocol", default="", help="Makes the logs repeats; their names if left out.")
@click.option(
    "--rate", default="", help="Row rate without a clock; with one, rate to resample to: 200Hz."
)
@click.option("--wraps", default="", help="Time after which the clock begins again at 0: 2s.")
@click.option("--period", default="", help="Cut a log that repeats into trials: 9.93s.")
@click.option(
    "--segments",
    default="",
    callback=_spans,
    help="Or where its trials are: 12:22,31:41, or fill=12:22,vent=31:41.",
)
@click.option("--lead-in", default="", help="Simulated before each trial, not compared: 2s.")
@options.load("Mass on the arm.", default="0")
@options.json
def command(logs: tuple[str, ...], out: Path, json_file: Path | None, **choices: Any) -> None:
    """Make a recording of LOGS: CSV, MAT, npz or Parquet files, copied as they lie.

    Columns, units and signs are guessed from names and values. What each column was taken for is
    printed, with what is not sure, and stands in recording.toml, where you may correct it.
    """
    from pamsim.comparison.import_log import import_log
    from pamsim.core.files import results_folder

    with results_folder(out, resume=True):  # beside the log, which may lie there
        found = import_log(logs, out=out, force=options.forced(), **choices)
    save_json(json_file, found.to_dict())
    click.echo(found.summary())
    answer(f"wrote {out / 'recording.toml'}; next: pamsim check {out}")
