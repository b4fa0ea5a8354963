"""``pamsim render``: a picture of a rig, without a screen."""

from __future__ import annotations

from pathlib import Path

import click

from pamsim.cli.main import OK


@click.command(name="render")
@click.argument("picture", type=click.Path(path_type=Path))
@click.option("--rig", default="mas20_arm", show_default=True, help="Shipped rig or rig folder.")
@click.option("--pressure", default="487,100", show_default=True, help="Pressures, one per muscle.")
@click.option("--load", default="2.14", show_default=True, help="Mass on the arm.")
@click.option("--camera", default="overview", show_default=True, help="Camera of the scene.")
@click.option("--width", type=int, default=1600, show_default=True, help="[pixel]")
@click.option("--height", type=int, default=1000, show_default=True, help="[pixel]")
def command(
    picture: Path, rig: str, pressure: str, load: str, camera: str, width: int, height: int
) -> int:
    """Let the rig come to rest at some pressures and write PICTURE (png or jpg)."""
    from pamsim.core.units import parse_quantity
    from pamsim.workflows.portrait import portrait

    wanted = [parse_quantity(p, "kPa", "Pa", where="--pressure") for p in pressure.split(",")]
    portrait(
        picture,
        rig=rig,
        pressures=wanted,
        load=parse_quantity(load, "kg", "kg", where="--load"),
        camera=camera,
        size=(width, height),
    )
    click.echo(f"wrote {picture}")
    return OK
