"""``pamsim hide``: twin data with hidden effects."""

from __future__ import annotations

from pathlib import Path

import click

from pamsim.cli.main import OK
from pamsim.cli.output import save_json


@click.command(name="hide")
@click.argument("effects")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder to write.")
@click.option("--rig", default="mas20_arm", show_default=True, help="Shipped rig or rig folder.")
@click.option("--size", default="1", show_default=True, help="Of each effect, in typical sizes.")
@click.option(
    "--tier",
    default="same",
    show_default=True,
    help="same: as the library formulates effects; different: other formulas, finer time step.",
)
@click.option("--protocols", help="Inputs, such as triangle,bursts; all if left out.")
@click.option("--repeats", type=int, default=4, show_default=True, help="Trials per setting.")
@click.option("--duration", help="Of a trial, such as 5s; 8 s if left out.")
@click.option("--coloured", is_flag=True, help="Noise half of which drifts; white if left out.")
@click.option("--noise", type=float, default=1.0, show_default=True, help="Factor on all noise.")
@click.option(
    "--variation", type=float, default=0.003, show_default=True, help="From trial to trial."
)
@click.option("--no-forces", is_flag=True, help="Measure no muscle forces.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of everything random.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the truth here.")
def command(
    effects: str,
    out: Path,
    rig: str,
    size: str,
    tier: str,
    protocols: str | None,
    repeats: int,
    duration: str | None,
    coloured: bool,
    noise: float,
    variation: float,
    no_forces: bool,
    seed: int,
    json_file: Path | None,
) -> int:
    """Record a rig in which EFFECTS are hidden: air_leak, or air_leak+coulomb_friction, or none.

    Names of truths that no effect of the library states, such as sprocket_ripple, are taken too.
    Writes a recording folder and, beside it, the truth.
    """
    from pamsim.core.units import parse_quantity
    from pamsim.twins.hide import NOTHING, hide, truth_file
    from pamsim.twins.twin_data import TwinSettings

    names = [] if effects == NOTHING else [part.strip() for part in effects.split("+")]
    sizes = [parse_quantity(part, "1", "1", where="--size") for part in size.split(",")]
    if len(sizes) == 1:
        sizes *= len(names)
    if len(sizes) != len(names):
        raise click.UsageError(f"{len(sizes)} sizes for {len(names)} effects; give one, or each")
    length = None if duration is None else parse_quantity(duration, "s", "s", where="--duration")
    settings = TwinSettings(
        repeats=repeats,
        duration=length,
        coloured=coloured,
        noise=noise,
        variation=variation,
        forces=not no_forces,
        tier=tier,
        seed=seed,
    )
    if protocols is not None:
        from dataclasses import replace

        settings = replace(settings, protocols=tuple(p.strip() for p in protocols.split(",")))
    truth = hide(list(zip(names, sizes, strict=True)), out, rig=rig, settings=settings)
    save_json(json_file, truth)
    click.echo(f"wrote {truth['trials']} trials to {out}; the truth is in {truth_file(out)}")
    return OK
