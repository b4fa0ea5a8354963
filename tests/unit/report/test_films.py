"""Frames of films: arms above, plots below, a cursor that goes with time."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from PIL import Image, ImageSequence

import pamsim
from pamsim.comparison.compared_signal import Comparison
from pamsim.recordings.trial import Trial
from pamsim.report import film as room
from pamsim.report.film import film_gap
from pamsim.report.film_sheet import arm_size, film_sheet
from tests.unit.core.refusals import refused

SIZE = 480, 384
TIME = np.linspace(0.0, 2.0, 101)
LABELS = {"muscle_1": (120.0, 60.0), "muscle_2": (110.0, 80.0)}
RAMPS = {"angle": TIME / 4.0, "pressure_1": 1e5 * TIME, "pressure_2": 3e5 - 1e5 * TIME}


def sheet(measured):
    trial = Trial(
        name="ramp", protocol="ramp", drive="pressure_set", load=1.2, time=TIME,
        command=np.full((TIME.size, 2), 2e5), measured=measured,
    )  # fmt: skip
    return film_sheet(trial, labels=LABELS, title="ramp", size=SIZE)


@pytest.fixture(scope="module")
def drawn():
    return sheet(RAMPS)


def test_cursor_runs_from_end_to_end_and_never_back(drawn):
    plot = drawn.plots[0]
    columns = [plot.column(share) for share in np.linspace(0.0, 1.0, 201)]
    assert np.all(np.diff(columns) >= 0)
    assert (columns[0], columns[-1]) == (round(plot.left), round(plot.right))
    assert columns[100] == pytest.approx((columns[0] + columns[-1]) / 2.0, abs=1.0)
    assert plot.column(4.5) == columns[-1]


def test_a_frame_is_the_arm_above_the_plots_with_the_cursor_where_it_is_said_to_be(drawn):
    width, height = arm_size(*SIZE)
    arm = np.full((height, width, 3), 200, dtype=np.uint8)
    frame = drawn.frame(arm, 1.0)
    assert frame.shape == (*SIZE[::-1], 3)
    assert (frame[height // 2 : height, width // 2 :] == 200).all()  # nothing is written there
    # The plot's upper edge is crossed by nothing but the cursor.
    plot = drawn.plots[0]
    inside = slice(round(plot.left) + 2, round(plot.right) - 2)
    edge = frame[plot.top, inside].max(axis=1)
    assert (np.flatnonzero(edge < 60) + inside.start).tolist() == [plot.column(0.5)]
    # Half-way along its ramp the angle's dot is half-way up the plot; rows count downwards.
    row = plot.curves[0].rows[plot.column(0.5)]
    assert row == pytest.approx((plot.top + plot.bottom) / 2.0, abs=2.0)
    assert plot.curves[0].rows[plot.column(0.1)] > row
    # Equal times give equal frames: the sheet is left as it was.
    assert (drawn.frame(arm, 1.5) != frame).any()
    np.testing.assert_array_equal(drawn.frame(arm, 1.0), frame)


def test_muscles_are_labelled_in_the_colours_of_their_curves(drawn):
    lines = [curve.colour for curve in drawn.plots[1].curves]
    for line, (_, row) in zip(lines, LABELS.values(), strict=True):
        near = slice(max(0, round(row) - 40), round(row) + 40)
        ink, cover = np.split(drawn.ink[near], [3], axis=2)
        written = (np.abs(ink - line).max(axis=2) < 3) & (cover[..., 0] == 255)
        assert written.sum() > 20


def test_a_pressure_that_was_not_measured_has_no_curve_and_a_small_frame_is_refused():
    measured = {name: values for name, values in RAMPS.items() if name != "pressure_1"}
    (curve,) = sheet(measured).plots[1].curves
    assert curve.rows[-1] > curve.rows[0]  # the second's, which falls
    with refused("100 x 384 pixels are too small"):
        arm_size(100, 384)


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm", scene=True)


@pytest.fixture(scope="module")
def part():
    """An arm that stays, simulated as turning by 0.4 rad."""
    time = TIME[:26] / TIME[25] / 2.0
    still = np.zeros_like(time)
    return Comparison(
        trial="one", protocol="one", channel="angle", held_out=True, time=time,
        measured=still, before=0.8 * time, after=still,
    )  # fmt: skip


def frames(path):
    with Image.open(path) as film:
        every = [
            np.asarray(one.convert("RGB"), dtype=float) for one in ImageSequence.Iterator(film)
        ]
    return np.array(every)


def test_every_state_has_its_arm_and_only_that_which_moves_changes(rig, part, tmp_path):
    film_gap(tmp_path / "gap.gif", rig, [part])
    film = frames(tmp_path / "gap.gif")
    assert len(film) == 6  # half a second
    measured, before, after = np.split(film[:, 30:190], 3, axis=2)
    changed = [np.abs(arm[-1] - arm[0]).mean() for arm in (measured, before, after)]
    assert changed[1] > 3.0 * max(changed[0], changed[2])
    assert np.abs(measured - after).mean() < 0.5 * np.abs(measured - before)[-1].mean()


def test_without_a_repair_there_are_two_arms_and_a_long_trial_runs_faster(
    rig, part, tmp_path, monkeypatch
):
    monkeypatch.setattr(room, "_LONGEST", 0.25)
    film_gap(tmp_path / "gap.gif", rig, [dataclasses.replace(part, after=None)])
    film = frames(tmp_path / "gap.gif")
    assert film.shape[2] == 2 * 320
    assert len(film) == 3


def test_a_joint_that_was_not_compared_cannot_be_shown(rig, part, tmp_path):
    with refused("angle was not compared"):
        film_gap(tmp_path / "gap.gif", rig, [dataclasses.replace(part, channel="force_1")])
    assert not list(tmp_path.iterdir())
