"""Tube, slow valves and heat in the engine: air is kept, the sensor sees its end, heat goes."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.physics.air import GAS_CONSTANT
from tests.unit.physics.flat import AMBIENT_AIR as AMBIENT
from tests.unit.physics.flat import (
    chamber_pressure,
    chamber_volume,
    flow_through_valves,
    pressure_at_valve,
)

TUBE = {"valve.tube_resistance": 3e8, "valve.tube_volume": 2e-5}


def filled(changes, seconds=0.4, hold=1.2):
    """Muscle 1 filled by its wide open valve, then shut; the arm held fast."""
    rig = pamsim.load_rig("mas20_arm").with_parameters({"joint.shaft.damping": 1e3, **changes})
    experiment = pamsim.Experiment(
        drive="valve",
        command_time=np.array([0.0, seconds]),
        command_value=np.array([[1.0, 0.0], [0.0, 0.0]]),
        start_pressure=np.array([1e5, 1e5]),
        duration=seconds + hold,
        settle=0.5,
    )
    return rig, pamsim.simulate(rig, experiment).completed()


def test_the_sensor_at_the_valves_leads_the_muscle_and_meets_it_once_they_are_shut():
    rig, run = filled(TUBE)
    _, plain = filled({})
    shut = int(0.4 * run.meta["sample_hz"])
    assert run.pressure[shut, 0] > plain.pressure[shut, 0] + 2e4
    model = rig.model_for(command="valve")
    data = mujoco.MjData(model)
    pamsim.restore_state(model, data, run.final_state)
    mujoco.mj_fwdPosition(model, data)
    inside = pamsim.pressures(model, data)[0]
    assert run.pressure[-1, 0] == pytest.approx(inside, rel=5e-4)
    assert inside > 1.5e5
    assert run.pressure[shut, 0] > run.pressure[-1, 0] + 2e4


@pytest.mark.parametrize("changes", [{}, {"chamber.heat_rate": 3.0}], ids=["tube", "tube, heat"])
def test_what_passes_the_valves_is_in_the_tube_or_in_the_muscle(changes):
    isothermal = {"chamber.polytropic_index": 1.0, **TUBE, **changes}
    rig = pamsim.load_rig("mas20_arm").with_parameters({"braid.extensibility": 0.0} | isothermal)
    model = rig.model_for(command="valve")
    data = mujoco.MjData(model)
    pamsim.reset(model, data, 1e5)
    row = model.actuator_user[0].tolist()
    count = model.actuator_actnum[0]
    warm = GAS_CONSTANT * rig.muscles["muscle_1"].chamber.temperature

    def held():
        mujoco.mj_fwdPosition(model, data)
        act, length = data.act[:count].tolist(), float(data.actuator_length[0])
        inside = chamber_pressure(row, act, length) * chamber_volume(row, act, length, 0.0)
        at_valves = pressure_at_valve(row, act, length) * TUBE["valve.tube_volume"]
        return (inside + at_valves) / warm

    before, passed, moved = held(), 0.0, 0.0
    with pamsim.live(model):
        for opening in np.repeat([1.0, 0.0, -1.0, 0.3], 500).tolist():
            data.ctrl[:] = opening, 0.0
            mujoco.mj_forward(model, data)
            act, length = data.act[:count].tolist(), float(data.actuator_length[0])
            at_valves = pressure_at_valve(row, act, length)
            flow = flow_through_valves(row, at_valves, opening, 0.0)
            passed += flow * model.opt.timestep
            moved += abs(flow) * model.opt.timestep
            mujoco.mj_step(model, data)
    assert moved > 0.5 * before
    assert held() - before == pytest.approx(passed, abs=1e-9 * moved)


def test_a_regulator_behind_a_tube_holds_the_pressure_that_it_was_told():
    rig = pamsim.load_rig("mas20_arm").with_parameters(TUBE)
    step = pamsim.pressure_step((2e5, 2e5), (3.5e5, 2e5), duration=3.0)
    run = pamsim.simulate(rig, dataclasses.replace(step, settle=0.5)).completed()
    assert run.pressure[-1] == pytest.approx([3.5e5, 2e5], abs=200.0)


def test_slow_valves_pass_what_their_opening_s_ramps_leave():
    travel = 0.1
    _, slow = filled({"valve.travel_time": travel})
    _, quick = filled({})
    late = slow.pressure[:, 0] < quick.pressure[:, 0]
    assert late[5 : int(0.35 * slow.meta["sample_hz"])].all()
    # Opening and closing ramps are equally long: what the first withholds, the second gives.
    assert slow.pressure[-1, 0] == pytest.approx(quick.pressure[-1, 0], rel=0.02)


def test_after_a_fast_fill_the_pressure_falls_to_that_of_the_air_at_ambient_temperature():
    rate = 4.0
    rig, run = filled({"chamber.heat_rate": rate, "chamber.polytropic_index": 1.4}, hold=2.5)
    shut = int(0.4 * run.meta["sample_hz"]) + 1
    pressure = run.pressure[shut:, 0]
    assert pressure[0] > pressure[-1] + 5e3
    time = run.time[shut:] - run.time[shut]
    expected = pressure[-1] + (pressure[0] - pressure[-1]) * np.exp(-rate * time)
    np.testing.assert_allclose(pressure, expected, rtol=2e-2)
    model = rig.model_for(command="valve")
    data = mujoco.MjData(model)
    pamsim.restore_state(model, data, run.final_state)
    mujoco.mj_fwdPosition(model, data)
    row, count = model.actuator_user[0].tolist(), model.actuator_actnum[0]
    act, length = data.act[:count].tolist(), float(data.actuator_length[0])
    ambient = act[-AMBIENT] / chamber_volume(row, act, length, 0.0)
    assert chamber_pressure(row, act, length) == pytest.approx(ambient, rel=1e-3)
    _, polytropic = filled({"chamber.polytropic_index": 1.4}, hold=0.5)
    assert np.ptp(polytropic.pressure[shut + 5 :, 0]) < 2e3
