"""Each check of a reproduction passes inside its limit and fails outside, whatever others do."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.core.units import DEG_PER_RAD
from pamsim.linear.first_second_order import second_order_step
from pamsim.papers.calibration_record import SAME_RMS_DEG, CalibrationRecord
from pamsim.papers.printed_steps import Row, rms_error_deg
from pamsim.papers.reproduce_checks import (
    MODEL_LIMIT,
    RESPONSE_LIMIT,
    RMS_LIMIT_DEG,
    checks,
)
from pamsim.papers.torque_law import best_torque_laws
from pamsim.recordings.printed import mas20_models, mas20_steps
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.step_metrics import step_metrics

PRINTED = mas20_models()
TIME = np.arange(3001) / 500.0
STEP = second_order_step(TIME, PRINTED["g2"]["T1_s"], PRINTED["g2"]["T2_s"])
SWING = 0.5 * np.exp(-1.5 * TIME) * np.sin(10.0 * TIME)
INCREMENT = 2.0 * np.pi / 2500.0
BUMP = np.exp(-(((TIME - 1.0) / 0.1) ** 2))


def recording(angle):
    both = np.zeros((TIME.size, 2))
    return Recording(
        time=TIME, joints={"shaft": "angle"}, positions=angle[:, None],
        velocities=np.zeros((TIME.size, 1)), pressure=both, tension=both,
        command=both, drive="pressure_set", load=0.0, muscles=("muscle_1", "muscle_2"),
        outcome=Outcome.COMPLETED, message="completed", final_state=np.zeros(1),
    )  # fmt: skip


def row(step, angle, *, completed=True):
    return Row(
        step=step,
        start=(0.0, 0.0),
        recording=recording(angle),
        metrics=step_metrics(TIME, angle) if completed else None,
        increment=INCREMENT,
    )


def course(step, error=0.0):
    """As the paper says: small steps with load swing, all others rise to the printed angle."""
    swings = step.size == "small" and step.load > 0.0
    shape = STEP / STEP[-1] + (SWING if swings else 0.0)
    return (step.angle + error) * shape


@pytest.fixture
def rows():
    """Rows with an error of 0.5 deg of either sign."""
    return tuple(
        row(step, course(step, 0.5 / DEG_PER_RAD * (-1) ** step.row)) for step in mas20_steps()
    )


def models(t=1.0, t1=1.0, t2=1.0):
    """Identified models whose time constants are so many times the printed ones."""

    def order(*constants):
        return SimpleNamespace(output_error=SimpleNamespace(time_constants=constants))

    g1, g2 = PRINTED["g1"], PRINTED["g2"]
    return SimpleNamespace(g1=order(t * g1["T_s"]), g2=order(t1 * g2["T1_s"], t2 * g2["T2_s"]))


def record(rows, unseen=0.9, small=0.9, moved=0.0):
    """Of one form without a parameter: its nested error is `unseen`, whatever it states."""
    rms = rms_error_deg(rows)
    used = {
        "name": "used",
        "accepted": True,
        "rms_deg": rms + moved,
        "leave_one_out_rms_deg": 0.1,
        "left_out_block_rms_deg": {"small steps": small},
        "residual_deg": [unseen] * 21,
        "leave_one_out_residual_deg": [unseen] * 21,
        "jacobian_deg": [[]] * 21,
    }
    return CalibrationRecord(static_models=(used,), command="python calibrate.py")


def failing(rows, identified=None, known=None):
    return {c.name for c in checks(rows, identified, known, 1.0) if not c.ok}


def changed(rows, number, angle):
    return tuple(row(r.step, angle) if r.step.row == number else r for r in rows)


def test_a_good_reproduction_passes_every_check(rows):
    found = checks(rows, models(), record(rows), 1.0)
    assert [c.name for c in found if not c.ok] == []
    assert {c.name for c in found} == {
        "completed", "rms", "signs", "monotonic", "oscillation", "time_constants", "response",
        "leave_one_out", "small_steps", "energy",
    }  # fmt: skip
    assert all(c.sentence and "\n" not in c.sentence for c in found)


def test_what_cannot_be_judged_is_left_out(rows):
    of_models, held_out = {"time_constants", "response"}, {"leave_one_out", "small_steps"}
    assert not of_models & {c.name for c in checks(rows, None, record(rows), 1.0)}
    assert not held_out & {c.name for c in checks(rows, models(), None, 1.0)}


@pytest.mark.parametrize("which", ["t", "t1", "t2"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_time_constants(rows, which, side):
    inside, outside = (1.0 + side * share * MODEL_LIMIT for share in (0.98, 1.02))
    assert failing(rows, models(**{which: inside})) == set()
    assert failing(rows, models(**{which: outside})) == {"time_constants"}


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_response_is_judged_everywhere_not_at_its_end(rows, side):
    large = rows[0].recording.angle
    for share, wanted in ((0.9, set()), (1.1, {"response"})):
        bent = large + side * share * RESPONSE_LIMIT * large[-1] * BUMP
        assert failing(changed(rows, 1, bent), models()) == wanted


def test_response_does_not_depend_on_size_or_start(rows):
    shifted = changed(rows, 1, 0.1 + 0.5 * rows[0].recording.angle)
    assert "response" not in failing(shifted, models())


def test_held_out_errors_are_judged_by_those_of_the_best_torque_laws(rows):
    best = best_torque_laws()
    for name, key, limit in (
        ("leave_one_out", "unseen", best.left_out_rms_deg),
        ("small_steps", "small", best.small_steps_rms_deg),
    ):
        assert failing(rows, known=record(rows, **{key: 0.999 * limit})) == set()
        assert failing(rows, known=record(rows, **{key: 1.001 * limit})) == {name}
    (check,) = (c for c in checks(rows, None, record(rows, 0.85), 1.0) if c.name == "leave_one_out")
    limit = f"limit {best.left_out_rms_deg:.2f} deg"
    for words in ("0.85 deg RMS", "0.10 deg for the form used", limit):
        assert words in check.sentence


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_stale_record_fails_and_says_what_to_run(rows, side):
    assert failing(rows, known=record(rows, moved=0.9 * side * SAME_RMS_DEG)) == set()
    (check,) = (
        c
        for c in checks(rows, None, record(rows, moved=1.1 * side * SAME_RMS_DEG), 1.0)
        if not c.ok
    )
    assert check.name == "leave_one_out"
    assert "run python calibrate.py again" in check.sentence


def test_repeats_count_once(rows):
    """The RMS is that of the distinct rows, so a repeat changes nothing."""
    far = tuple(row(r.step, course(r.step, 0.2)) if r.step.repeats is not None else r for r in rows)
    assert failing(far, known=record(rows)) == set()


@pytest.mark.parametrize(("share", "wanted"), [(0.99, set()), (1.01, {"rms"})])
def test_rms(share, wanted):
    error = share * RMS_LIMIT_DEG / DEG_PER_RAD
    found = tuple(row(step, course(step, error * (-1) ** step.row)) for step in mas20_steps())
    assert failing(found) == wanted


def test_a_run_that_broke_down_fails_by_its_row(rows):
    broken = tuple(
        replace(r, metrics=None) if r.step.row == 5 else r for r in rows
    )  # its error is no number, so the RMS is none either
    found = {c.name: c for c in checks(broken, None, None, 1.0)}
    assert not found["completed"].ok
    assert "rows 5" in found["completed"].sentence
    assert not found["rms"].ok


def test_the_wrong_way_and_the_wrong_course_are_named(rows):
    wrong = {
        c.name: c for c in checks(changed(rows, 20, -rows[19].recording.angle), None, None, 1.0)
    }
    assert not wrong["signs"].ok
    assert "rows 20" in wrong["signs"].sentence
    dip = INCREMENT * np.exp(-(((TIME - 5.0) / 0.1) ** 2))  # after it settled
    assert failing(changed(rows, 7, rows[6].recording.angle - 0.8 * dip)) == set()
    assert failing(changed(rows, 7, rows[6].recording.angle - 1.2 * dip)) == {"monotonic"}
    back = rows[6].recording.angle * (1.0 + SWING)
    found = {c.name: c for c in checks(changed(rows, 7, back), None, None, 1.0)}
    assert not found["monotonic"].ok
    assert "rows 7 " in found["monotonic"].sentence


def test_small_steps_with_load_must_swing(rows):
    still = tuple(row(r.step, r.step.angle * STEP / STEP[-1]) for r in rows)
    assert failing(still) == {"oscillation"}
    one = changed(still, 13, rows[12].recording.angle)
    assert failing(one) == set()
    unloaded = changed(still, 17, rows[16].step.angle * (STEP / STEP[-1] + SWING))
    assert failing(unloaded) == {"oscillation"}


@pytest.mark.parametrize(
    ("work", "ok"), [(1.019, True), (0.981, True), (1.33, False), (0.9, False)]
)
def test_a_muscle_must_give_the_work_of_its_air(rows, work, ok):
    (found,) = (c for c in checks(rows, None, None, work) if c.name == "energy")
    assert found.ok == ok
    assert f"{work:.3f} times the work of its air" in found.sentence
