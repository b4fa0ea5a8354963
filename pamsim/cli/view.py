"""``pamsim view``: an interactive window on a rig or a recording."""

from __future__ import annotations

from pathlib import Path

import click

from pamsim.cli import options
from pamsim.cli.command import Command

_START = 200e3  # gauge pressure at first [Pa], where the supply gives twice as much


@click.command(name="view", cls=Command)
@click.argument("recording", type=options.PATH, required=False)
@options.shown_rig
@click.option(
    "--pressure",
    type=options.PRESSURES,
    help="Set points to start from, one per muscle [kPa]; 200 each if left out.",
)
@options.load("Mass on the arm: 1.2 or 1200g; none if left out.")
@options.names(
    "--effects",
    names=options.effect_names,
    help="Effects with a slider, all that the rig can have if left out",
)
@click.option("--trial", help="Trial of the recording; its first if left out.")
@click.option("--speed", type=float, help="Of the replay: 1 is real time, 0.5 slow motion.")
def command(
    recording: Path | None,
    rig: str | None,
    pressure: list[float] | None,
    load: float | None,
    effects: tuple[str, ...],
    trial: str | None,
    speed: float | None,
) -> None:
    """Simulate a rig in real time, or replay RECORDING in a loop, until the window is closed.

    Beside the arm run its angle, its pressures and the loop that they draw. The sliders of the
    window's panel Control move the set points [kPa] and the size of each effect: 0 is off, 1 its
    typical size.
    """
    if recording is not None:
        options.refuse("is known from the recording", pressure=pressure, load=load)
        options.refuse("is of a simulation, not of a recording", effects=effects or None)
        from pamsim.scene.replay import read_replay
        from pamsim.scene.viewer import watch_replay

        replay = read_replay(recording, trial=trial, rig=rig)
        watch_replay(replay, speed=1.0 if speed is None else speed)
        return
    options.refuse("needs a RECORDING to replay", trial=trial, speed=speed)
    from pamsim.comparison.effects_on_rig import movable_effects
    from pamsim.engine.rig import load_rig
    from pamsim.scene.viewer import watch_live

    loaded = load_rig(rig or "mas20_arm", scene=True)
    movable = movable_effects(loaded, effects)
    start = pressure or [
        min(_START, 0.5 * muscle.valve.supply_pressure) for muscle in loaded.muscles.values()
    ]
    watch_live(loaded, start, load=load or 0.0, effects=movable.sizes, with_effects=movable.at)
