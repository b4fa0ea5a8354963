"""Commands above the supply are refused, with the number that the simulation would have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.batch import simulate_batch
from pamsim.engine.supply_check import above_supply


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


def test_a_set_point_and_a_start_above_the_supply_are_refused(rig):
    step = pamsim.pressure_step((2e5, 2e5), (2e5, 9e5), duration=0.01)
    with pytest.raises(InputError, match=r"muscle_2: a set point of 900 kPa .* 600 kPa instead"):
        pamsim.simulate(rig, step)
    start = pamsim.pressure_step((2e6, 2e5), (2e5, 2e5), duration=0.01)
    with pytest.raises(InputError, match=r"muscle_1: a start pressure of 2000 kPa .* raise valve"):
        pamsim.simulate(rig, start)


def test_the_number_is_what_the_simulation_has(rig):
    step = pamsim.pressure_step((2e5, 2e5), (2e5, 5.5e5), duration=3.0, sample_rate=10.0)
    weak = rig.with_parameters({"valve.supply_pressure": 5e5})
    (text,) = above_supply(weak.muscles, [step])
    assert text.endswith("the simulation has the supply's 500 kPa instead")
    (run,) = simulate_batch([(weak, step)])
    assert run.pressure[-1, 1] == pytest.approx(5e5, rel=1e-3)


def test_the_supply_itself_noise_and_measured_pressures_are_not_above_it(rig):
    step = pamsim.pressure_step((6.02e5, 2e5), (6e5, 2e5), duration=0.01)
    assert above_supply(rig.muscles, [step]) == ()
    pressures = np.array([[8e5, 2e5]])
    measured = replace(step, drive="measured", command_value=pressures)
    assert above_supply(rig.muscles, [measured]) == ()
    drives = {"muscle_1": "valve", "muscle_2": "pressure_set"}
    each = replace(step, drive=drives, command_value=np.array([[1.0, 7e5]]))
    (text,) = above_supply(rig.muscles, [each, step])
    assert text.startswith("muscle_2: a set point of 700 kPa")
