"""``pamsim view``: an interactive window on a rig or a recording."""

from __future__ import annotations

from pathlib import Path

import click

from pamsim.cli.main import OK
from pamsim.cli.options import KILOGRAMS, PATH, PRESSURES, RIG, refuse


@click.command(name="view")
@click.argument("recording", type=PATH, required=False)
@click.option(
    "--rig", type=RIG, help="Shipped rig or rig folder; mas20_arm, or the recording's, if left out."
)
@click.option(
    "--pressure",
    type=PRESSURES,
    help="Set points to start from, one per muscle [kPa]; 200,200 if left out.",
)
@click.option("--load", type=KILOGRAMS, help="Mass on the arm: 1.2 or 1200g; none if left out.")
@click.option("--trial", help="Trial of the recording; its first if left out.")
@click.option("--speed", type=float, help="Of the replay: 1 is real time, 0.5 slow motion.")
def command(
    recording: Path | None,
    rig: str | None,
    pressure: list[float] | None,
    load: float | None,
    trial: str | None,
    speed: float | None,
) -> int:
    """Simulate a rig in real time, or replay RECORDING in a loop, until the window is closed.

    The sliders of the window's panel Control move the set points [Pa].
    """
    if recording is not None:
        refuse("is known from the recording", pressure=pressure, load=load)
        from pamsim.scene.replay import read_replay
        from pamsim.scene.watch import watch_replay

        replay = read_replay(recording, trial=trial, rig=rig)
        watch_replay(replay, speed=1.0 if speed is None else speed)
        return OK
    refuse("needs a RECORDING to replay", trial=trial, speed=speed)
    from pamsim.engine.rig import load_rig
    from pamsim.scene.watch import watch_live

    watch_live(
        load_rig(rig or "mas20_arm", scene=True), pressure or (200e3, 200e3), load=load or 0.0
    )
    return OK
