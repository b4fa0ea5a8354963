"""A run starts at rest at the start pressures, whatever keeps the valves shut near a set point."""

from __future__ import annotations

import numpy as np
import pytest

import pamsim

START = (320e3, 90e3)


@pytest.mark.parametrize(
    "values",
    [
        {"valve.dead_zone": 0.3},
        {"valve.regulator_dead_band": 4e3},
        {"valve.hysteresis": 0.2},
        {"creep.stiffness_2": 5e3, "creep.relaxation_time_2": 200.0},
    ],
)
@pytest.mark.parametrize("command", ["pressure_set", "valve"])
def test_a_trial_starts_at_the_pressures_it_was_measured_to_start_at(values, command):
    """Valves that stay shut near the set point would leave the air that was filled in straight."""
    rig = pamsim.load_rig("mas20_arm")
    experiment = pamsim.Experiment(
        drive=command,
        command_time=np.zeros(1),
        command_value=np.array([START if command == "pressure_set" else (0.0, 0.0)]),
        start_pressure=np.array(START),
        duration=0.1,
        sample_rate=100.0,
    )
    plain = pamsim.simulate(rig, experiment).completed()
    shut = pamsim.simulate(rig.with_parameters(values), experiment).completed()
    np.testing.assert_allclose(shut.pressure[0], START, atol=1.0)
    np.testing.assert_allclose(shut.pressure[-1], START, atol=50.0)
    assert shut.angle[0] == pytest.approx(plain.angle[0], abs=1e-6)


def test_a_trial_may_start_below_the_regulators_least_set_point_to_which_they_then_fill():
    rig = pamsim.load_rig("mas20_arm").with_parameters({"valve.least_set_point": 200e3})
    run = pamsim.simulate(rig, pamsim.pressure_step(START, START, duration=2.0)).completed()
    np.testing.assert_allclose(run.pressure[0], START, atol=1.0)
    np.testing.assert_allclose(run.pressure[-1], (START[0], 200e3), rtol=1e-3)
