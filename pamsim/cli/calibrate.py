"""``pamsim calibrate``: rig parameters from recordings and static tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import (
    Command,
    exit_code,
    present,
    progress_bar,
    resumable,
    save_json,
    show_page,
)


def _bounds(context: Any, parameter: Any, texts: tuple[str, ...]) -> dict[str, tuple[str, str]]:
    from pamsim.core.errors import InputError

    bounds: dict[str, tuple[str, str]] = {}
    for text in texts:
        name, _, limits = text.partition("=")
        ends = limits.split(":")
        if len(ends) != 2:
            raise InputError(
                f"--bounds {text}: write NAME=LOW:HIGH, such as chamber.dead_volume=5:40"
            )
        if name in bounds:
            raise InputError(f"--bounds {text}: {name} has a range already; give one")
        bounds[name] = ends[0], ends[1]
    return bounds


@click.command(name="calibrate", cls=Command)
@click.argument("data", nargs=-1, required=True)
@options.recorded_rig
@options.names("--free", names=options.parameter_names, help="Parameters to fit; A=B is one number")
@click.option(
    "--first",
    is_flag=True,
    help="The rig's file may be far off: begin link by link, from the joint back to the valves.",
)
@click.option(
    "--bounds",
    multiple=True,
    callback=_bounds,
    help="Range of a parameter: NAME=LOW:HIGH, file's unit.",
)
@click.option("--prior", is_flag=True, help="Use the rig's stated 95 % intervals as priors.")
@options.names("--channels", help="Kinds to compare; angle, pressure and force if left out")
@options.names("--hold-out", help="Trials or protocols kept for checking")
@click.option("--starts", type=int, default=1, help="Starts of the search.")
@options.seed("Random seed of the starts.")
@click.option("--max-iterations", type=int, default=100, help="Per start.")
@options.names(
    "--profile",
    "profiles",
    names=options.parameter_names,
    help="Compute profile likelihoods for these parameters",
)
@options.threads
@options.resume("Go on with the interrupted fit in --out.")
@options.page("Folder for rig, page, checkpoint.")
def command(
    data: tuple[str, ...], json_file: Path | None, channels: tuple[str, ...], **choices: Any
) -> int:
    """Fit parameters of a rig to DATA and write the calibrated rig.

    DATA are recording folders, CSV files of angles at rest (p1_kpa, p2_kpa, load_kg, angle_deg), or
    mas20 for the printed ones. Exit 0 if every parameter is determined, 1 if not.
    """
    from pamsim.calibration.calibrate import calibrate

    out: Path | None = choices["out"]
    if channels:
        choices["channels"] = channels
    with progress_bar("simulation") as progress, resumable(kept=out is not None):
        calibration = calibrate(data, progress=progress, **choices)
    result = present(calibration, json_file)
    if out is not None:
        from pamsim.report.calibrate_page import write_calibration

        save_json(out / "calibration.json", result)
        page = write_calibration(result, calibration.comparisons, out)
        click.echo(f"rig:  {result['calibrated_rig']}")
        show_page(page)
    return exit_code(result["status"] == "converged")
