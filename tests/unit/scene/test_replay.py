"""A recording replayed: which instants are shown, and that the picture is of that instant."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.scene.replay import arm_camera, frame_times, read_replay
from tests.unit.scene.films import TIME, columns, nearest_series, needs_gl, write

SIZE = {"width": 240, "height": 150}


@pytest.mark.parametrize(("fps", "speed"), [(25.0, 1.0), (30.0, 0.5), (12.5, 4.0), (1.0, 100.0)])
def test_a_film_lasts_as_long_as_fps_and_speed_say(fps, speed):
    times = frame_times(4.0, fps=fps, speed=speed)
    assert times[0] == 0.0
    assert times[-1] < 4.0
    assert len(times) / fps == pytest.approx(4.0 / speed, abs=1.0 / fps)
    np.testing.assert_allclose(np.diff(times), speed / fps)


def test_a_trial_is_found_by_name_and_read_between_its_samples(tmp_path):
    folder = write(tmp_path, one=columns(), two=columns(angle_deg=0.0 * TIME))
    replay = read_replay(folder)
    assert (replay.trial.name, replay.duration) == ("one", TIME[-1])
    assert math.degrees(replay.positions(0.255)[0]) == pytest.approx(0.4)
    assert replay.pressures(0.255) == pytest.approx([304e3, 296e3])
    chosen = read_replay(folder, trial="two")
    assert (chosen.trial.name, chosen.others) == ("two", ("one",))
    with pytest.raises(InputError, match="did you mean 'two'"):
        read_replay(folder, trial="tow")


def test_what_cannot_be_shown_is_refused_by_name(tmp_path):
    for pace in ({"fps": 0.0, "speed": 1.0}, {"fps": 25.0, "speed": math.nan}):
        with pytest.raises(InputError, match="must be above 0"):
            frame_times(4.0, **pace)
    with pytest.raises(InputError, match="no column 'angle_deg'"):
        read_replay(write(tmp_path / "blind", turn=columns(angle_deg=None)))
    single = columns(p2_set_kpa=None, p2_kpa=None)
    with pytest.raises(InputError, match="is of 1 muscles, rig 'mas20_arm' has 2"):
        read_replay(write(tmp_path / "single", turn=single))
    with (
        pytest.raises(InputError, match="no camera 'sky'"),
        arm_camera(read_replay(write(tmp_path, turn=columns())), camera="sky", **SIZE),
    ):
        pass


@needs_gl
def test_equal_states_give_equal_pixels_and_a_turned_arm_others(tmp_path):
    held = columns(p1_kpa=300.0 + 0.0 * TIME, p2_kpa=300.0 + 0.0 * TIME)
    with arm_camera(read_replay(write(tmp_path, turn=held)), **SIZE) as arm:
        start, middle, rest = (arm.draw(time).astype(int) for time in (0.0, 0.25, 0.6))
        assert start.shape == (150, 240, 3)
        np.testing.assert_array_equal(arm.draw(0.9), rest)
        np.testing.assert_array_equal(arm.draw(0.0), start)
    for one, other in ((start, middle), (middle, rest)):
        moved = np.abs(one - other).max(axis=2) > 40
        assert 0.005 < moved.mean() < 0.3


@needs_gl
def test_a_muscle_takes_the_colour_of_its_curve_as_its_pressure_rises(tmp_path):
    held = columns(angle_deg=0.0 * TIME, p2_kpa=None, p1_kpa=600.0 * TIME)
    with arm_camera(read_replay(write(tmp_path, turn=held)), camera="top", **SIZE) as arm:
        cold, warm = (arm.draw(time).astype(int) for time in (0.0, 1.0))
        labels = arm.labels
    changed = np.abs(warm - cold).sum(axis=2) > 60
    rows, found = np.nonzero(changed)
    assert len(rows) > 50
    assert (rows < SIZE["height"] / 2).all()  # from above, muscle 1 lies in the upper half
    assert nearest_series((warm - cold)[changed].mean(axis=0)) == 0
    # The label stands where the coloured part begins.
    column, row = labels["muscle_1"]
    assert found.min() == pytest.approx(column, abs=0.05 * SIZE["width"])
    assert rows.mean() == pytest.approx(row, abs=2.0)
    # Muscle 2, whose pressure nobody measured, lies below and is grey.
    column, row = (round(value) for value in labels["muscle_2"])
    grey = warm[row - 1 : row + 2, column + 25 : column + 60].reshape(-1, 3)
    assert np.ptp(grey.mean(axis=0)) < 12.0
