"""Air is neither made nor lost inside the engine, with tube, slow valves, heat and leaks too."""

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
    gauge_pressure,
    leak_flow,
    pressure_at_valve,
)

TUBE = {"valve.tube_resistance": 3e8, "valve.tube_volume": 2e-5}
HOSE = {"valve.tube_friction": 2e12, "valve.tube_volume": 2e-5}


def prepare(changes, pressures, timestep=None, command="valve"):
    rig = pamsim.load_rig("mas20_arm").with_parameters(changes)
    model = rig.model_for(command=command, timestep=timestep, load=1.2)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, pressures)
    return rig, model, data


def first_muscle(model, data):
    """Row, states, length, absolute pressure [Pa] and volume [m^3] at its own pressure."""
    mujoco.mj_fwdPosition(model, data)
    row, length = model.actuator_user[0].tolist(), float(data.actuator_length[0])
    act = data.act[: model.actuator_actnum[0]].tolist()
    volume = chamber_volume(row, act, length, gauge_pressure(row, act, length))
    return row, act, length, chamber_pressure(row, act, length), volume


@pytest.mark.parametrize(
    "changes",
    [{}, TUBE, HOSE, TUBE | HOSE | {"chamber.heat_rate": 3.0}],
    ids=["valves", "tube", "turbulent", "both, heat"],
)
def test_air_mass_is_the_integral_of_valve_flow_over_a_fill_vent_cycle(changes):
    """Mass from P V / (R T), by the ideal gas law and not by the state's own name."""
    isothermal = {"chamber.polytropic_index": 1.0, **changes}
    if changes:
        isothermal["braid.extensibility"] = 0.0
    rig, model, data = prepare(isothermal, (1e5, 3e5), timestep=2e-3)
    warm = GAS_CONSTANT * rig.muscles["muscle_1"].chamber.temperature

    def held():
        row, act, _, pressure, volume = first_muscle(model, data)
        in_tube = pressure_at_valve(row, act, pressure) * changes.get("valve.tube_volume", 0.0)
        return (pressure * volume + in_tube) / warm

    before, flowed, moved = held(), 0.0, 0.0
    with pamsim.live(model):
        for u in np.repeat([1.0, 0.0, -1.0, 0.4], 125).tolist():
            data.ctrl[:] = (u, -0.3 * u)
            mujoco.mj_forward(model, data)
            row, act, _, pressure, _ = first_muscle(model, data)
            flow = flow_through_valves(row, pressure_at_valve(row, act, pressure), u, 0.0)
            flow -= leak_flow(row, pressure)
            flowed += flow * model.opt.timestep
            moved += abs(flow) * model.opt.timestep
            mujoco.mj_step(model, data)
    assert moved > 0.5 * before, "the cycle must move air"
    assert abs(held() - before - flowed) < 1e-9 * moved


@pytest.mark.parametrize(("index", "timestep"), [(1.0, 1e-3), (1.4, 5e-3)])
def test_sealed_chamber_keeps_p_v_to_the_n_under_motion_at_any_step(index, timestep):
    _, model, data = prepare({"chamber.polytropic_index": index}, (2e5, 2e5), timestep)
    seen, volumes = [], []
    with pamsim.live(model):
        for k in range(round(0.8 / timestep)):
            data.qfrc_applied[:] = 4.0 * np.sin(8.0 * k * timestep)
            mujoco.mj_step(model, data)
            *_, pressure, volume = first_muscle(model, data)
            volumes.append(volume)
            seen.append(pressure * volume**index)
    assert np.ptp(volumes) > 0.01 * np.mean(volumes), "the arm must move the muscle"
    np.testing.assert_allclose(seen, seen[0], rtol=1e-9)


def test_muscles_that_leak_into_each_other_end_at_one_pressure_and_keep_their_air():
    crossing = {"muscle_2:chamber.cross_leak_conductance": 2e-9}
    _, model, data = prepare({"chamber.polytropic_index": 1.0} | crossing, (3e5, 1e5))
    ends = [model.actuator_actadr[i] + model.actuator_actnum[i] - 1 for i in range(2)]
    before = data.act[ends].copy()
    with pamsim.live(model):
        mujoco.mj_step(model, data, 8000)
    first, second = pamsim.pressures(model, data)
    assert first == pytest.approx(second, rel=1e-4)
    assert abs(data.act[ends[0]] - before[0]) > 0.1 * before.sum()
    assert data.act[ends].sum() == pytest.approx(before.sum(), rel=1e-12)


# --- one muscle filled and shut ------------------------------------------------------------------


def filled(changes, hold=1.2, seconds=0.4):
    """Muscle 1 filled by its wide open valve, then shut; the arm held fast. Run, and its end."""
    rig, model, data = prepare({"joint.shaft.damping": 1e3, **changes}, 1e5)
    experiment = pamsim.Experiment(
        drive="valve",
        command_time=np.array([0.0, seconds]),
        command_value=np.array([[1.0, 0.0], [0.0, 0.0]]),
        start_pressure=np.array([1e5, 1e5]),
        duration=seconds + hold,
        settle=0.5,
    )
    run = pamsim.simulate(rig, experiment).completed()
    pamsim.restore_state(model, data, run.final_state)
    return run, first_muscle(model, data), int(seconds * run.meta["sample_hz"])


@pytest.fixture(scope="module")
def plain():
    run, _, _ = filled({})
    return run.pressure[:, 0]


def test_the_sensor_at_the_valves_leads_the_muscle_and_meets_it_once_they_are_shut(plain):
    run, (*_, inside, _), shut = filled(TUBE)
    pressure = run.pressure[:, 0]
    assert pressure[shut] > plain[shut] + 2e4
    assert pressure[-1] == pytest.approx(inside - 101325.0, rel=5e-4)
    assert inside > 2.5e5
    assert pressure[shut] > pressure[-1] + 2e4


def test_slow_valves_pass_what_their_opening_s_ramps_leave(plain):
    run, _, shut = filled({"valve.travel_time": 0.1})
    slow = run.pressure[:, 0]
    assert np.all((slow < plain)[5 : int(0.875 * shut)])
    # Opening and closing ramps are equally long: what the first withholds, the second gives.
    assert slow[-1] == pytest.approx(plain[-1], rel=0.02)


def test_after_a_fast_fill_the_pressure_falls_to_that_of_the_air_at_ambient_temperature():
    rate, sharp = 4.0, {"chamber.polytropic_index": 1.4}
    run, (row, act, length, inside, _), shut = filled({"chamber.heat_rate": rate} | sharp, hold=2.5)
    pressure, time = run.pressure[shut + 1 :, 0], run.time[shut + 1 :]
    assert pressure[0] > pressure[-1] + 5e3
    decay = np.exp(-rate * (time - time[0]))
    expected = pressure[-1] + (pressure[0] - pressure[-1]) * decay
    np.testing.assert_allclose(pressure, expected, rtol=2e-2)
    assert inside == pytest.approx(act[-AMBIENT] / chamber_volume(row, act, length, 0.0), rel=1e-3)
    polytropic, _, _ = filled(sharp, hold=0.5)
    assert np.ptp(polytropic.pressure[shut + 6 :, 0]) < 2e3


def test_a_regulator_behind_a_tube_holds_the_pressure_that_it_was_told():
    rig, *_ = prepare(TUBE, 1e5)
    step = pamsim.pressure_step((2e5, 2e5), (3.5e5, 2e5), duration=3.0)
    run = pamsim.simulate(rig, dataclasses.replace(step, settle=0.5)).completed()
    assert run.pressure[-1] == pytest.approx([3.5e5, 2e5], abs=200.0)
