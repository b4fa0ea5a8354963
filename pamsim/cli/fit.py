"""``pamsim fit``: fit a law to measured data, or rank all laws on them."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import click

from pamsim.cli.main import OK
from pamsim.cli.output import progress_bar, save_json


@click.command(name="fit")
@click.argument("data", type=click.Path(path_type=Path))
@click.option("--model", help="Law to fit; `pamsim models` lists them.")
@click.option("--compare", is_flag=True, help="Rank all laws that suit the data by held-out error.")
@click.option("--hold-out", help="length, pressure or none: what the held-out error leaves out.")
@click.option("--nominal-length", help="Length l0 of the muscle: 300 (mm) or 0.3m.")
@click.option("--diameter", help="Inner diameter at l0, for laws of the braid: 20 (mm) or 2cm.")
@click.option("--fibre-angle", help="Braid angle to the axis at l0: 28.6 (deg) or 0.5rad.")
@click.option("--hold", multiple=True, help="Hold a coefficient: NAME=VALUE, again for each.")
@click.option(
    "--drop-zeros/--keep-zeros",
    default=True,
    show_default=True,
    help="Zeros in a force map mean slack or not measured.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for figure and params.toml.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the result here.")
def command(
    data: Path,
    model: str | None,
    compare: bool,
    hold_out: str | None,
    nominal_length: str | None,
    diameter: str | None,
    fibre_angle: str | None,
    hold: tuple[str, ...],
    drop_zeros: bool,
    out: Path | None,
    json_file: Path | None,
) -> int:
    """Fit a law to the CSV file DATA: least squares, 95 % intervals, errors at unseen points.

    DATA is a force map (p_kpa, contraction or length_mm, force_n), a length-pressure loop (p_kpa,
    length_cm) or force-displacement loops (time_s, force_n, displacement_mm, loop); the unit is in
    the name of each column.
    """
    from pamsim.core.units import parse_quantity
    from pamsim.fitting.fit import fit

    def quantity(text: str | None, unit: str, si: str, option: str) -> float | None:
        return None if text is None else parse_quantity(text, unit, si, where=option)

    with progress_bar() if compare else contextlib.nullcontext() as progress:
        found = fit(
            data,
            model=model,
            compare=compare,
            nominal_length=quantity(nominal_length, "mm", "m", "--nominal-length"),
            diameter=quantity(diameter, "mm", "m", "--diameter"),
            fibre_angle=quantity(fibre_angle, "deg", "rad", "--fibre-angle"),
            hold_out=hold_out,
            held=_held(hold, model),
            drop_zeros=drop_zeros,
            progress=progress,
        )
    result = found.as_dict()
    save_json(json_file, result)
    for note in result["notes"]:
        click.echo(f"note: {note}")
    if compare and result["kind"] == "force_map":
        _print_ranking(result)
    for fitted in result["fits"][:1] if result["kind"] == "force_map" else result["fits"]:
        _print_fit(fitted)
    _print_searches(result["searches"])
    if out is not None:
        from pamsim.report.fit_figure import write_fit_figure
        from pamsim.report.fit_parameters import write_fit_parameters

        for path in (write_fit_figure(result, out), write_fit_parameters(result, out)):
            click.echo(f"wrote {path}")
    return OK


def _held(hold: tuple[str, ...], model: str | None) -> dict[str, float]:
    from pamsim.core.errors import InputError
    from pamsim.core.units import parse_quantity
    from pamsim.fitting.fit import coefficient_unit

    held: dict[str, float] = {}
    for text in hold:
        name, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"--hold {text!r}: write NAME=VALUE, such as scale=1")
        unit = coefficient_unit(model, name)
        held[name] = parse_quantity(value, unit, unit, where=f"--hold {name}")
    return held


def _print_ranking(result: dict[str, Any]) -> None:
    held = result["fits"][0]["held_out"]
    by = f"held-out {held['by']}" if held else "AICc, nothing held out"
    click.echo(f"{len(result['fits'])} laws ranked by {by}; errors in N")
    click.echo("law                       held-out    worst in-sample       AIC  parameters")
    for fitted in result["fits"]:
        scores, held = fitted["scores"], fitted["held_out"] or {}
        click.echo(
            f"{fitted['model']:24s}{_cell(held.get('rmse'))}{_cell(held.get('worst'))}"
            f"{_cell(scores['rmse'], '.2f')}{_cell(scores['aic'])}{scores['free']:12d}"
        )
    for name, why in result["skipped"].items():
        click.echo(f"left out: {name}: {why}")


def _print_fit(fitted: dict[str, Any]) -> None:
    scores, held = fitted["scores"], fitted["held_out"]
    part = f", {fitted['part']} branch" if fitted["part"] else ""
    click.echo(f"{fitted['model']}{part}: {fitted['equation']}")
    for c in fitted["coefficients"]:
        unit = "" if c["unit"] == "1" else f" {c['unit']}"
        line = f"  {c['name']:18s}{c['value']:13.6g}{unit}"
        if c["held"]:
            line += "  held"
        elif c["interval95"] is not None:
            line += "  [{:.4g}, {:.4g}]".format(*c["interval95"])
        if c["flags"]:
            line += f"  ({', '.join(c['flags']).replace('_', ' ')}"
            line += f" with {', '.join(c['partners'])})" if c["partners"] else ")"
        click.echo(line)
    unit = fitted["unit"]
    text = f"  in-sample {scores['rmse']:.4g} {unit} RMS, MAE {scores['mae']:.4g} {unit}"
    if scores["r2"] is not None:
        text += f", R2 {scores['r2']:.5f}"
    click.echo(f"{text}; {scores['points']} points, {scores['free']} coefficients")
    if held is not None:
        each = ", ".join("none" if e is None else f"{e:.3g}" for e in held["group_rmse"])
        total = "none" if held["rmse"] is None else f"{held['rmse']:.4g} {unit} RMS"
        groups = f"{len(held['groups'])} {held['by']}s"
        click.echo(f"  held out in turn, {groups}: {total} ({each})")
    if not fitted["converged"]:
        click.echo("  the solver ran out of evaluations: do not quote these numbers")
    for note in fitted["notes"]:
        click.echo(f"  note: {note}")


def _print_searches(searches: list[dict[str, Any]]) -> None:
    if searches:
        click.echo(
            "search                      cost reached  evaluations  to 0.001 N^2 of the best"
        )
    for run in searches:
        near = run["evaluations_to_tolerance"]
        click.echo(
            f"{run['method']:26s}{run['value']:14.4g}{run['evaluations']:13d}"
            f"{'never' if near is None else near:>26}"
        )


def _cell(value: float | None, form: str = ".1f") -> str:
    if value is None:
        return f"{'none':>10}"
    return f"{value:10.2g}" if abs(value) >= 1e6 else f"{value:10{form}}"
