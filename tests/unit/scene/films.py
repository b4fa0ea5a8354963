"""Recordings made by hand, to be looked at: a second in which the arm turns and then rests."""

import csv
import os

import numpy as np
import pytest

from pamsim.scene.series_colours import SERIES, rgb

TIME = np.arange(51) / 50.0
TURN = np.clip(TIME / 0.5, 0.0, 1.0)

# tests/conftest.py says "disable" only where libEGL is not installed; a broken one must fail.
needs_gl = pytest.mark.skipif(
    os.environ.get("MUJOCO_GL") == "disable", reason="no OpenGL here: install libegl1"
)


def columns(**changed):
    """Columns of a trial: the arm turns from -20 to 20 deg in half a second and stays."""
    first, second = 100.0 + 400.0 * TURN, 500.0 - 400.0 * TURN
    found = {
        "time_s": TIME,
        "p1_set_kpa": np.full(TIME.size, 500.0),
        "p2_set_kpa": np.full(TIME.size, 100.0),
        "p1_kpa": first,
        "p2_kpa": second,
        "angle_deg": 40.0 * TURN - 20.0,
        **changed,
    }
    return {name: values for name, values in found.items() if values is not None}


def nearest_series(change):
    """Which series of curves has the colour in which pixels (red, green, blue) have changed."""
    vented = np.array([0.12, 0.14, 0.18])
    hues = [np.array(rgb(name)) - vented for name in SERIES[:4]]
    return int(np.argmax([change @ hue / np.linalg.norm(hue) for hue in hues]))


def write(folder, **trials):
    """Write trials, name -> columns, as a recording; returns its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ['schema = "pamsim-recording/1"', 'rig = "mas20_arm"']
    for name, named in trials.items():
        lines += ["[[trial]]", f'file = "{name}.csv"', f'protocol = "{name}"']
        lines += ['drive = "pressure_set"', "load_kg = 1.2"]
        with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(named)
            writer.writerows(zip(*named.values(), strict=True))
    (folder / "recording.toml").write_text("\n".join(lines), encoding="utf-8")
    return folder
