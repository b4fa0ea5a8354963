"""Rest: the torque balance, longer time steps and any valve come to where the arm ends."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.equilibrium import moment_arms, rest_angles, rest_positions, tendon_lengths
from pamsim.engine.new_rig import new_rig
from pamsim.engine.state import RestSteps, settle, settle_quickly
from pamsim.engine.stepping import live, muscle_ids

PRESSURE = np.array([[300e3, 100e3], [120e3, 200e3], [400e3, 380e3]])
LOAD = np.array([0.0, 2.14, 1.2])
LEARNED = {f"muscle_1:learned.force_{i}": 30.0 for i in range(1, 25)}


@pytest.fixture(scope="module")
def rig():
    """Without hysteresis, which the balance leaves out."""
    return pamsim.load_rig("mas20_arm").with_parameters({"hysteresis.force_per_pressure": 0.0})


def test_the_balance_is_where_the_simulated_arm_ends(rig):
    for values in (
        {"body.rig.tilt": 0.2},
        {"chain.compliance": 2e-6, "threshold.pressure": 2e4},
        {"braid.extensibility": 1e-7, "tendon.chain_1.coef": 0.011},
        {"chain.compliance": 2e-5, "chain.hardening": 2e-3},
        {"muscle_1:learned.low": -0.05, "muscle_1:learned.high": 0.05, **LEARNED},
    ):
        changed = rig.with_parameters(values)
        changed.model.opt.timestep = 1e-3
        balanced = rest_angles(changed, PRESSURE, LOAD)
        for angle, pressure, load in zip(balanced, PRESSURE, LOAD, strict=True):
            start = (float(pressure.max()),) * 2
            step = pamsim.pressure_step(
                start, tuple(pressure), duration=6.0, load=float(load), sample_rate=20.0
            )
            end = pamsim.simulate(changed, step).completed().angle[-1]
            assert angle == pytest.approx(end, abs=np.radians(0.05)), values


def test_neither_where_the_search_begins_nor_other_rows_matter(rig):
    found = rest_angles(rig, PRESSURE, LOAD)
    for off in (-0.2, 1e-4, 0.3):
        assert rest_angles(rig, PRESSURE, LOAD, found + off) == pytest.approx(found, abs=1e-8)
    alone = [rest_angles(rig, PRESSURE[[i]], LOAD[[i]])[0] for i in range(3)]
    assert np.array_equal(found, alone)


def test_an_arm_rests_where_its_muscles_go_slack_or_at_its_stop(rig, tmp_path):
    new_rig("arm", "joint", out=tmp_path / "arm")
    slack = pamsim.load_rig(tmp_path / "arm")
    pressure, none = np.array([[4e5, 0.0], [0.0, 4e5]]), np.zeros(2)
    found = rest_angles(slack, pressure, none)
    exact = [rest_positions(slack, row, np.zeros(1))[0] for row in pressure]
    assert found == pytest.approx(np.array(exact), abs=1e-6)
    assert abs(found[0]) < slack.model.jnt_range[0, 1]
    near = rig.with_parameters({"body.rig.tilt": 0.0})
    near.model.jnt_range[0] = -0.1, 0.2
    assert rest_angles(near, pressure, none) == pytest.approx([0.2, -0.1])


def test_an_arm_that_is_held_against_gravity_rests_as_one_whose_actuators_hold_it(tmp_path):
    found = []
    for holding in ("false", "true"):
        mjcf = tmp_path / f"{holding}.xml"
        mjcf.write_text(
            "<mujoco><worldbody><body gravcomp='0.5'><geom type='capsule' size='.02' mass='1'"
            " fromto='0 0 0 .3 0 0'/><joint name='j' axis='0 1 0' range='-40 40'"
            f" actuatorgravcomp='{holding}'/></body></worldbody><tendon><fixed name='flexor'>"
            "<joint joint='j' coef='.02'/></fixed></tendon></mujoco>"
        )
        rig = pamsim.load_rig(new_rig("arm", mjcf=mjcf, out=tmp_path / holding))
        found.append(rest_angles(rig, np.array([[1e5]]), np.zeros(1))[0])
    assert found[0] == pytest.approx(found[1], abs=1e-9)
    assert abs(found[0]) < 0.6  # not at its stop


def test_a_row_without_a_balance_is_not_a_number_and_two_joints_are_refused(rig):
    weak = rig.with_parameters({"passive.stiffness": 0.0, "force.a": 0.0, "force.d": 0.0})
    assert rest_angles(weak, np.array([[3e5, 1e5]]), np.zeros(1)) == weak.model.jnt_range[0, 1]
    weak.model.jnt_limited[:] = 0
    assert np.isnan(rest_angles(weak, np.array([[3e5, 1e5]]), np.zeros(1))).all()
    with pytest.raises(InputError, match="2 degrees of freedom"):
        rest_angles(pamsim.load_rig("two_joint_arm"), PRESSURE, LOAD)


def at_rest(rig, steps, **swinging):
    """Position, velocity and time step after settling; by `settle` itself for 0 steps."""
    pressures = (2.4e5, *(2e5,) * (len(rig.muscles) - 1))
    experiment = pamsim.pressure_step(pressures, pressures, duration=0.1)
    model = rig.model_for()
    data = mujoco.MjData(model)
    with live(model):
        if steps:
            longer = RestSteps(later=steps * model.opt.timestep, **swinging)
            settle_quickly(model, data, experiment, rig.limits, longer)
        else:
            settle(model, data, experiment)
    return data.qpos.copy(), data.qvel.copy(), data.time, model.opt.timestep


def test_rest_in_longer_steps_is_the_same():
    for name in ("mas20_arm", "two_joint_arm"):
        rig = pamsim.load_rig(name)
        slow, quick = at_rest(rig, 0), at_rest(rig, 16)
        assert quick[0] == pytest.approx(slow[0], abs=np.deg2rad(0.02))
        assert not np.array_equal(quick[0], slow[0])  # it did settle in longer steps
        assert abs(quick[1]).max() < 1e-9
        assert quick[2:] == slow[2:]


def test_dry_friction_leaves_a_rig_where_it_does_in_its_own_steps_if_its_swings_are_in_those():
    """In longer steps the swings die down sooner, and the joint stops elsewhere."""
    model = pamsim.load_rig("mas20_arm").model
    model.body_mass[:] *= 0.01
    model.body_inertia[:] *= 0.01
    mujoco.mj_setConst(model, mujoco.MjData(model))
    rig = replace(pamsim.load_rig("mas20_arm"), model=model).with_parameters(
        {"joint.shaft.frictionloss": 0.3}
    )
    slow, quick = at_rest(rig, 0)[0], at_rest(rig, 40)[0]
    swung = at_rest(rig, 40, swinging=float(model.opt.timestep), swings=2.0)[0]
    assert abs(quick - slow).max() > np.deg2rad(0.2)
    assert swung == pytest.approx(slow, abs=np.deg2rad(0.002))


def test_a_rig_that_breaks_down_in_longer_steps_settles_in_its_own():
    """In steps of 4 ms the bench's mass flies off."""
    rig = pamsim.load_rig("muscle_bench")
    for slow, quick in zip(at_rest(rig, 0), at_rest(rig, 8), strict=True):
        assert np.array_equal(slow, quick)


START = (320e3, 90e3)


@pytest.mark.parametrize("command", ["pressure_set", "valve"])
def test_a_trial_starts_at_the_pressures_it_was_measured_to_start_at(command):
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
    for values in (
        {"valve.dead_zone": 0.3},
        {"valve.regulator_dead_band": 4e3},
        {"valve.hysteresis": 0.2},
        {"creep.stiffness_2": 5e3, "creep.relaxation_time_2": 200.0},
    ):
        shut = pamsim.simulate(rig.with_parameters(values), experiment).completed()
        np.testing.assert_allclose(shut.pressure[0], START, atol=1.0)
        np.testing.assert_allclose(shut.pressure[-1], START, atol=50.0)
        assert shut.angle[0] == pytest.approx(plain.angle[0], abs=1e-6), values


def test_a_trial_may_start_below_the_regulators_least_set_point_to_which_they_then_fill():
    rig = pamsim.load_rig("mas20_arm").with_parameters({"valve.least_set_point": 200e3})
    run = pamsim.simulate(rig, pamsim.pressure_step(START, START, duration=2.0)).completed()
    np.testing.assert_allclose(run.pressure[0], START, atol=1.0)
    np.testing.assert_allclose(run.pressure[-1], (START[0], 200e3), rtol=1e-3)


@pytest.mark.parametrize("name", ["two_joint_arm", "equimus_leg"])
def test_lengths_and_arms_of_many_poses_are_those_of_the_engine(name):
    rig = pamsim.load_rig(name)
    model, data = rig.model, mujoco.MjData(rig.model)
    poses = np.tile(model.qpos0, (3, 2, 1))
    joints = rig.position_addresses
    poses[..., joints] += 0.1 * np.random.default_rng(1).standard_normal((3, 2, len(joints)))
    lengths, arms = tendon_lengths(rig, poses), moment_arms(rig, poses)
    muscles = muscle_ids(model)
    assert (lengths.shape, arms.shape) == (
        (3, 2, len(muscles)),
        (3, 2, len(muscles), len(joints)),
    )
    degrees = [model.joint(joint).dofadr[0] for joint in rig.joints]
    for place in np.ndindex(3, 2):
        data.qpos[:] = poses[place]
        mujoco.mj_fwdPosition(model, data)
        full = np.zeros((model.nu, model.nv))
        mujoco.mju_sparse2dense(
            full, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        np.testing.assert_allclose(lengths[place], data.actuator_length[muscles], rtol=1e-12)
        expected = full[np.ix_(muscles, degrees)]
        np.testing.assert_allclose(arms[place], expected, atol=1e-8)
        assert np.array_equal(moment_arms(rig, poses[place]), arms[place])
