"""``pamsim fit``: fit a law to measured data, or rank all laws on them."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer, exit_code, progress_bar, save_json, show_page, warn
from pamsim.cli.main import with_flags
from pamsim.core.errors import InputError

_MILLIMETRES = options.Quantity("mm", "m")


@click.command(name="fit", cls=Command)
@click.argument("data", type=options.PATH)
@click.option(
    "--model",
    shell_complete=options.completed(options.law_names),
    help="Law to fit; `pamsim list models` lists them.",
)
@options.laws_rig
@click.option("--compare", is_flag=True, help="Rank all laws that suit the data by held-out error.")
@click.option(
    "--hold-out",
    shell_complete=options.listed("pamsim.fitting.fit", "HOLD_OUT"),
    help="What to hold out in turn: length, pressure or none.",
)
@click.option(
    "--nominal-length", type=_MILLIMETRES, help="Length l0 of the muscle: 300 (mm) or 0.3m."
)
@click.option(
    "--diameter", type=_MILLIMETRES, help="Inner diameter at l0, for laws of the braid: 20 or 2cm."
)
@click.option(
    "--fibre-angle",
    type=options.Quantity("deg", "rad"),
    help="Braid angle to the axis at l0: 28.6 (deg).",
)
@click.option(
    "--hold", "held", multiple=True, help="Hold a coefficient: NAME=VALUE, again for each."
)
@click.option(
    "--drop-zeros/--keep-zeros",
    default=True,
    help="Zeros in a force map mean slack or not measured.",
)
@options.page("Folder for page and params.toml.")
def command(
    data: Path,
    model: str | None,
    compare: bool,
    held: tuple[str, ...],
    rig: str | None,
    out: Path | None,
    json_file: Path | None,
    **choices: Any,
) -> int:
    """Fit a law to the CSV file DATA: least squares, 95 % intervals, errors at held-out points.

    DATA is a force map (p_kpa, contraction or length_mm, force_n), a length-pressure loop (p_kpa,
    length_cm) or force-displacement loops (time_s, force_n, displacement_mm, loop); the unit is in
    the name of each column. Exit 1 if the search did not converge.
    """
    from pamsim.fitting.fit import fit
    from pamsim.fitting.result import answer_lines, detail_lines
    from pamsim.recordings.rig_file import add_rigs_laws

    add_rigs_laws(rig)
    with progress_bar() if compare else contextlib.nullcontext() as progress:
        choices |= {"model": model, "compare": compare, "held": _held(held, model)}
        result = fit(data, progress=progress, **choices)
    found = result.to_dict()
    save_json(json_file, found)
    for line in detail_lines(found):
        click.echo(with_flags(line, command))
    for warning in result.warnings:
        warn(warning)
    answer(*answer_lines(found))
    if out is not None:
        from pamsim.report.fit_figure import write_fit

        click.echo(f"wrote {result.save_parameters(out)}")
        show_page(write_fit(found, out))
    best = found["fits"][: 1 if compare and found["kind"] == "force_map" else None]
    return exit_code(all(one["converged"] for one in best))


def _held(texts: tuple[str, ...], model: str | None) -> dict[str, float]:
    from pamsim.core.units import parse_quantity
    from pamsim.fitting.fit import coefficient_unit

    held: dict[str, float] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"`held` {text!r}: write NAME=VALUE, such as scale=1")
        if name in held:
            raise InputError(f"`held` {text!r}: {name} is held already; give one value")
        unit = coefficient_unit(model, name)
        held[name] = parse_quantity(value, unit, unit, where=f"--hold {name}")
    return held
