"""Muscles that have the pressures that were measured: what decides, and what no longer does."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError

STEP = pamsim.pressure_step((3e5, 3e5), (4.2e5, 1.5e5), duration=1.0, sample_rate=500.0)


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


def driven_by(recording, every=1):
    """An experiment with the pressures of a recording, of which every k-th sample is known."""
    return pamsim.Experiment(
        drive="measured",
        command_time=recording.time[::every],
        command_value=recording.pressure[::every],
        start_pressure=recording.pressure[0],
        duration=float(recording.time[-1]),
        sample_rate=500.0,
    )


def off(rig, recording, every):
    again = pamsim.simulate(rig, driven_by(recording, every)).completed()
    return float(np.abs(again.angle - recording.angle).max())


def test_the_arm_moves_as_it_did_and_the_error_falls_with_the_square_of_the_sampling(rig):
    recording = pamsim.simulate(rig, STEP).completed()
    errors = [off(rig, recording, every) for every in (1, 5, 10, 20)]
    assert errors[0] < 1e-5  # rad, of 0.2
    np.testing.assert_allclose(np.diff(np.log2(errors[1:])), 2.0, atol=0.1)


def test_the_pressures_are_those_measured_to_the_last_digits(rig):
    recording = pamsim.simulate(rig, STEP).completed()
    again = pamsim.simulate(rig, driven_by(recording)).completed()
    np.testing.assert_allclose(again.pressure, recording.pressure, rtol=0, atol=1e-6)


def test_valves_air_and_supply_have_no_say(rig):
    recording = pamsim.simulate(rig, STEP).completed()
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
    # The way to the start is regulated in every experiment, and ends a rounding apart.
    assert np.array_equal(mine.pressure, theirs.pressure)
    np.testing.assert_allclose(mine.angle, theirs.angle, rtol=0, atol=2e-6)
    np.testing.assert_allclose(mine.tension, theirs.tension, rtol=0, atol=1e-2)


def test_unequal_start_pressures_leave_the_hysteresis_where_set_points_do(rig):
    step = pamsim.pressure_step((4e5, 1.5e5), (2e5, 3e5), duration=0.2, sample_rate=500.0)
    recording = pamsim.simulate(rig, step).completed()
    assert off(rig, recording, 1) < 1e-5


def test_memory_and_friction_stay(rig):
    """What acts between pressure and angle is kept, and both forms of the kernel agree on it."""
    changed = rig.with_parameters({"creep.stiffness": 800.0, "friction.coulomb_force": 9.0})
    short = dataclasses.replace(STEP, duration=0.1, settle=0.1)
    recording = pamsim.simulate(changed, short).completed()
    experiment = dataclasses.replace(driven_by(recording), settle=0.1)
    compiled, python = (
        pamsim.simulate(changed, experiment, backend=b) for b in ("compiled", "python")
    )
    np.testing.assert_allclose(compiled.angle, recording.angle, rtol=0, atol=5e-6)
    for name in ("angle", "pressure", "tension"):
        np.testing.assert_allclose(getattr(compiled, name), getattr(python, name), rtol=1e-10)


def test_absolute_pressures_minus_a_vacuum_are_refused():
    with pytest.raises(InputError, match="gauge pressures"):
        pamsim.Experiment(
            drive="measured",
            command_time=np.array([0.0, 1.0]),
            command_value=np.array([[2e5], [-9e4]]),
            start_pressure=np.array([2e5]),
            duration=1.0,
        )
