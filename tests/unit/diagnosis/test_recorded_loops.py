"""Loop areas of closed-form signals, and cycles found where a drive goes back and forth."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.diagnosis.method.recorded_loops import cycles, loop_area, loop_areas
from pamsim.recordings.excitation import held_levels, triangle
from pamsim.recordings.trial import Trial

TIME = np.arange(800) / 100.0
TURN = np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)


def test_area_is_that_of_the_ellipse_and_positive_for_a_lag():
    for lag in (0.3, -0.3):
        area = loop_area(4.0 * np.sin(TURN), 0.5 * np.sin(TURN - lag))
        assert area == pytest.approx(np.pi * 4.0 * 0.5 * np.sin(lag), rel=1e-5)
    assert loop_area(np.sin(TURN), np.sin(TURN) ** 3) == pytest.approx(0.0, abs=1e-12)


def test_area_of_dry_friction_is_the_jump_times_twice_the_range():
    drive, jump = triangle(TIME, 8.0), 0.1
    response = drive - jump * np.sign(np.gradient(drive))
    assert loop_area(drive, response) == pytest.approx(2.0 * jump * 2.0, rel=0.02)


def test_cycles_are_whole_turns_of_the_drive():
    found = cycles(triangle(TIME, 4.0, 0.6))
    assert [(c.start, c.stop) for c in found] == [(0, 401), (400, 800)]
    shifted = cycles(np.cos(2.0 * np.pi * TIME / 2.5))  # begins and ends away from the middle
    assert [c.start for c in shifted] == pytest.approx([188, 438], abs=2)
    assert all(c.stop - c.start == pytest.approx(251, abs=2) for c in shifted)
    (falling,) = cycles(-np.sin(2.0 * np.pi * TIME[:600] / 4.0))  # first down: half a turn is lost
    assert (falling.start, falling.stop) == (201, 600)


def test_noise_about_the_middle_is_no_cycle():
    rippled = triangle(TIME, 8.0) + 0.03 * np.sin(40.0 * TIME)
    assert len(cycles(rippled)) == 1


def test_steps_and_rest_draw_no_loops():
    steps = held_levels(TIME, 1.6, 5, np.random.default_rng(0))
    assert cycles(steps) == []
    assert cycles(np.tanh(20.0 * np.sin(2.0 * np.pi * TIME / 2.0))) == []
    assert cycles(np.ones(50)) == []


def trial(name, lag, force=True):
    swing = np.sin(2.0 * np.pi * TIME / 4.0)
    measured = {
        "pressure_1": 2e5 + 1e5 * swing,
        "pressure_2": 2e5 - 1e5 * swing,
        "angle": 0.4 * np.sin(2.0 * np.pi * TIME / 4.0 - lag),
    }
    if force:
        measured |= {"force_1": 300.0 * (1.0 + swing), "force_2": 300.0 * (1.0 - swing)}
    return Trial(
        name=name, protocol="swing", drive="pressure_set", load=0.0, time=TIME,
        command=np.zeros((TIME.size, 2)), measured=measured,
    )  # fmt: skip


def test_measured_and_simulated_loops_stand_side_by_side():
    measured, stiff = trial("swing_1", 0.2), trial("swing_1", 0.1).measured
    found = loop_areas([measured], {"swing_1": stiff}, {"swing_1": measured.measured})
    assert [(one.drive, one.cycle) for one in found] == [
        ("pressure", 1), ("pressure", 2), ("force", 1), ("force", 2)
    ]  # fmt: skip
    for one in found:
        size = {"pressure": 2e5, "force": 600.0}[one.drive]
        assert one.measured == pytest.approx(np.pi * size * 0.4 * np.sin(0.2), rel=0.02)
        assert one.before == pytest.approx(np.pi * size * 0.4 * np.sin(0.1), rel=0.02)
        assert one.after == one.measured
        assert one.amplitude == pytest.approx(0.4, rel=1e-3)
        assert one.common_pressure == pytest.approx(2e5)
        assert one.period == pytest.approx(4.0, abs=0.02)


def test_without_forces_or_a_repair_the_rest_is_still_told():
    measured = trial("swing_1", 0.2, force=False)
    found = loop_areas([measured], {"swing_1": trial("", 0.1).measured}, {})
    assert {one.drive for one in found} == {"pressure"}
    assert all(one.after is None for one in found)
    assert loop_areas([measured], {}, {}) == ()
