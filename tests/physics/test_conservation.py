"""Air is neither made nor lost, and a sealed chamber forgets nothing, inside the engine."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.record import slot
from tests.unit.physics.flat import air_flow, chamber_pressure, chamber_volume, gauge_pressure


def inside(row, act, length):
    """Volume of the air at its own pressure [m^3]."""
    return chamber_volume(row, act, length, gauge_pressure(row, act, length))


def prepare(index, pressures, timestep=None):
    rig = pamsim.load_rig("mas20_arm").with_parameters({"chamber.polytropic_index": index})
    model = rig.model_for(command="valve", timestep=timestep, load=1.2)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, pressures)
    return rig, model, data


def states(model, data):
    return data.act[: model.actuator_actnum[0]]


def test_air_mass_is_the_integral_of_valve_flow_over_a_fill_vent_cycle():
    _, model, data = prepare(1.0, (1e5, 3e5))
    row = model.actuator_user[0].tolist()
    temperature = row[slot("chamber.temperature")]
    cycle = np.repeat([1.0, 0.0, -1.0, 0.4], 1500)
    flowed, moved = 0.0, 0.0
    with pamsim.live(model):
        before = states(model, data)[-1] / (GAS_CONSTANT * temperature)
        for u in cycle:
            data.ctrl[:] = (u, -0.3 * u)
            mujoco.mj_forward(model, data)
            pressure = chamber_pressure(row, states(model, data), float(data.actuator_length[0]))
            flow = air_flow(row, pressure, float(u), data.time)
            flowed += flow * model.opt.timestep
            moved += abs(flow) * model.opt.timestep
            mujoco.mj_step(model, data)
    # mass from P V / (R T) at the end, by the ideal gas law and not by the state's own name
    mujoco.mj_fwdPosition(model, data)
    length = float(data.actuator_length[0])
    pressure = chamber_pressure(row, states(model, data), length)
    volume = inside(row, states(model, data), length)
    after = pressure * volume / (GAS_CONSTANT * temperature)
    assert moved > 2.0 * before, "the cycle must move more air than the muscle holds"
    assert abs(after - before - flowed) < 1e-9 * moved


@pytest.mark.parametrize("timestep", [2e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("index", [1.0, 1.2, 1.4])
def test_sealed_chamber_keeps_p_v_to_the_n_under_motion_at_any_step(index, timestep):
    _, model, data = prepare(index, (2e5, 2e5), timestep)
    row = model.actuator_user[0].tolist()
    seen, volumes = [], []
    with pamsim.live(model):
        for k in range(round(1.0 / timestep)):
            data.qfrc_applied[:] = 4.0 * np.sin(8.0 * k * timestep)
            mujoco.mj_step(model, data)
            mujoco.mj_fwdPosition(model, data)
            length = float(data.actuator_length[0])
            volume = inside(row, states(model, data), length)
            volumes.append(volume)
            seen.append(chamber_pressure(row, states(model, data), length) * volume**index)
    assert np.ptp(volumes) > 0.01 * np.mean(volumes), "the arm must move the muscle"
    np.testing.assert_allclose(seen, seen[0], rtol=1e-9)


def test_gauge_pressure_never_leaves_exhaust_and_supply():
    rig, model, data = prepare(1.2, (0.0, 0.0))
    supply = rig.muscles["muscle_1"].valve.supply_pressure
    commands = np.random.default_rng(5).uniform(-1, 1, (300, 2))
    with pamsim.live(model):
        for command in np.sign(commands):
            data.ctrl[:] = command
            mujoco.mj_step(model, data, 40)
            mujoco.mj_fwdPosition(model, data)
            pressures = pamsim.pressures(model, data)
            # Compression by the other muscle may lift a sealed chamber a little above its valve.
            assert np.all(pressures > -5e3)
            assert np.all(pressures < supply + 5e3)


def test_muscles_that_leak_into_each_other_end_at_one_pressure_and_keep_their_air():
    rig, *_ = prepare(1.0, (3e5, 1e5))
    leaking = rig.with_parameters({"muscle_2:chamber.cross_leak_conductance": 2e-9})
    model = leaking.model_for(command="valve", load=1.2)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, (3e5, 1e5))
    ends = [model.actuator_actadr[i] + model.actuator_actnum[i] - 1 for i in range(2)]
    before = data.act[ends].copy()
    with pamsim.live(model):
        mujoco.mj_step(model, data, 8000)
    first, second = pamsim.pressures(model, data)
    assert first == pytest.approx(second, rel=1e-4)
    assert abs(data.act[ends[0]] - before[0]) > 0.1 * before.sum()
    assert data.act[ends].sum() == pytest.approx(before.sum(), rel=1e-12)
