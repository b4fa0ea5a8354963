"""``pamsim render`` and ``pamsim view`` as typed: films and instants of a recording."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from PIL import Image

from tests.typed_command import run
from tests.unit.scene.films import columns, needs_gl, write

SMALL = ["--width", "400", "--height", "320"]


@pytest.fixture
def recording(tmp_path):
    return write(tmp_path / "data", turn=columns(), back=columns())


@needs_gl
def test_a_film_and_a_picture_show_the_same_instants(tmp_path, recording, monkeypatch, capsys):
    film, instant = tmp_path / "film.gif", tmp_path / "instant.png"
    shown = ["--recording", recording, *SMALL]
    args = ["render", film, *shown, "--trial", "back", "--fps", "10", "--speed", "2"]
    code, out, err = run(monkeypatch, capsys, *args)
    assert (code, err) == (0, "")
    assert out.splitlines() == ["trial back; others by --trial: turn", f"wrote {film}"]
    code, _, _ = run(monkeypatch, capsys, "render", instant, *shown, "--time", "200ms")
    assert code == 0
    with Image.open(film) as pages, Image.open(instant) as picture:
        assert (pages.size, picture.size, pages.n_frames) == ((400, 320), (400, 320), 5)
        assert pages.info["duration"] == 100
        pages.seek(1)
        # The title differs, and the GIF has its palette; the arm and the plots are the same.
        arm = slice(40, 320)
        seen = np.asarray(pages.convert("RGB")).astype(int)[arm]
        wanted = np.asarray(picture).astype(int)[arm]
        assert np.abs(seen - wanted).mean() < 4.0
        pages.seek(3)
        assert np.abs(np.asarray(pages.convert("RGB")).astype(int)[arm] - wanted).mean() > 4.0


@pytest.mark.parametrize(
    ("args", "expected"),
    [
        (["film.gif"], "a film needs a recording to show: --recording FOLDER"),
        (["x.png", "--time", "1"], "--time needs --recording"),
        (["x.png", "--recording", "DATA"], "give --time, or write a film"),
        (["x.png", "--recording", "DATA", "--time", "3"], "which lasts 1 s"),
        (["x.png", "--recording", "DATA", "--time", "0", "--fps", "9"], "--fps is of a film"),
        (["f.gif", "--recording", "DATA", "--time", "0"], "--time is of a picture"),
        (["f.gif", "--recording", "DATA", "--load", "1"], "--load is known from the recording"),
        (["f.gif", "--recording", "DATA", "--fps", "60"], "at most 50 frames per second"),
        (["f.gif", "--recording", "DATA", "--speed", "0"], "--speed 0 must be above 0"),
        (["f.gif", "--recording", "DATA", "--trial", "turns"], "did you mean 'turn'"),
        (["f.gif", "--recording", "DATA", "--camera", "sky"], "no camera 'sky'"),
        (["f.gif", "--recording", "DATA", "--height", "90"], "are too small"),
        (["f.mp4", "--recording", "DATA"], 'pip install "pamsim[video]"'),
        (["f.gif", "--recording", "nowhere"], "no recording at nowhere"),
    ],
)
def test_what_cannot_be_rendered_is_one_line_and_exit_2(
    recording, monkeypatch, capsys, args, expected
):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    given = [recording if arg == "DATA" else arg for arg in args]
    code, out, err = run(monkeypatch, capsys, "render", *given)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert expected in err


@pytest.mark.skipif(sys.platform != "linux", reason="only there a missing screen is a variable")
@pytest.mark.parametrize(
    ("args", "expected"),
    [
        ([], "write a film: `pamsim render`"),
        (["DATA"], "write a film: `pamsim render`"),
        (["DATA", "--load", "1"], "--load is known from the recording"),
        (["--speed", "2"], "--speed needs a RECORDING"),
        (["--pressure", "700,0"], "outside [0, 600] kPa"),
    ],
)
def test_what_cannot_be_viewed_is_one_line_and_exit_2(
    recording, monkeypatch, capsys, args, expected
):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    given = [recording if arg == "DATA" else arg for arg in args]
    code, out, err = run(monkeypatch, capsys, "view", *given)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert expected in err
