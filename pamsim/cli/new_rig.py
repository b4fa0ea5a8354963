"""``pamsim new-rig``: a rig folder to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer


@click.command(name="new-rig", cls=Command)
@click.argument("name")
@click.option(
    "--kind",
    default="",
    shell_complete=options.listed("pamsim.engine.new_rig", "KINDS"),
    help="joint: one joint, two muscles; leg: hip and knee, four muscles; bench: one muscle that"
    " lifts a weight; bellows: one joint, two bellows that push.",
)
@click.option(
    "--mjcf", type=options.PATH, help="Your own model instead; each tendon gets a muscle."
)
@click.option("--pushing", is_flag=True, help="Its tendons get bellows or pistons, which push.")
@click.option("--out", type=options.PATH, help="Folder to write; NAME if left out.")
@options.force
def command(name: str, out: Path | None, **choices: Any) -> None:
    """Write a rig folder to start from: MJCF, params.toml and README.

    It runs as it is. Every effect that a muscle can have is there and off, so that you change
    numbers and add none.
    """
    from pamsim.core.files import results_folder
    from pamsim.engine.new_rig import new_rig
    from pamsim.engine.rig import load_rig

    with results_folder(out or Path(name), resume=True):  # beside the MJCF, which may lie there
        folder = new_rig(name, out=out, force=options.forced(), **choices)
    rig = load_rig(folder)
    click.echo(f"rig {rig.name}: joints {', '.join(rig.joints)}; muscles {', '.join(rig.muscles)}")
    answer(f"wrote {folder}; next: correct the numbers in {folder / 'params.toml'}")
