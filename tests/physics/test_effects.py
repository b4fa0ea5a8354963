"""Effects in the engine: off without a trace, on in both backends, at rest where a run starts."""

import dataclasses

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.batch import simulate_batch
from tests.both_backends import both_backends

SIGNALS = ("angle", "velocity", "pressure", "tension")
LOAD = 1.2
EFFECTS = {
    "air_leak": {"chamber.leak_conductance": 5e-12},
    "laminar_leak": {"chamber.laminar_leak_conductance": 3e-12},
    "supply_sag": {"valve.supply_resistance": 3e8},
    "supply_volume": {"valve.supply_resistance": 3e8, "valve.supply_volume": 1e-4},
    "turbulent_supply": {"valve.supply_square": 1e12},
    "asymmetric_dead_zone": {"valve.dead_zone": 0.2, "valve.dead_zone_asymmetry": 0.6},
    "viscoelastic_creep": {"creep.stiffness": 3e3, "creep.relaxation_time": 0.5},
    "second_branch": {"creep.stiffness_2": 3e3, "creep.relaxation_time_2": 0.5},
    "parallel_hysteresis": {
        "parallel_hysteresis.force_per_pressure": 2e-4,
        "parallel_hysteresis.chord": 30.0,
    },
    "softening": {"softening.share": 0.1, "softening.time": 0.5},
    "first_stroke": {"first_stroke.force": 40.0, "first_stroke.travel": 5e-3},
    "end_shape": {"end_shape.loss": 0.4, "end_shape.onset": -0.02},
    "line_lag": {"valve.line_lag": 0.04},
    "valve_delay": {"valve.delay": 0.013},
    "valve_closing": {"valve.closing_delay": 0.013},
    "chain_backlash": {"chain.backlash": 3e-4},
    "stribeck_friction": {"friction.stribeck_force": 10.0, "friction.stribeck_velocity": 5e-3},
    "dahl": {"friction.coulomb_force": 12.0},
    "lugre": {"friction.breakaway_force": 12.0, "friction.bristle_time": 1e-3},
    "dwell": {"friction.dwell_force": 20.0, "friction.dwell_time": 0.1},
    "asymmetric_hysteresis": {
        "parallel_hysteresis.force": 40.0,
        "parallel_hysteresis.asymmetry": 0.5,
        "parallel_hysteresis.dead_zone": 0.3,
    },
    "cross_leak": {"chamber.cross_leak_conductance": 5e-11},
    "valve_hysteresis": {"valve.hysteresis": 0.1},
    "valve_slew": {"valve.travel_time": 0.05},
    "tube_resistance": {"valve.tube_resistance": 2e8},
    "tube_friction": {"valve.tube_friction": 1e12},
    "heat": {"chamber.heat_rate": 2.0},
    "braid_friction": {"braid.friction": 7e-4},
    "sprocket_ripple": {"chain.ripple": 1e-4},
    "gradual_threshold": {"threshold.pressure": 3e4, "threshold.width": 5e4},
    "hardening_tube": {"passive.parallel": 3e3, "passive.hardening": 40.0},
    "hardening_chain": {"chain.compliance": 2e-6, "chain.hardening": 2e-3},
    "elastic_teeth": {"chain.backlash": 3e-4, "chain.tooth_compliance": 2e-6},
    "load_dependent_friction": {"friction.tension_share": 0.02},
    "learned_over_length": {"muscle_1:learned.low": -0.005, "muscle_1:learned.force_4": 30.0},
    "learned_tension": {"learned_tension.high": 0.05, "learned_tension.area_3": 1e-4},
    "learned_pull": {"learned_tension.high": 0.05, "learned_tension.pull_4": 30.0},
    "learned_flow": {"valve.learned_high": 1.0, "valve.learned_5": 0.4},
    "learned_over_speed": {"muscle_1:learned.slowest": -0.02, "muscle_1:learned.drag_4": 5.0},
    "learned_friction": {"muscle_1:learned.rub_low": -0.005, "muscle_1:learned.rub_4": 10.0},
    "learned_arm": {"muscle_1:chain.learned_low": -0.005, "muscle_1:chain.learned_4": 0.2},
}
SHAPES = {
    "parallel_hysteresis.chord": 30.0,
    "parallel_hysteresis.full_slip": 0.03,
    "parallel_hysteresis.decay": 0.7,
    "parallel_hysteresis.asymmetry": 0.5,
    "parallel_hysteresis.dead_zone": 0.3,
    "creep.relaxation_time": 0.1,
    "creep.relaxation_time_2": 0.2,
    "end_shape.onset": -0.1,
    "first_stroke.travel": 0.1,
    "softening.time": 0.1,
    "friction.stribeck_velocity": 0.1,
    "friction.presliding": 1e-6,
    "friction.bristle_time": 1e-3,
    "friction.dwell_time": 0.3,
    "friction.dwell_travel": 1e-3,
    "learned.force_4": 30.0,
    "learned.drag_2": -5.0,
    "learned.rub_2": 5.0,
    "learned.rub_speed": 0.02,
    "chain.learned_2": 0.1,
    "learned_tension.area_2": 1e-4,
    "learned_tension.pull_5": 30.0,
    "valve.learned_3": 0.4,
    "valve.supply_volume": 1e-4,
    "valve.supply_line": 1.0,
    "valve.tube_volume": 5e-5,
    "valve.dead_zone_asymmetry": 0.5,
    "chain.hardening": 2e-3,
    "chain.tooth_compliance": 2e-6,
    "passive.hardening": 40.0,
    "threshold.width": 5e4,
    "chain.ripple_pitch": 0.02,
    "chain.ripple_phase": 1.0,
}
"""A parameter that shapes an effect and does nothing without it."""


def valves(command="valve", duration=0.5, settle=1.0):
    return pamsim.Experiment(
        drive=command,
        command_time=np.array([0.0, 0.15, 0.3]),
        command_value=np.array([[0.6, -0.8], [0.0, 0.3], [-0.5, 0.0]]),
        start_pressure=np.array([3e5, 2e5]),
        duration=duration,
        settle=settle,
        load=LOAD,
    )


def step(start=(3e5, 3e5), end=(4.5e5, 1e5), duration=0.5, settle=1.0):
    made = pamsim.pressure_step(start, end, duration=duration, load=LOAD)
    return dataclasses.replace(made, settle=settle)


BRIEF = valves(duration=0.3, settle=0.05)  # the interpreted kernel is slow


@pytest.fixture(scope="module")
def plain(rig):
    return pamsim.simulate(rig, BRIEF).completed()


def same(one, other):
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in SIGNALS)


@pytest.mark.parametrize("experiment", [step(), valves(), valves("pulse")])
def test_shapes_of_effects_that_are_absent_leave_no_trace(rig, experiment):
    plain = pamsim.simulate(rig, experiment).completed()
    shaped = pamsim.simulate(rig.with_parameters(SHAPES), experiment).completed()
    assert same(plain, shaped)


@pytest.mark.parametrize("name", EFFECTS)
def test_effect_acts_equally_in_both_backends_and_goes_when_it_is_taken_out(rig, plain, name):
    there = rig.with_parameters(EFFECTS[name])
    run = both_backends(there, BRIEF)
    assert np.abs(run.angle - plain.angle).max() > 1e-4
    assert np.all(run.tension >= 0.0)
    assert np.array_equal(run.command, plain.command)
    gone = there.with_parameters(dict.fromkeys([next(iter(EFFECTS[name]))], 0.0))
    assert same(pamsim.simulate(gone, BRIEF), plain)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_rests_where_it_is_held_runs_in_batches_and_goes_on_from_its_state(rig, name):
    """All to the bit; no state is left to settle when time starts, but a run softens a muscle."""
    there = rig.with_parameters(EFFECTS[name])
    if name != "softening":
        stay = step((3e5, 2e5), (3e5, 2e5), settle=12.0)
        run = pamsim.simulate(there, stay).completed()
        assert np.ptp(run.angle) < 2e-6
        np.testing.assert_allclose(np.ptp(run.pressure, axis=0), 0.0, atol=2.0)
    part = pamsim.simulate(there, step(duration=0.2)).completed()
    opened = dataclasses.replace(valves(duration=0.2), start_pressure=np.array([3e5, 3e5]))
    alone = [pamsim.simulate(there, opened), part]
    jobs = [(there, opened), (there, step(duration=0.2))]
    for way in (1, -1):
        for found, expected in zip(simulate_batch(jobs[::way]), alone[::way], strict=True):
            assert same(found, expected)
            assert np.array_equal(found.final_state, expected.final_state)
    if name in ("valve_delay", "valve_closing"):
        with pytest.raises(InputError, match=r"\A[^\n]*valve\.delay[^\n]*\Z"):
            pamsim.simulate(there, step(duration=0.2), from_state=part.final_state)
        return
    whole = pamsim.simulate(there, step(duration=0.4)).completed()
    rest = pamsim.simulate(there, step(duration=0.2), from_state=part.final_state).completed()
    for signal in SIGNALS:
        joined = np.concatenate([getattr(part, signal), getattr(rest, signal)[1:]])
        assert np.array_equal(joined, getattr(whole, signal)), signal


def test_the_tension_recorded_is_the_muscle_s_and_not_its_friction(rig):
    there = rig.with_parameters(EFFECTS["stribeck_friction"] | EFFECTS["braid_friction"])
    model = there.model_for(load=LOAD, command="pressure_set")
    run = pamsim.simulate(there, step()).completed()
    assert np.sum(np.abs(run.velocity) > 0.05) > 50
    data = mujoco.MjData(model)
    pamsim.restore_state(model, data, run.final_state)
    with pamsim.live(model):
        mujoco.mj_forward(model, data)
    share = data.actuator_velocity / 5e-3
    friction = 10.0 * share * np.exp((1.0 - share**2) / 2.0)
    np.testing.assert_allclose(run.tension[-1], -data.actuator_force - friction, rtol=1e-12)


def test_a_step_too_long_for_what_is_fast_is_refused_with_the_remedy(rig):
    for what, changes in {
        "chain": {"chain.compliance": 1e-4, "chain.relaxation_time": 1e-3},
        "friction": {"friction.stribeck_force": 1e3, "friction.stribeck_velocity": 1e-4},
        "bristles": {"friction.coulomb_force": 1e3, "friction.presliding": 1e-7},
        "regulator": {"valve.regulator_band": 20.0},
    }.items():
        remedy = list(changes)[-1]
        with pytest.raises(InputError, match=rf"\A[^\n]*{what}[^\n]*{remedy}[^\n]*\Z"):
            pamsim.simulate(rig.with_parameters(changes), step())
