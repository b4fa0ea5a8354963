"""Films on disk: as many frames, as long, as told; whole or not there at all."""

import sys

import numpy as np
import pytest
from PIL import Image

from pamsim.recordings.pictures import check_film, write_film
from tests.unit.core.refusals import refused


def frames(count, width=64, height=48):
    """A light bar that moves over a dark ground."""
    found = []
    for k in range(count):
        frame = np.full((height, width, 3), (20, 40, 60), dtype=np.uint8)
        frame[:, 2 * k : 2 * k + 4] = (250, 200, 30)
        found.append(frame)
    return found


@pytest.mark.parametrize("fps", [25.0, 30.0, 7.0])
def test_gif_has_all_frames_for_their_time_and_loops(tmp_path, fps):
    path, shown = tmp_path / "new" / "film.gif", frames(21)
    write_film(path, iter(shown), fps=fps, palette_from=shown[:2])
    assert [each.name for each in path.parent.iterdir()] == ["film.gif"]
    with Image.open(path) as film:
        assert (film.size, film.n_frames, film.info["loop"]) == ((64, 48), 21, 0)
        durations = []
        for number, frame in enumerate(shown):
            film.seek(number)
            durations.append(film.info["duration"])
            seen = np.asarray(film.convert("RGB")).astype(int)
            assert np.abs(seen - frame).max() <= 4
    # Hundredths of a second are rounded, their sum is not.
    assert sum(durations) == pytest.approx(21e3 / fps, abs=5.0)
    assert max(durations) - min(durations) <= 10


@pytest.mark.parametrize("size", [(64, 48), (63, 47)])
def test_mp4_has_all_frames_for_their_time(tmp_path, size):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    path, shown = tmp_path / "film.mp4", frames(12, *size)
    write_film(path, shown, fps=20.0, palette_from=shown[:1])
    count, seconds = ffmpeg.count_frames_and_secs(str(path))
    assert (count, seconds) == (12, pytest.approx(0.6, abs=0.02))
    reader = ffmpeg.read_frames(str(path))
    assert next(reader)["size"] == (64, 48)  # an odd size gains a pixel
    first = np.frombuffer(next(reader), dtype=np.uint8).reshape(48, 64, 3).astype(int)
    reader.close()
    assert np.abs(first[10:40, 20:60] - (20, 40, 60)).max() < 12
    assert [each.name for each in tmp_path.iterdir()] == ["film.mp4"]


@pytest.mark.parametrize("name", ["film.gif", "film.mp4"])
def test_an_interrupt_leaves_what_was_there_before(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"an older film")

    def interrupted():
        yield from frames(3)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_film(path, interrupted(), fps=25.0, palette_from=frames(1))
    assert [each.name for each in tmp_path.iterdir()] == [name]
    assert path.read_bytes() == b"an older film"


def test_a_film_that_ffmpeg_could_not_write_is_one_line_and_not_there(tmp_path, monkeypatch):
    """Told at the end, or while it is handed frames."""
    ffmpeg, many = tmp_path / "ffmpeg", frames(8, 400, 300)
    ffmpeg.touch(0o755)
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(ffmpeg))
    for reads in ("cat >/dev/null", ":"):
        for says, words in (
            ("Error writing trailer: No space left on device", "film.mp4: No space left on device"),
            ("Unknown encoder", "film.mp4: ffmpeg failed: Unknown encoder"),
        ):
            ffmpeg.write_text(f"#!/bin/sh\n{reads}\necho '{says}' >&2\nexit 228\n")
            with refused(words):
                write_film(tmp_path / "film.mp4", many, fps=5.0, palette_from=many[:1])
            assert [each.name for each in tmp_path.iterdir()] == ["ffmpeg"]


def test_what_cannot_be_written_is_said_before_a_frame_is_drawn(tmp_path, monkeypatch):
    with refused("unknown film format; use .gif or .mp4"):
        check_film(tmp_path / "film.avi", 25.0)
    with refused("at most 50 frames"):
        check_film(tmp_path / "film.gif", 60.0)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with refused('pip install "pamsim[video]"'):
        check_film(tmp_path / "film.mp4", 60.0)
    (tmp_path / "file").write_text("")
    with refused("cannot write"):
        write_film(tmp_path / "file" / "film.gif", frames(2), fps=5.0, palette_from=frames(1))
