"""`pamsim view` in a real window on a virtual screen: what a person sees beside the sliders."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np
import pytest
from PIL import Image, ImageGrab

from pamsim.scene.live_plots import COLUMN
from pamsim.scene.series_colours import series_rgb
from tests.unit.scene.films import columns, write

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("Xvfb") is None, reason="no virtual screen here: install xvfb"),
]
_LONGEST = 120.0
"""Wait for the window [s]: the first run on a machine compiles."""


@pytest.fixture
def screen(tmp_path) -> Iterator[str]:
    """A virtual screen; its name for DISPLAY."""
    read, write_end = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write_end), "-screen", "0", "1200x750x24"],
        pass_fds=[write_end],
        stderr=subprocess.DEVNULL,
    )
    os.close(write_end)
    with os.fdopen(read) as answer:
        number = answer.readline().strip()
    yield f":{number}"
    server.terminate()
    server.wait(10)


def window(display: str, *arguments: str, until) -> Image.Image:
    """The screen once `pamsim view` shows what `until` asks for."""
    environment = {**os.environ, "DISPLAY": display}
    environment.pop("MUJOCO_GL", None)
    shown = subprocess.Popen(
        [sys.executable, "-m", "pamsim", "view", *map(str, arguments)],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        end = time.monotonic() + _LONGEST
        while time.monotonic() < end:
            assert shown.poll() is None, shown.communicate()[1]
            picture = ImageGrab.grab(xdisplay=display).convert("RGB")
            if until(picture):
                return picture
            time.sleep(0.5)
        raise AssertionError(f"not shown after {_LONGEST:g} s")
    finally:
        shown.terminate()
        try:
            shown.communicate(timeout=30.0)
        except subprocess.TimeoutExpired:
            shown.kill()
            raise AssertionError("the window does not close when the command is ended") from None


def share(picture: Image.Image, colour: tuple[float, float, float]) -> np.ndarray:
    """Columns of the pixels that have a colour."""
    near = np.abs(np.asarray(picture, dtype=float) - 255.0 * np.array(colour)).max(axis=2) < 24.0
    return np.nonzero(near)[1]


def curves_are_drawn(picture: Image.Image) -> bool:
    """Whether both pressures have some length in the plots."""
    width = COLUMN * picture.width
    return all(np.count_nonzero(share(picture, series_rgb(i)) < width) > 60 for i in range(2))


def test_a_simulated_arm_and_a_replay_fill_the_window_beside_their_curves(screen, tmp_path):
    live = window(screen, "--pressure", "400,100", until=curves_are_drawn)
    replay = window(screen, write(tmp_path / "data", turn=columns()), until=curves_are_drawn)
    for picture in (live, replay):
        seen = np.asarray(picture.convert("L"), dtype=float)
        assert seen.std() > 20.0
        for index in range(2):  # the muscles' fittings, in the colour of the curves
            across = share(picture, series_rgb(index)) / picture.width
            assert (across > 0.2).any(), f"muscle {index + 1} is not in the window"
