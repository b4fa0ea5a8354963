"""``pamsim identify``: linear models from a recording or a simulation."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pamsim.cli.main import FINDING, OK
from pamsim.cli.output import progress_bar, save_json

if TYPE_CHECKING:
    from pamsim.core.trial import TrialSet


@click.command(name="identify")
@click.argument("data", type=click.Path(path_type=Path), required=False)
@click.option("--simulate", metavar="RIG", help="No data: identify a simulated step of this rig.")
@click.option("--pressure", help="Set points of the simulated step: 487,0 (kPa) or 4bar,1bar.")
@click.option("--load", help="Mass on the arm in the simulated step: 1.2 or 1200g.")
@click.option("--duration", help="Length of the simulated step: 6 or 800ms.")
@click.option("--input", "given", help="Columns joined by + and -: p1_set_kpa-p2_set_kpa, u1, ...")
@click.option("--output", help="Column or columns to explain; angle_deg if left out.")
@click.option(
    "--order", type=int, help="Of the continuous model, 1 to 5; first and second if left out."
)
@click.option("--zeros", type=int, default=0, show_default=True, help="Of the model of --order.")
@click.option("--poles", default="auto", show_default=True, help="auto, real lags, or any stable.")
@click.option("--dead-time", default="auto", show_default=True, help="auto (both), none or free.")
@click.option("--arx", metavar="NA,NB,NK", help="Orders of the ARX model beside.")
@click.option("--oe", metavar="NB,NF,NK", help="Orders of the output-error model beside.")
@click.option(
    "--start", default="rest", show_default=True, help="Every trial starts at rest, or free."
)
@click.option("--trial", multiple=True, help="Use this trial, again for more; all if left out.")
@click.option("--protocol", multiple=True, help="Use trials of this protocol, again for more.")
@click.option("--hold-out", multiple=True, help="Keep this trial from the fit, to judge models by.")
@click.option(
    "--local/--no-local", default=True, show_default=True, help="Models per operating point."
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for page, figures and CSV.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the result here.")
def command(
    data: Path | None,
    simulate: str | None,
    pressure: str | None,
    load: str | None,
    duration: str | None,
    given: str | None,
    output: str | None,
    order: int | None,
    zeros: int,
    poles: str,
    dead_time: str,
    arx: str | None,
    oe: str | None,
    start: str,
    trial: tuple[str, ...],
    protocol: tuple[str, ...],
    hold_out: tuple[str, ...],
    local: bool,
    out: Path | None,
    json_file: Path | None,
) -> int:
    """Identify transfer functions from DATA: intervals, fit %, poles, and which model to use.

    DATA is a recording (a folder with recording.toml) or a CSV with time_s and any other columns.
    Without DATA a step is simulated, see --simulate. Exits with 1 if no model can be trusted.
    """
    # The fits take exponentials of thousands of tiny matrices, on which BLAS threads only wait for
    # each other: ten times slower on a busy machine. It is read when numpy is first imported.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from pamsim.identification.identify import identify
    from pamsim.identification.models import Choice

    choice = Choice(
        order=order,
        zeros=zeros,
        poles=poles,
        dead_time=dead_time,
        arx=_orders(arx, "--arx"),
        oe=_orders(oe, "--oe"),
        start=start,
    )
    if out is not None:
        _make_folder(out)  # before minutes of work whose result could not be written
    source = _source(data, simulate, pressure, load, duration)
    with progress_bar() as progress:
        found = identify(
            source,
            input=given,
            output=output,
            choice=choice,
            trials=trial,
            protocols=protocol,
            hold_out=hold_out,
            local=local,
            progress=progress,
        )
    result = found.as_dict()
    save_json(json_file, result)
    _print(result)
    if out is not None:
        import dataclasses

        from pamsim.report.identify_page import write_identification

        page, *_ = write_identification(result, dataclasses.asdict(found.curves()), out)
        click.echo(f"page: {page}")
    return OK if result["recommended"] else FINDING


def _source(
    data: Path | None,
    rig: str | None,
    pressure: str | None,
    load: str | None,
    duration: str | None,
) -> Path | TrialSet:
    from pamsim.core.errors import InputError
    from pamsim.core.units import parse_quantity
    from pamsim.identification.data import simulated_step

    asked = {"--pressure": pressure, "--load": load, "--duration": duration}
    if data is not None:
        for option, value in {"--simulate": rig, **asked}.items():
            if value is not None:
                raise InputError(
                    f"{option} is of a simulated step; leave it out, or leave DATA out"
                )
        return data
    if rig is None:
        raise InputError("give DATA, or --simulate with a rig such as mas20_arm")
    set_points = [
        parse_quantity(part, "kPa", "Pa", where="--pressure")
        for part in (pressure or "487,0").split(",")
    ]
    return simulated_step(
        rig,
        pressure=set_points,
        load=parse_quantity(load or "0", "kg", "kg", where="--load"),
        duration=parse_quantity(duration or "6", "s", "s", where="--duration"),
    )


def _make_folder(path: Path) -> None:
    from pamsim.core.errors import InputError

    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None


def _orders(text: str | None, option: str) -> tuple[int, int, int] | None:
    from pamsim.core.errors import InputError

    if text is None:
        return None
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 3 or not all(part.isdigit() for part in parts):
        raise InputError(f"{option} {text!r}: write three whole numbers, such as 2,2,1")
    return int(parts[0]), int(parts[1]), int(parts[2])


def _print(result: dict[str, Any]) -> None:
    for note in result["notes"]:
        click.echo(f"note: {note}")
    given, output = result["input"], result["output"]
    roles = [trial["role"] for trial in result["trials"]]
    held = f", {roles.count('held_out')} held out" if "held_out" in roles else ""
    click.echo(
        f"{output['expression']} from {given['expression']}:"
        f" {roles.count('fitted')} trial(s) fitted{held}"
    )
    for model in result["models"]:
        _print_model(model, model["name"] == result["recommended"])
    for name, why in result["skipped"].items():
        click.echo(f"left out: {name}: {why}")
    if result["local"] is not None:
        click.echo(f"{len(result['local']['models'])} operating points:")
        for item in result["local"]["dependences"]:
            click.echo(f"  {item['sentence']}")
    if result["recommended"]:
        click.echo(f"recommended: {result['recommended']}: {result['reason']}")
    else:
        click.echo(f"recommended: none: {result['reason']}")


def _print_model(model: dict[str, Any], best: bool) -> None:
    fit = f"fits {_number(model['fit_percent'], '.2f')} %"
    if model.get("fit_percent_held_out") is not None:
        fit += f", held out {model['fit_percent_held_out']:.2f} %"
    if model.get("fit_percent_one_step") is not None and model["kind"] == "arx":
        fit += f", one step ahead {model['fit_percent_one_step']:.2f} %"
    click.echo(f"{'*' if best else ' '} {model['name']}: {fit}")
    for item in model["parameters"].values():
        if item["name"][0] in "ab":  # coefficients of discrete models: in the JSON
            continue
        unit = "" if item["unit"] in ("-", "1") else f" {item['unit']}"
        line = f"    {item['name']:5s}{_number(item['value'], '12.5g')}{unit}"
        if item["interval95"] is not None and None not in item["interval95"]:
            low, high = (_number(end, ".4g") for end in item["interval95"])
            line += f"  [{low}, {high}]"
        click.echo(line)
    poles = [pole for pole in model["poles_rad_per_s"] if pole is not None]
    if poles:
        click.echo(f"    poles {', '.join(_complex(*pole) for pole in poles)} rad/s")
    if model["status"] != "converged":
        click.echo(f"    {model['status'].replace('_', ' ')}: {model['sentence']}")
    if model["independence"] is not None:
        click.echo(f"    {model['independence']['sentence']}")


def _complex(real: float, imaginary: float) -> str:
    return f"{real:.4g}" if imaginary == 0.0 else f"{real:.4g}{imaginary:+.4g}j"


def _number(value: float | None, form: str) -> str:
    return "none" if value is None else f"{value:{form}}"
