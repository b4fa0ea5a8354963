"""``pamsim render`` and ``pamsim view`` as typed: films and instants of a recording."""

import sys

import numpy as np
import pytest
from PIL import Image

from tests.unit.scene.films import columns, needs_gl, write


@pytest.fixture
def recording(tmp_path):
    return write(tmp_path / "data", turn=columns(), back=columns())


@needs_gl
def test_a_film_and_a_picture_show_the_same_instants(tmp_path, recording, run):
    film, instant = tmp_path / "film.gif", tmp_path / "instant.png"
    shown = ("--recording", recording, "--width", "400", "--height", "320")
    args = (film, *shown, "--trial", "back", "--fps", "10", "--speed", "2")
    code, out, err = run("render", *args)
    assert (code, err) == (0, "")
    assert out.splitlines() == ["trial back; others by --trial: turn", f"wrote {film}"]
    assert run("render", instant, *shown, "--time", "200ms")[0] == 0
    with Image.open(film) as pages, Image.open(instant) as picture:
        assert (pages.size, picture.size, pages.n_frames) == ((400, 320), (400, 320), 5)
        assert pages.info["duration"] == 100
        # The title differs, and the GIF has its palette; the arm and the plots are the same.
        arm, off = slice(40, 320), []
        wanted = np.asarray(picture).astype(int)[arm]
        for page in (1, 3):
            pages.seek(page)
            seen = np.asarray(pages.convert("RGB")).astype(int)[arm]
            off.append(np.abs(seen - wanted).mean())
        assert off[0] < 4.0 < off[1]


RENDERED = (
    ("film.gif", "a film needs a recording to show: --recording FOLDER"),
    ("x.png --time 1", "--time needs --recording"),
    ("x.png --recording DATA", "give --time, or write a film"),
    ("x.png --recording DATA --time 3", "which lasts 1 s"),
    ("x.png --recording DATA --time 0 --fps 9", "--fps is of a film"),
    ("f.gif --recording DATA --time 0", "--time is of a picture"),
    ("f.gif --recording DATA --load 1", "--load is known from the recording"),
    ("f.gif --recording DATA --fps 60", "at most 50 frames per second"),
    ("f.gif --recording DATA --speed 0", "--speed 0 must be above 0"),
    ("f.gif --recording DATA --trial turns", "did you mean 'turn'"),
    ("f.gif --recording DATA --camera sky", "no camera 'sky'"),
    ("f.gif --recording DATA --height 90", "are too small"),
    ("f.mp4 --recording DATA", 'pip install "pamsim[video]"'),
    ("f.gif --recording nowhere", "no recording at nowhere"),
)
VIEWED = (
    ("", "write a film: `pamsim render`"),
    ("DATA", "write a film: `pamsim render`"),
    ("DATA --load 1", "--load is known from the recording"),
    ("--speed 2", "--speed needs a RECORDING"),
    ("--pressure 700,0", "outside [0, 600] kPa"),
)


@pytest.mark.parametrize(("job", "table"), [("render", RENDERED), ("view", VIEWED)])
def test_what_cannot_be_shown_is_one_line_and_exit_2(recording, run, monkeypatch, job, table):
    if job == "view" and sys.platform != "linux":
        pytest.skip("only there a missing screen is a variable")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    for line, expected in table:
        given = [recording if word == "DATA" else word for word in line.split()]
        code, out, err = run(job, *given)
        assert (code, out, err.count("\n")) == (2, "", 1), err
        assert expected in err


def test_a_window_opens_at_200_kpa_or_half_the_supply(run, monkeypatch):
    starts = []
    monkeypatch.setattr(
        "pamsim.scene.viewer.watch_live", lambda _, start, **__: starts.append(start)
    )
    for rig in ("mas20_arm", "equimus_leg"):
        assert run("view", "--rig", rig)[0] == 0
    assert starts == [[200e3, 200e3], [100e3, 100e3]]  # the leg's supply has 200 kPa
