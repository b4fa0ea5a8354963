"""``pamsim calibrate``: rig parameters from recordings and static tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli.main import FINDING, OK
from pamsim.cli.output import progress_bar, save_json


@click.command(name="calibrate")
@click.argument("data", nargs=-1, required=True)
@click.option("--rig", help="Shipped rig or rig folder; the recordings' own if left out.")
@click.option("--free", multiple=True, help="Parameters to fit: NAME,NAME; A=B is one number.")
@click.option("--bounds", multiple=True, help="Range of a parameter: NAME=LOW:HIGH, file's unit.")
@click.option("--prior", is_flag=True, help="Hold on to the 95 % intervals that the rig states.")
@click.option("--channels", default="angle,pressure,force", show_default=True, help="To compare.")
@click.option("--hold-out", multiple=True, help="Trials or protocols kept for checking: NAME,NAME.")
@click.option("--starts", type=int, default=1, show_default=True, help="Starts of the search.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of the starts.")
@click.option("--max-iterations", type=int, default=100, show_default=True, help="Per start.")
@click.option("--profile", multiple=True, help="Free parameters to walk along: NAME,NAME.")
@click.option("--threads", type=int, help="Simulations at a time; one per processor if left out.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for rig, page, checkpoint.")
@click.option("--resume", is_flag=True, help="Go on with the interrupted fit in --out.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the result here.")
def command(
    data: tuple[str, ...],
    rig: str | None,
    free: tuple[str, ...],
    bounds: tuple[str, ...],
    prior: bool,
    channels: str,
    hold_out: tuple[str, ...],
    starts: int,
    seed: int,
    max_iterations: int,
    profile: tuple[str, ...],
    threads: int | None,
    out: Path | None,
    resume: bool,
    json_file: Path | None,
) -> int:
    """Fit parameters of a rig to DATA and write the calibrated rig.

    DATA are recording folders, CSV files of angles at rest (p1_kpa, p2_kpa, load_kg, angle_deg), or
    mas20 for the printed ones. Exit 0 if every parameter is determined, 1 if the fit has a doubt.
    """
    from pamsim.calibration.calibrate import calibrate
    from pamsim.core.errors import InputError

    limits: dict[str, str] = {}
    for text in bounds:
        name, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"--bounds {text!r}: write NAME=LOW:HIGH")
        limits[name] = value
    with progress_bar("simulation") as progress:
        try:
            found = calibrate(
                data,
                rig=rig,
                free=_listed(free),
                bounds=limits,
                prior=prior,
                channels=_listed((channels,)),
                held_out=_listed(hold_out),
                starts=starts,
                seed=seed,
                max_iterations=max_iterations,
                profiles=_listed(profile),
                out=out,
                resume=resume,
                threads=threads,
                progress=progress,
            )
        except KeyboardInterrupt:
            if out is not None:
                click.echo("nothing is lost: go on with the same command and --resume", err=True)
            raise
    result = found.as_dict()
    save_json(json_file, result)
    _print(result)
    if out is not None:
        from pamsim.report.calibrate_page import write_calibration

        save_json(out / "calibration.json", result)
        write_calibration(result, found.comparisons, out)
        click.echo(f"rig:  {result['calibrated_rig']}")
        click.echo(f"page: {out / 'index.html'}")
    return OK if result["status"] == "converged" else FINDING


def _listed(texts: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(part.strip() for text in texts for part in text.split(",") if part.strip())


def _print(result: dict[str, Any]) -> None:
    for note in result["notes"]:
        click.echo(f"note: {note}")
    width = max(len(p["name"]) for p in result["parameters"])
    click.echo(f"{'parameter':{width}s}       before        after  95 % interval")
    for p in result["parameters"]:
        written = p["written"]
        between = written["interval95"]
        interval = "none" if between is None else f"[{between[0]:.5g}, {between[1]:.5g}]"
        unit = "" if written["unit"] == "1" else f" {written['unit']}"
        click.echo(
            f"{p['name']:{width}s} {written['before']:12.6g} {written['value']:12.6g}"
            f"  {interval}{unit}"
        )
    for p in result["parameters"]:
        if p["sentence"]:
            click.echo(f"doubt: {p['sentence']}")
    for text in result["calibration"]["determined"]:
        click.echo(f"determined: {text}")
    for name, profile in ((p["name"], p) for p in result["profiles"]):
        click.echo(f"profile of {name}: {profile['sentence']}")
    click.echo("root mean square misfit      before     after   held-out before     after")
    for row in result["misfit"]:
        numbers = [row[k] for k in ("before", "after", "held_out_before", "held_out_after")]
        cells = ["none" if n is None else f"{n:.4g}" for n in numbers]
        click.echo(
            f"{row['channel'] + ' [' + row['unit'] + ']':25s}{cells[0]:>10s}{cells[1]:>10s}"
            f"{cells[2]:>18s}{cells[3]:>10s}"
        )
    click.echo(
        f"{result['status'].replace('_', ' ')}: {result['sentence']}; {result['simulations']}"
        f" simulations in {result['seconds']:.1f} s"
    )
