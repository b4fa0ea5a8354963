"""``pamsim render``: pictures of a rig and films of recordings, without a screen."""

from __future__ import annotations

from pathlib import Path

import click

from pamsim.cli.main import OK

_REST_SIZE, _INSTANT_SIZE, _FILM_SIZE = (1600, 1000), (1600, 1280), (800, 640)


@click.command(name="render")
@click.argument("picture", type=click.Path(path_type=Path))
@click.option(
    "--rig", help="Shipped rig or rig folder; mas20_arm, or the recording's, if left out."
)
@click.option("--pressure", help="Pressures to rest at, one per muscle; 487,100 if left out.")
@click.option("--load", help="Mass on the arm; 2.14 if left out.")
@click.option("--recording", type=click.Path(path_type=Path), help="Show this instead of rest.")
@click.option("--trial", help="Trial of the recording; its first if left out.")
@click.option("--time", "instant", help="Instant of the recording for a picture: 0.5 or 500ms.")
@click.option("--fps", type=float, help="Frames per second of a film; 25 if left out.")
@click.option("--speed", type=float, help="Of a film: 1 is real time, 0.5 slow motion.")
@click.option("--camera", default="overview", show_default=True, help="Camera of the scene.")
@click.option("--width", type=click.IntRange(min=1), help="[pixel]")
@click.option("--height", type=click.IntRange(min=1), help="[pixel]")
def command(
    picture: Path,
    rig: str | None,
    pressure: str | None,
    load: str | None,
    recording: Path | None,
    trial: str | None,
    instant: str | None,
    fps: float | None,
    speed: float | None,
    camera: str,
    width: int | None,
    height: int | None,
) -> int:
    """Write PICTURE, a png or jpg of a rig, or a gif or mp4 film of a recording.

    Without --recording the rig comes to rest at some pressures. With it the arm is shown as it was
    measured or simulated, angle and pressures plotted below.
    """
    from pamsim.core.errors import InputError
    from pamsim.core.units import parse_quantity
    from pamsim.store.film_file import FILM_SUFFIXES

    film = picture.suffix.lower() in FILM_SUFFIXES
    given = {"--trial": trial, "--time": instant, "--fps": fps, "--speed": speed}
    if recording is None:
        if film:
            raise InputError(
                f"{picture}: a film needs a recording to show: --recording FOLDER, such as one that"
                " pamsim step --out FOLDER writes"
            )
        _refuse(given, "needs --recording: a rig at rest does not move")
        from pamsim.scene.portrait import portrait

        wanted = [
            parse_quantity(p, "kPa", "Pa", where="--pressure")
            for p in (pressure or "487,100").split(",")
        ]
        portrait(
            picture,
            rig=rig or "mas20_arm",
            pressures=wanted,
            load=parse_quantity(load or "2.14", "kg", "kg", where="--load"),
            camera=camera,
            size=_size(width, height, _REST_SIZE),
        )
        click.echo(f"wrote {picture}")
        return OK
    _refuse({"--pressure": pressure, "--load": load}, "is known from the recording")
    from pamsim.cli.film import Shot, make_film, make_instant

    size = _size(width, height, _FILM_SIZE if film else _INSTANT_SIZE)
    shot = Shot(recording=recording, trial=trial, rig=rig, camera=camera, size=size)
    if film:
        _refuse({"--time": instant}, "is of a picture, not of a film: write a .png")
        make_film(
            picture,
            shot,
            fps=25.0 if fps is None else fps,
            speed=1.0 if speed is None else speed,
        )
    else:
        _refuse({"--fps": fps, "--speed": speed}, "is of a film: write a .gif or .mp4")
        if instant is None:
            raise InputError(
                f"{picture}: which instant of the recording? give --time, or write a film as .gif"
                " or .mp4"
            )
        make_instant(picture, shot, time=parse_quantity(instant, "s", "s", where="--time"))
    click.echo(f"wrote {picture}")
    return OK


def _refuse(options: dict[str, object], why: str) -> None:
    from pamsim.core.errors import InputError

    for name, value in options.items():
        if value is not None:
            raise InputError(f"{name} {why}")


def _size(width: int | None, height: int | None, default: tuple[int, int]) -> tuple[int, int]:
    return width or default[0], height or default[1]
