"""``pamsim identify``: linear models from a recording or a simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, exit_code, present, progress_bar, show_page
from pamsim.core.errors import InputError

if TYPE_CHECKING:
    from pamsim.recordings.trial import TrialSet


class _Orders(click.ParamType):
    """Three whole numbers separated by commas, such as ``2,2,1``."""

    name = "orders"

    def convert(self, value: Any, param: click.Parameter | None, ctx: Any) -> tuple[int, ...]:
        """Read the text of an option; an `InputError` for anything else."""
        parts = [part.strip() for part in value.split(",")]
        if len(parts) != 3 or not all(part.isdigit() for part in parts):
            raise InputError(
                f"`{param.name if param else ''}` {value!r}: write three whole numbers, as 2,2,1"
            )
        return tuple(map(int, parts))


@click.command(name="identify", cls=Command)
@click.argument("data", type=options.PATH, nargs=-1)
@click.option(
    "--simulate",
    "rig",
    type=options.RIG,
    metavar="RIG",
    help="No DATA: identify a simulated step of this rig.",
)
@click.option(
    "--pressure", type=options.PRESSURES, help="Set points of that step: 487,0 or 4bar,1bar."
)
@options.load("Mass on the arm in that step: 1.2 or 1200g.")
@click.option("--duration", type=options.SECONDS, help="Length of that step: 6 or 800ms.")
@click.option(
    "--input",
    multiple=True,
    help="Column, or columns joined by + and -: p1_set_kpa-p2_set_kpa, u1. Again for more inputs.",
)
@click.option("--output", help="Column or columns to explain; angle_deg if omitted.")
@click.option("--time", help="Column of a table's clock; found by its name if omitted.")
@click.option(
    "--dt", type=options.SECONDS, help="Time between the rows of a table without a clock: 2s."
)
@click.option("--hold", help="Hold between the rows of a table: zoh or foh; guessed if omitted.")
@click.option("--order", type=int, help="Poles of the model, 0 to 6; chosen if omitted.")
@click.option("--zeros", type=int, default=0, help="Zeros of that model.")
@click.option("--integrators", type=int, default=0, help="Its poles at 0.")
@click.option("--poles", default="auto", help="Poles to try: auto, real or any (stable).")
@click.option(
    "--dead-time",
    default="auto",
    help="Dead time: none, free (it is fitted), or auto (both are tried).",
)
@click.option("--arx", type=_Orders(), metavar="NA,NB,NK", help="Orders of an ARX model.")
@click.option("--oe", type=_Orders(), metavar="NB,NF,NK", help="Orders of an output-error model.")
@click.option(
    "--initial-state",
    "start",
    default="auto",
    help="State at the start of a trial: rest, free (it is fitted), or auto.",
)
@options.names("--trial", "trials", help="Trials to use; all if omitted")
@options.names("--protocol", "protocols", help="Protocols to use; all if omitted")
@options.names(
    "--hold-out", "hold_out", help="Trials to judge the models by, or 30% of each, not fitted"
)
@click.option("--local/--no-local", default=True, help="Models at every operating point.")
@options.page("Folder for page, figures and CSV.")
def command(
    data: tuple[Path, ...],
    rig: str | None,
    out: Path | None,
    json_file: Path | None,
    hold_out: tuple[str, ...],
    **choices: Any,
) -> int:
    """Identify transfer functions from DATA: intervals, fit %, poles, and which model to use.

    DATA is a recording (a folder with recording.toml) or a table of any columns (CSV, MAT, npz,
    Parquet); several are fitted together. A table of frequency_hz or omega_rad_s, magnitude and
    phase_deg (or real and imag) is fitted as a frequency response. Without DATA a step is
    simulated, see --simulate. Exits with 1 if no model can be trusted.
    """
    from pamsim.identification.identify import identify

    step = {name: choices.pop(name) for name in ("pressure", "load", "duration")}
    source = _source(data, rig, step)
    with progress_bar() as progress:
        identification = identify(
            source, hold_out=_names_or_share(hold_out), progress=progress, **choices
        )
    present(identification, json_file)
    if out is not None:
        from pamsim.report.identify_page import write_identification

        show_page(write_identification(identification, out))
    return exit_code(bool(identification.best))


def _names_or_share(hold_out: tuple[str, ...]) -> tuple[str, ...] | float:
    from pamsim.core.units import parse_quantity

    if len(hold_out) == 1 and hold_out[0].endswith("%"):
        return parse_quantity(hold_out[0], "1", "1", where="`hold_out`")
    return hold_out


def _source(
    data: tuple[Path, ...], rig: str | None, step: dict[str, Any]
) -> tuple[Path, ...] | TrialSet:
    from pamsim.engine.simulate import simulated_step

    if data:
        options.refuse("describes a simulated step; omit it, or omit DATA", rig=rig, **step)
        return data
    if rig is None:
        raise InputError("give DATA, or --simulate with a rig such as mas20_arm")
    return simulated_step(rig, **{name: value for name, value in step.items() if value is not None})
