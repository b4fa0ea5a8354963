"""Commands above the supply are refused, with the number that the simulation would have."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError, InvariantError
from pamsim.engine.batch import simulate_batch
from pamsim.engine.preflight import above_supply


def test_a_set_point_and_a_start_above_the_supply_are_refused(rig):
    below = pamsim.pressure_step((2e5, 2e5), (2e5, 3e5), duration=0.01)
    step = pamsim.pressure_step((2e5, 2e5), (2e5, 9e5), duration=0.01)
    with pytest.raises(
        InputError, match=r"muscle_2: a set point of 900 kPa .* supply of 600 kPa: lower it"
    ):
        pamsim.simulate(rig, step)
    with pytest.raises(
        InputError, match=r"muscle_2: a set point of 900 kPa .* supply of 600 kPa: lower it"
    ):
        simulate_batch([(rig, below), (rig, step)])
    start = pamsim.pressure_step((2e6, 2e5), (2e5, 2e5), duration=0.01)
    with pytest.raises(InputError, match=r"muscle_1: a start pressure of 2,000 kPa .* raise valve"):
        pamsim.simulate(rig, start)


def test_the_number_is_what_the_simulation_has(rig):
    step = pamsim.pressure_step((2e5, 2e5), (2e5, 5.5e5), duration=3.0, sample_rate=10.0)
    weak = rig.with_parameters({"valve.supply_pressure": 5e5})
    (text,) = above_supply(weak.muscles, [step])
    assert text.endswith("supply of 500 kPa, which the simulation has instead")
    (run,) = simulate_batch([(weak, step)], above_supply=True)
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


def test_plain_steps_above_the_supply_warn_while_steps_are_checked_unless_they_are_an_error(rig):
    model = rig.model_for(command=("pressure_set", "valve"))
    data = mujoco.MjData(model)
    message = r"'muscle_1'.* set point of 900 kPa is above its supply; .* 600 kPa at most"
    for backend in ("compiled", "python"):
        pamsim.reset(model, data, (2e5, 2e5))

        def step(first, second=0.0, *, backend=backend):
            data.ctrl[:] = first, second
            with pamsim.live(model, backend=backend):
                mujoco.mj_step(model, data, 2)

        step(6.05e5)
        with pytest.warns(RuntimeWarning, match=message):
            step(9e5)
        with pamsim.checks(False):
            step(9e5)
        step(6e5, 7e5)  # of a valve: open
    data.ctrl[0] = 9e5
    mujoco.mj_step(model, data)
    data.act[:] = np.nan
    with pytest.raises(InvariantError, match="not finite"), pamsim.checks():
        mujoco.mj_step(model, data)


def test_models_state_the_range_of_their_controls(rig):
    weak = rig.with_parameters({"muscle_2:valve.supply_pressure": 5e5})
    valves = weak.model_for(command=("valve", "measured"))
    assert valves.actuator_ctrlrange[0].tolist() == [-1.0, 1.0]
    assert valves.actuator_ctrllimited.tolist() == [True, False]
    assert weak.with_operator("maxwell_slip").model.actuator_ctrlrange[1, 1] == 5e5
    spec = mujoco.MjSpec.from_file(str(rig.file.mjcf))
    for name, muscle in weak.muscles.items():
        pamsim.attach(spec, tendon=rig.file.tendons[name], muscle=muscle, name=name)
    for model in (weak.model_for(), pamsim.compile_model(spec)):
        assert model.actuator_ctrllimited.all()
        assert model.actuator_ctrlrange.tolist() == [[0.0, 6e5], [0.0, 5e5]]
