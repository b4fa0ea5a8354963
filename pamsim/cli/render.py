"""``pamsim render``: pictures of a rig and films of recordings, without a screen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer, progress_bar

_REST_SIZE, _INSTANT_SIZE, _FILM_SIZE = (1600, 1000), (1600, 1280), (800, 640)


@click.command(name="render", cls=Command)
@click.argument("picture", type=options.PATH)
@options.shown_rig
@click.option(
    "--pressure",
    type=options.PRESSURES,
    help="To rest at, one per muscle [kPa]; 487,100, or half the supply, if left out.",
)
@options.load("Mass on it [kg]; 2.14 if left out and it takes one.")
@click.option(
    "--recording", type=options.PATH, help="Show this recording instead of a rig at rest."
)
@click.option("--trial", help="Trial of the recording; its first if left out.")
@click.option(
    "--time", type=options.SECONDS, help="Instant of the recording for a picture: 0.5 or 500ms."
)
@click.option("--fps", type=float, help="Frames per second of a film; 25 if left out.")
@click.option("--speed", type=float, help="Of a film: 1 is real time, 0.5 slow motion.")
@click.option("--camera", default="overview", help="Camera of the scene.")
@click.option("--width", type=click.IntRange(min=1), help="[pixel]")
@click.option("--height", type=click.IntRange(min=1), help="[pixel]")
@options.force
def command(
    picture: Path,
    rig: str | None,
    pressure: list[float] | None,
    load: float | None,
    recording: Path | None,
    trial: str | None,
    time: float | None,
    width: int | None,
    height: int | None,
    camera: str,
    **pace: float | None,
) -> None:
    """Write PICTURE, a png or jpg of a rig, or a gif or mp4 film of a recording.

    Without --recording the rig comes to rest at some pressures. With it the arm is shown as it was
    measured or simulated, with its angle and pressures plotted below.
    """
    from pamsim.core.errors import InputError
    from pamsim.core.files import refuse_existing
    from pamsim.recordings.pictures import FILM_SUFFIXES

    refuse_existing(picture, options.forced())
    film = picture.suffix.lower() in FILM_SUFFIXES
    default = _FILM_SIZE if film else _REST_SIZE if recording is None else _INSTANT_SIZE
    look: Any = {"camera": camera, "size": (width or default[0], height or default[1])}
    if recording is None:
        if film:
            raise InputError(
                f"{picture}: a film needs a recording to show: --recording FOLDER, such as one that"
                " pamsim step --out FOLDER writes"
            )
        options.refuse(
            "needs --recording: a rig at rest does not move", trial=trial, time=time, **pace
        )
        from pamsim.scene.picture import picture_rest

        picture_rest(picture, rig=rig or "mas20_arm", pressures=pressure, load=load, **look)
        answer(f"wrote {picture}")
        return
    options.refuse("is known from the recording", pressure=pressure, load=load)
    if film:
        options.refuse("is of a picture, not of a film: write a .png", time=time)
    else:
        options.refuse("is of a film: write a .gif or .mp4", **pace)
    from pamsim.report.film import film_trial, picture_instant
    from pamsim.scene.replay import read_replay

    replay = read_replay(recording, trial=trial, rig=rig)
    if film:
        look |= {name: value for name, value in pace.items() if value is not None}
        with progress_bar("frame") as progress:
            film_trial(picture, replay, progress=progress, **look)
    elif time is None:
        raise InputError(
            f"{picture}: a picture shows one instant of the recording; give --time, or write a"
            " film as .gif or .mp4"
        )
    else:
        picture_instant(picture, replay, time=time, **look)
    if replay.others:
        click.echo(f"trial {replay.trial.name}; others by --trial: {', '.join(replay.others)}")
    answer(f"wrote {picture}")
