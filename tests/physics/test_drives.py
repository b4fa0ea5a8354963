"""Muscles that have the pressures that were measured, and muscles that are driven differently."""

import dataclasses

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError

STEP = pamsim.pressure_step((3e5, 3e5), (4.2e5, 1.5e5), duration=1.0, sample_rate=500.0)
TIME = np.array([0.0, 0.05, 0.12])
OPENINGS = np.array([[0.6, 0.0], [-0.2, 0.0], [0.0, 0.0]])
SET_POINTS = np.array([[3e5, 2e5], [4.2e5, 1.5e5], [2.5e5, 3e5]])


@pytest.fixture(scope="module")
def recording(rig):
    return pamsim.simulate(rig, STEP).completed()


def driven_by(recording, every=1, **changes):
    """An experiment with the pressures of a recording, of which every k-th sample is known."""
    given = {"duration": float(recording.time[-1]), "sample_rate": 500.0}
    return pamsim.Experiment(
        drive="measured",
        command_time=recording.time[::every],
        command_value=recording.pressure[::every],
        start_pressure=recording.pressure[0],
        **given | changes,
    )


def off(rig, recording, every):
    again = pamsim.simulate(rig, driven_by(recording, every)).completed()
    return float(np.abs(again.angle - recording.angle).max())


def test_the_arm_moves_as_it_did_and_the_error_falls_with_the_square_of_the_sampling(
    rig, recording
):
    errors = [off(rig, recording, every) for every in (1, 5, 10, 20)]
    assert errors[0] < 1e-5  # rad, of 0.2
    np.testing.assert_allclose(np.diff(np.log2(errors[1:])), 2.0, atol=0.1)
    # Unequal start pressures leave the hysteresis where set points do.
    step = pamsim.pressure_step((4e5, 1.5e5), (2e5, 3e5), duration=0.2, sample_rate=500.0)
    assert off(rig, pamsim.simulate(rig, step).completed(), 1) < 1e-5


def test_pressures_are_those_measured_and_valves_air_and_supply_have_no_say(rig, recording):
    other = rig.with_parameters(
        {
            "valve.conductance_fill": 2e-10,
            "valve.delay": 0.02,
            "valve.tube_resistance": 5e7,
            "valve.supply_resistance": 1e8,
            "valve.dead_zone": 0.2,
            "chamber.leak_conductance": 1e-11,
            "chamber.heat_rate": 2.0,
            "chamber.dead_volume": 5e-5,
        }
    )
    mine, theirs = (pamsim.simulate(r, driven_by(recording)).completed() for r in (rig, other))
    np.testing.assert_allclose(mine.pressure, recording.pressure, rtol=0, atol=1e-6)
    # The way to the start is regulated in every experiment, and ends a rounding apart.
    assert np.array_equal(mine.pressure, theirs.pressure)
    np.testing.assert_allclose(mine.angle, theirs.angle, rtol=0, atol=2e-6)
    np.testing.assert_allclose(mine.tension, theirs.tension, rtol=0, atol=1e-2)


# --- mixed drives --------------------------------------------------------------------------------


def experiment(drive, value, **changes):
    return pamsim.Experiment(
        drive=drive,
        command_time=TIME,
        command_value=np.asarray(value),
        start_pressure=np.array([3e5, 2e5]),
        **{"duration": 0.2, "settle": 0.5, **changes},
    )


def same(one, other):
    for name in ("angle", "velocity", "pressure", "tension", "final_state"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


def both(first, second):
    return {"muscle_1": first, "muscle_2": second}


def test_drives_that_are_the_same_give_the_same_to_the_last_bit_in_either_order(rig):
    for drive, mixed, value in (
        ("pressure_set", both("pressure_set", "pressure_set"), SET_POINTS),
        ("measured", both("measured", "measured"), SET_POINTS),
        ("valve", both("valve", "sealed"), OPENINGS),
        ("sealed", both("valve", "sealed"), 0.0 * OPENINGS),
    ):
        runs = (pamsim.simulate(rig, experiment(one, value)) for one in (drive, mixed))
        same(*runs)
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
    set_points = experiment("pressure_set", SET_POINTS)
    first = pamsim.simulate(late, set_points).completed()
    step = np.searchsorted(TIME, first.time * (1 + 1e-12), side="right") - 1
    mixed = dataclasses.replace(
        set_points,
        drive=both("pressure_set", "measured"),
        command_time=first.time,
        command_value=np.column_stack([SET_POINTS[step, 0], first.pressure[:, 1]]),
    )
    second = pamsim.simulate(late, mixed).completed()
    np.testing.assert_allclose(second.pressure, first.pressure, rtol=0, atol=150.0)
    np.testing.assert_allclose(second.angle, first.angle, rtol=0, atol=2e-5)


def test_what_does_not_fit_the_rig_is_refused(rig):
    for drive, message in (
        ({"muscle_1": "valve", "muscle_3": "valve"}, "no muscle 'muscle_3'; did you mean"),
        (both("valve", "valvve"), "no drive 'valvve' of 'muscle_2'; did you mean"),
        ({"muscle_1": "valve"}, "there are 2 columns of values"),
        ("sealed", "takes no command"),
    ):
        with pytest.raises(InputError, match=message):
            pamsim.simulate(rig, experiment(drive, OPENINGS))
    with pytest.raises(InputError, match="gauge pressures"):  # absolute ones less a vacuum
        experiment("measured", [[2e5, 2e5], [-9e4, 2e5], [2e5, 2e5]])
