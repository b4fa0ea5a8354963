"""``pamsim view``: an interactive window on a rig or a recording."""

from __future__ import annotations

from pathlib import Path

import click

from pamsim.cli.main import OK


@click.command(name="view")
@click.argument("recording", type=click.Path(path_type=Path), required=False)
@click.option(
    "--rig", help="Shipped rig or rig folder; mas20_arm, or the recording's, if left out."
)
@click.option("--pressure", help="Set points to start from, one per muscle; 200,200 if left out.")
@click.option("--load", help="Mass on the arm: 1.2 or 1200g; none if left out.")
@click.option("--trial", help="Trial of the recording; its first if left out.")
@click.option("--speed", type=float, help="Of the replay: 1 is real time, 0.5 slow motion.")
def command(
    recording: Path | None,
    rig: str | None,
    pressure: str | None,
    load: str | None,
    trial: str | None,
    speed: float | None,
) -> int:
    """Simulate a rig in real time, or replay RECORDING in a loop, until the window is closed.

    Set points are moved by the sliders of the window's panel Control [Pa].
    """
    from pamsim.core.errors import InputError

    if recording is not None:
        for option, value in (("--pressure", pressure), ("--load", load)):
            if value is not None:
                raise InputError(f"{option} is known from the recording")
        from pamsim.scene.replay import read_replay
        from pamsim.scene.watch import watch_replay

        replay = read_replay(recording, trial=trial, rig=rig)
        watch_replay(replay, speed=1.0 if speed is None else speed)
        return OK
    for option, value in (("--trial", trial), ("--speed", speed)):
        if value is not None:
            raise InputError(f"{option} needs a RECORDING to replay")
    from pamsim.core.units import parse_quantity
    from pamsim.engine.rig import load_rig
    from pamsim.scene.watch import watch_live

    start = [
        parse_quantity(p, "kPa", "Pa", where="--pressure")
        for p in (pressure or "200,200").split(",")
    ]
    mass = parse_quantity(load or "0", "kg", "kg", where="--load")
    watch_live(load_rig(rig or "mas20_arm", scene=True), start, load=mass)
    return OK
