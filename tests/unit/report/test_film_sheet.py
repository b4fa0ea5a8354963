"""Frames of a film: arm above, plots below, a cursor that goes with time."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.recordings.trial import Trial
from pamsim.report.film_sheet import arm_size, film_sheet

SIZE = {"width": 480, "height": 384}
TIME = np.linspace(0.0, 2.0, 101)
LABELS = {"muscle_1": (120.0, 60.0), "muscle_2": (110.0, 80.0)}


def trial(**measured):
    ramp = {"angle": TIME / 4.0, "pressure_1": 1e5 * TIME, "pressure_2": 3e5 - 1e5 * TIME}
    return Trial(
        name="ramp",
        protocol="ramp",
        drive="pressure_set",
        load=1.2,
        time=TIME,
        command=np.full((TIME.size, 2), 2e5),
        measured={name: value for name, value in {**ramp, **measured}.items() if value is not None},
    )


def sheet(**measured):
    return film_sheet(trial(**measured), labels=LABELS, title="ramp", **SIZE)


def test_cursor_runs_from_end_to_end_and_never_back():
    drawn = sheet()
    columns = [drawn.plots[0].column(share) for share in np.linspace(0.0, 1.0, 201)]
    assert np.all(np.diff(columns) >= 0)
    assert columns[0] == round(drawn.plots[0].left)
    assert columns[-1] == round(drawn.plots[0].right)
    assert columns[100] == pytest.approx((columns[0] + columns[-1]) / 2.0, abs=1.0)
    assert drawn.plots[0].column(4.5) == columns[-1]


def test_a_frame_is_the_arm_above_the_plots_with_the_cursor_where_it_is_said_to_be():
    drawn = sheet()
    width, height = drawn.arm_size
    arm = np.full((height, width, 3), 200, dtype=np.uint8)
    frame = drawn.frame(arm, 1.0)
    assert frame.shape == (SIZE["height"], SIZE["width"], 3)
    assert (frame[height // 2 : height, width // 2 :] == 200).all()  # nothing is written there
    # The plot's upper edge is crossed by nothing but the cursor.
    plot = drawn.plots[0]
    edge = frame[height + plot.top, round(plot.left) + 2 : round(plot.right) - 2].max(axis=1)
    np.testing.assert_array_equal(
        np.flatnonzero(edge < 60) + round(plot.left) + 2, [plot.column(0.5)]
    )
    # Half-way along its ramp the angle's dot is half-way up the plot; rows count downwards.
    row = plot.curves[0].rows[plot.column(0.5)]
    assert row == pytest.approx((plot.top + plot.bottom) / 2.0, abs=2.0)
    assert plot.curves[0].rows[plot.column(0.1)] > row


def test_equal_times_give_equal_frames_and_the_sheet_is_left_as_it_was():
    drawn = sheet()
    arm = np.zeros((*drawn.arm_size[::-1], 3), dtype=np.uint8)
    first = drawn.frame(arm, 0.5)
    assert (drawn.frame(arm, 1.5) != first).any()
    np.testing.assert_array_equal(drawn.frame(arm, 0.5), first)


def test_muscles_are_labelled_in_the_colours_of_their_curves():
    drawn = sheet()
    lines = [curve.colour for curve in drawn.plots[1].curves]
    for line, (_, row) in zip(lines, LABELS.values(), strict=True):
        near = slice(max(0, round(row) - 40), round(row) + 40)
        written = (np.abs(drawn.ink[near] - line).max(axis=2) < 3) & (drawn.cover[near, :, 0] == 1)
        assert written.sum() > 20


def test_a_pressure_that_was_not_measured_has_no_curve_and_no_dot():
    (curve,) = sheet(pressure_1=None).plots[1].curves
    assert curve.rows[-1] > curve.rows[0]  # the second's, which falls


def test_a_frame_too_small_for_letters_is_refused():
    with pytest.raises(InputError, match="100 x 384 pixels are too small"):
        arm_size(100, 384)
