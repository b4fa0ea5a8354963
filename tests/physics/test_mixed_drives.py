"""Muscles that are driven differently in one run."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError

SIGNALS = ("angle", "velocity", "pressure", "tension", "final_state")
TIME = np.array([0.0, 0.05, 0.12])
OPENINGS = np.array([[0.6, 0.0], [-0.2, 0.0], [0.0, 0.0]])
SET_POINTS = np.array([[3e5, 2e5], [4.2e5, 1.5e5], [2.5e5, 3e5]])


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


def experiment(drive, value, **changes):
    return pamsim.Experiment(
        drive=drive,
        command_time=TIME,
        command_value=np.asarray(value),
        start_pressure=np.array([3e5, 2e5]),
        **{"duration": 0.2, "settle": 0.5, **changes},
    )


def same(one, other):
    for name in SIGNALS:
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


def both(first, second):
    return {"muscle_1": first, "muscle_2": second}


@pytest.mark.parametrize(
    ("drive", "mixed", "value"),
    [
        ("pressure_set", both("pressure_set", "pressure_set"), SET_POINTS),
        ("measured", both("measured", "measured"), SET_POINTS),
        ("valve", both("valve", "sealed"), OPENINGS),
        ("sealed", both("valve", "sealed"), 0.0 * OPENINGS),
    ],
    ids=["set points", "measured", "a sealed one", "all sealed"],
)
def test_drives_that_are_the_same_give_the_same_to_the_last_bit(rig, drive, mixed, value):
    if drive == "valve":
        value = np.where([[True, False]], value, 0.0)
    same(
        pamsim.simulate(rig, experiment(drive, value)),
        pamsim.simulate(rig, experiment(mixed, value)),
    )


def test_the_order_in_which_muscles_are_named_does_not_matter(rig):
    there = experiment(both("pressure_set", "measured"), SET_POINTS)
    back = dataclasses.replace(
        there,
        drive={"muscle_2": "measured", "muscle_1": "pressure_set"},
        command_value=SET_POINTS[:, ::-1],
        start_pressure=there.start_pressure[::-1],
    )
    runs = [pamsim.simulate(rig, one) for one in (there, back)]
    same(*runs)
    assert runs[1].drive == both("pressure_set", "measured")


@pytest.mark.parametrize("delay", [0.0, 0.0123])
def test_a_muscle_with_its_measured_pressure_leaves_the_other_one_its_regulator(rig, delay):
    """Commands of the other muscle still arrive late, at the same instants."""
    late = rig.with_parameters({"muscle_1:valve.delay": delay})
    first = pamsim.simulate(late, experiment("pressure_set", SET_POINTS)).completed()
    step = np.searchsorted(TIME, first.time * (1 + 1e-12), side="right") - 1
    second = pamsim.simulate(
        late,
        dataclasses.replace(
            experiment("pressure_set", SET_POINTS),
            drive=both("pressure_set", "measured"),
            command_time=first.time,
            command_value=np.column_stack([SET_POINTS[step, 0], first.pressure[:, 1]]),
        ),
    ).completed()
    np.testing.assert_allclose(second.pressure, first.pressure, rtol=0, atol=150.0)
    np.testing.assert_allclose(second.angle, first.angle, rtol=0, atol=2e-5)


def test_a_sealed_muscle_keeps_its_air(rig):
    """Its pressure follows from its length alone: as before wherever that is as before."""
    plain = rig.with_parameters({"hysteresis.force_per_pressure": 0.0})
    slow = experiment(
        both("pressure_set", "sealed"), np.where([[True, False]], SET_POINTS, 0.0), duration=1.0
    )
    run = pamsim.simulate(plain, slow).completed()
    there = np.argsort(run.angle)
    length_order = run.pressure[there, 1]
    assert np.ptp(length_order) > 5e3
    assert np.all(np.diff(length_order) >= -1e-6)


def test_backends_agree_on_a_mixed_drive(rig):
    short = experiment(
        both("measured", "valve"), np.column_stack([SET_POINTS[:, 0], OPENINGS[:, 0]])
    )
    short = dataclasses.replace(short, duration=0.05, settle=0.05)
    compiled, python = (pamsim.simulate(rig, short, backend=b) for b in ("compiled", "python"))
    for name in ("angle", "pressure", "tension"):
        np.testing.assert_allclose(getattr(compiled, name), getattr(python, name), rtol=1e-10)


@pytest.mark.parametrize(
    ("drive", "message"),
    [
        ({"muscle_1": "valve", "muscle_3": "valve"}, "no muscle 'muscle_3'; did you mean"),
        (
            {"muscle_1": "valve", "muscle_2": "valvve"},
            "no drive 'valvve' of 'muscle_2'; did you mean",
        ),
        ({"muscle_1": "valve"}, "there are 2 columns of values"),
    ],
)
def test_what_does_not_fit_the_rig_is_refused(rig, drive, message):
    with pytest.raises(InputError, match=message):
        pamsim.simulate(rig, experiment(drive, OPENINGS))


def test_a_sealed_muscle_takes_no_command():
    with pytest.raises(InputError, match="takes no command"):
        experiment("sealed", OPENINGS)
