"""Each check of a reproduction passes inside its limit and fails outside, whatever others do."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.core.units import DEG_PER_RAD
from pamsim.papers.calibration_record import CalibrationRecord
from pamsim.papers.printed_steps import rms_error_deg
from pamsim.papers.reproduce_checks import checks
from pamsim.papers.torque_law import best_torque_laws
from pamsim.recordings.printed import mas20_steps
from tests.unit.papers.made_up_rows import INCREMENT, PRINTED, STEP, SWING, TIME, course, row

SIDES = (-1.0, 1.0)


def bump(at):
    return np.exp(-(((TIME - at) / 0.1) ** 2))


def with_errors(deg):
    """Rows with an error of this size, of either sign."""
    return tuple(
        row(step, course(step, deg / DEG_PER_RAD * (-1) ** step.row)) for step in mas20_steps()
    )


@pytest.fixture(scope="module")
def rows():
    return with_errors(0.5)


def models(t=1.0, t1=1.0, t2=1.0):
    """Identified models whose time constants are so many times the printed ones."""

    def order(*constants):
        return SimpleNamespace(output_error=SimpleNamespace(time_constants=constants))

    g1, g2 = PRINTED["g1"], PRINTED["g2"]
    return SimpleNamespace(g1=order(t * g1["T_s"]), g2=order(t1 * g2["T1_s"], t2 * g2["T2_s"]))


def record(rows, unseen=0.9, small=0.9, moved=0.0):
    """Of one form without a parameter: its nested error is `unseen`, whatever it states."""
    used = {
        "name": "used",
        "accepted": True,
        "rms_deg": rms_error_deg(rows) + moved,
        "leave_one_out_rms_deg": 0.1,
        "left_out_block_rms_deg": {"small steps": small},
        "residual_deg": [unseen] * 21,
        "leave_one_out_residual_deg": [unseen] * 21,
        "jacobian_deg": [[]] * 21,
    }
    return CalibrationRecord(static_models=(used,), command="python calibrate.py")


def failing(rows, identified=None, known=None, work=1.0):
    """The checks that fail: name -> sentence."""
    return {c.name: c.sentence for c in checks(rows, identified, known, work) if not c.ok}


def changed(rows, number, angle):
    return tuple(row(r.step, angle) if r.step.row == number else r for r in rows)


def test_a_good_reproduction_passes_every_check_and_what_cannot_be_judged_is_left_out(rows):
    found = checks(rows, models(), record(rows), 1.0)
    assert [c.name for c in found if not c.ok] == []
    of_rows = {"completed", "rms", "signs", "monotonic", "oscillation", "energy"}
    of_models, held_out = {"time_constants", "response"}, {"leave_one_out", "small_steps"}
    assert {c.name for c in found} == of_rows | of_models | held_out
    assert all(c.sentence and "\n" not in c.sentence for c in found)
    assert {c.name for c in checks(rows, None, record(rows), 1.0)} == of_rows | held_out
    assert {c.name for c in checks(rows, models(), None, 1.0)} == of_rows | of_models


def test_time_constants(rows):
    for which in ("t", "t1", "t2"):
        for side in SIDES:
            inside, outside = (1.0 + side * share * 0.05 for share in (0.98, 1.02))
            assert set(failing(rows, models(**{which: inside}))) == set()
            assert set(failing(rows, models(**{which: outside}))) == {"time_constants"}


def test_response_is_judged_everywhere_whatever_its_size_and_start(rows):
    large = rows[0].recording.angle
    for side in SIDES:
        for share, wanted in ((0.9, set()), (1.1, {"response"})):
            bent = large + side * share * 0.02 * large[-1] * bump(1.0)
            assert set(failing(changed(rows, 1, bent), models())) == wanted
    assert "response" not in failing(changed(rows, 1, 0.1 + 0.5 * large), models())


def test_held_out_errors_are_judged_by_those_of_the_best_torque_laws(rows):
    limits = best_torque_laws().values()
    pairs = (("leave_one_out", "unseen"), ("small_steps", "small"))
    for (name, key), limit in zip(pairs, limits, strict=True):
        assert failing(rows, known=record(rows, **{key: 0.999 * limit})) == {}
        assert set(failing(rows, known=record(rows, **{key: 1.001 * limit}))) == {name}
    (check,) = (c for c in checks(rows, None, record(rows, 0.85), 1.0) if c.name == "leave_one_out")
    limit, _ = limits
    for words in ("0.85 deg RMS", "0.10 deg for the form used", f"limit {limit:.2f} deg"):
        assert words in check.sentence


def test_a_stale_record_fails_and_says_what_to_run(rows):
    for side in SIDES:
        assert failing(rows, known=record(rows, moved=side * 0.018)) == {}
        stale = failing(rows, known=record(rows, moved=side * 0.022))
        assert set(stale) == {"leave_one_out"}
        assert "run python calibrate.py again" in stale["leave_one_out"]


def test_the_rms_is_that_of_the_distinct_rows(rows):
    assert failing(with_errors(0.89)) == {}
    assert set(failing(with_errors(0.91))) == {"rms"}
    far = tuple(row(r.step, course(r.step, 0.2)) if r.step.repeats is not None else r for r in rows)
    assert failing(far, known=record(rows)) == {}


def test_rows_that_broke_down_or_went_another_way_are_named(rows):
    broken = tuple(replace(r, metrics=None) if r.step.row == 5 else r for r in rows)
    found = failing(broken)
    assert "rows 5" in found["completed"]
    assert "rms" in found  # its error is no number, so the RMS is none either
    assert "rows 20" in failing(changed(rows, 20, -rows[19].recording.angle))["signs"]
    seventh = rows[6].recording.angle
    for share, wanted in ((0.8, set()), (1.2, {"monotonic"})):
        dip = share * INCREMENT * bump(5.0)  # after it settled
        assert set(failing(changed(rows, 7, seventh - dip))) == wanted
    assert "rows 7 " in failing(changed(rows, 7, seventh * (1.0 + SWING)))["monotonic"]


def test_small_steps_with_load_must_swing(rows):
    still = tuple(row(r.step, r.step.angle * STEP / STEP[-1]) for r in rows)
    assert set(failing(still)) == {"oscillation"}
    assert failing(changed(still, 13, rows[12].recording.angle)) == {}
    unloaded = changed(still, 17, rows[16].step.angle * (STEP / STEP[-1] + SWING))
    assert set(failing(unloaded)) == {"oscillation"}


def test_a_muscle_must_give_the_work_of_its_air(rows):
    for work, ok in ((1.019, True), (0.981, True), (1.33, False), (0.9, False)):
        (found,) = (c for c in checks(rows, None, None, work) if c.name == "energy")
        assert found.ok == ok
        assert f"{work:.3f} times the work of its air" in found.sentence
