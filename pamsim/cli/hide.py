"""``pamsim hide``: synthetic recordings with hidden effects."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli.main import OK
from pamsim.cli.output import save_json


@click.command(name="hide")
@click.argument("effects")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder to write.")
@click.option("--rig", default="mas20_arm", show_default=True, help="Shipped rig or rig folder.")
@click.option("--size", default="1", show_default=True, help="Of each effect, in typical sizes.")
@click.option(
    "--formulation",
    default="library",
    show_default=True,
    help="library: the library's own formulas; independent: other formulas, finer time step.",
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
@click.option("--seed", type=int, default=0, show_default=True, help="Random seed.")
@click.option(
    "--json", "json_file", type=click.Path(path_type=Path), help="Write the ground truth here."
)
def command(
    effects: str,
    out: Path,
    rig: str,
    size: str,
    formulation: str,
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

    Effects that the library does not hold, such as sprocket_ripple, can be hidden too. Writes a
    recording folder and, beside it, the ground truth.
    """
    from pamsim.core.units import parse_quantity
    from pamsim.twins.hide import hide

    names = [] if effects == "none" else [part.strip() for part in effects.split("+")]
    sizes = [parse_quantity(part, "1", "1", where="--size") for part in size.split(",")]
    if len(sizes) == 1:
        sizes *= len(names)
    if len(sizes) != len(names):
        raise click.UsageError(f"{len(sizes)} sizes for {len(names)} effects; give one, or each")
    length = None if duration is None else parse_quantity(duration, "s", "s", where="--duration")
    options: dict[str, Any] = {} if protocols is None else {"protocols": _names(protocols)}
    recording = hide(
        rig,
        dict(zip(names, sizes, strict=True)),
        repeats=repeats,
        duration=length,
        coloured=coloured,
        noise=noise,
        variation=variation,
        forces=not no_forces,
        formulation=formulation,
        seed=seed,
        **options,
    )
    ground_truth = recording.save(out)
    save_json(json_file, recording.to_dict())
    click.echo(recording.summary())
    click.echo(f"recording: {out}")
    click.echo(f"ground truth: {ground_truth}")
    return OK


def _names(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(","))
