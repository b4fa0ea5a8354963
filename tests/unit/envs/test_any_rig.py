"""Observations, rewards and references follow from a rig's joints and muscles, whatever it is."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import pamsim
from pamsim.core.errors import InputError, ParameterError
from pamsim.engine.equilibrium import rest_angles, rest_positions
from pamsim.envs.actions import KINDS

MODELS = Path(__file__).parents[3] / "models"
SHIPPED = sorted(path.parent.name for path in MODELS.glob("*/params.toml"))
TWO = "two_joint_arm"


@pytest.fixture
def made(opened):
    return lambda rig=TWO, **options: opened(rig=rig, **options).unwrapped


def test_an_observation_is_its_formula_of_the_state(made):
    env = made(task="sine", load=0.5)
    muscles = "shoulder_flexor", "shoulder_extensor", "biceps", "triceps"
    given = dict(zip(muscles, (350e3, 200e3, 400e3, 100e3), strict=True))
    first, _ = env.reset(seed=3, options={"start_pressure": given})
    before = env.data.qpos.copy()
    seen, _, _, _, info = env.step(np.zeros(4, np.float32))
    travel, centre = np.array([(reach.travel, reach.centre) for reach in env.rigs.reaches]).T
    turn, supply = math.pi, 600e3
    assert np.abs(before).min() > 0.05
    assert np.array_equal(info["position"], env.data.qpos)
    assert first[:4] == pytest.approx([*((before - centre) / travel), 0.0, 0.0])
    filled = np.array([*given.values()])
    assert first[4:8] == pytest.approx(filled / (supply / 2) - 1.0, abs=1e-5)
    assert seen[:2] == pytest.approx((env.data.qpos - centre) / travel)
    assert seen[2:4] == pytest.approx((env.data.qpos - before) / env.dt / (turn * travel))
    assert seen[4:8] == pytest.approx(info["pressure"] / (supply / 2) - 1.0)
    signals = env.rigs.signals.named(seen)
    assert list(signals)[8:] == [
        f"{joint}.{what}_set"
        for what in ("angle", "velocity", "acceleration", "stiffness")
        for joint in ("shoulder", "elbow")
    ]
    assert signals["biceps.pressure"] == pytest.approx(info["pressure"][2])
    assert env.rigs.actions == tuple(f"{name}.pressure_set" for name in given)
    # The references of the observation at sample k are those at the end of step k.
    rows = np.array([env.step(np.zeros(4, np.float32))[0] for _ in range(80)])
    rate = (rows[2:, 8:10] - rows[:-2, 8:10]) / (2.0 * env.dt) / turn
    assert rows[1:-1, 10:12] == pytest.approx(rate, abs=0.02)
    bend = (rows[2:, 10:12] - rows[:-2, 10:12]) / (2.0 * env.dt) / turn
    inside = np.abs(env.dt * np.arange(3, 81) - 1.0) > 2.0 * env.dt  # the envelope ends at 1 s
    assert rows[1:-1, 12:14][inside] == pytest.approx(bend[inside], abs=0.02)


@pytest.mark.parametrize("rig", SHIPPED)
def test_observations_are_of_the_order_of_one(rig, made):
    for action in KINDS:
        # The leg's bellows are at their stops at a quarter of the supply pressure.
        low = rig == "equimus_leg" and action == "pressure_set"
        env = made(rig, action=action, task="sine", top_pressure=50e3 if low else None)
        env.action_space.seed(0)
        rows = []
        for seed in range(2):
            env.reset(seed=seed)
            for _ in range(14):
                held = env.action_space.sample()
                rows += [env.step(held)[0] for _ in range(20)]
        joints = len(env.rigs.rig.joints)
        used = np.array(rows)[:, :-joints]
        size = np.sqrt(np.mean(used**2, axis=0))
        assert len(size) == 5 * joints + len(env.rigs.rig.muscles)
        # The bench's rod makes half its way below a quarter of the supply; above it is slow.
        least = 0.05 if rig == "muscle_bench" and action == "valve" else 0.1
        assert least < size.min() < size.max() < 3.0, (action, size)
        assert np.abs(used).max() < 8.0  # nothing is clipped


def test_reward_of_a_mirrored_target_and_motion_is_the_same(made):
    env = made(effort=0.1, load=0.5)
    target = {"shoulder": 0.4, "elbow": -0.3}
    moves = np.random.default_rng(0).uniform(-1.0, 1.0, (30, 4)).astype(np.float32)
    found = []
    for sign, order in ((1.0, [0, 1, 2, 3]), (-1.0, [1, 0, 3, 2])):
        seen, _ = env.reset(options={"target": {j: sign * at for j, at in target.items()}})
        assert sign * env.rigs.signals.named(seen)["elbow.angle_set"] == pytest.approx(-0.3)
        found.append([env.step(move[order])[1] for move in moves])
    assert found[1] == pytest.approx(found[0], abs=1e-9)
    assert np.ptp(found[0]) > 0.5


def test_joints_reach_what_tasks_ask_for(made):
    env = made(task="regulation")
    arm = made("mas20_arm").rigs.reaches[0]
    pressures = np.array([[6e5, 0.0], [0.0, 6e5]])
    ends = rest_angles(pamsim.load_rig("mas20_arm"), pressures, np.zeros(2))
    assert arm.centre == pytest.approx(ends.mean(), abs=1e-8)
    assert arm.travel == pytest.approx(np.ptp(ends) / 4.0, rel=1e-8)
    assert arm.stiffness[0] < arm.stiffness[1]
    for reach in env.rigs.reaches:
        assert reach.centre == pytest.approx(0.0, abs=1e-9)
        assert math.radians(20.0) < reach.travel < math.radians(50.0)
        assert 0.0 < reach.stiffness[0] < reach.stiffness[1]


def test_rest_positions_are_where_a_simulation_without_hysteresis_ends():
    rig = pamsim.load_rig(TWO).with_parameters({"hysteresis.force_per_pressure": 0.0})
    pressure = np.array([400e3, 250e3, 450e3, 200e3])
    found = rest_positions(rig, pressure, np.zeros(2))
    run = pamsim.simulate(rig, pamsim.pressure_step(pressure, pressure, duration=0.01)).completed()
    assert found == pytest.approx(run.positions[-1], abs=1e-6)
    assert np.abs(found).min() > 0.1
    # A range ends the way of a joint, and the other one finds its rest beside it.
    low, high = rig.model.jnt_range[0].copy()
    rig.model.jnt_range[0] = low, 0.5 * found[0]
    held = rest_positions(rig, pressure, np.zeros(2))
    rig.model.jnt_range[0] = low, high
    assert held[0] == 0.5 * found[0]
    assert abs(held[1] - found[1]) > 0.01
    # A rig that starts slack comes to the same rest.
    bench = pamsim.load_rig("muscle_bench")
    ends = [rest_positions(bench, np.zeros(1), np.array([near])) for near in (-0.05, 0.0)]
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)


def test_options_of_reset_replace_what_is_drawn(made):
    env = made("mas20_arm", load=(0.0, 2.0), randomize=True, task="step")
    fixed = {"load": 0.7, "start_pressure": 200e3, "target": {"shaft": 0.2}}
    options = {**fixed, "parameters": {"joint.shaft.damping": 0.5}}
    seen, info = env.reset(seed=1, options=options)
    assert info["pressure"] == pytest.approx([200e3, 200e3])
    assert env.rigs.signals.named(seen)["shaft.angle_set"] == pytest.approx(0.2)
    assert env.model.body("load").mass == 0.7
    assert env.model.dof_damping[0] == 0.5
    assert env.reset(seed=1)[1]["pressure"] == pytest.approx([300e3, 300e3])
    assert env.model.body("load").mass != 0.7
    env = made()
    stop = math.radians(95.0)
    assert env.reset(options={"target": {"elbow": -stop}})[1]["target"][1] == -stop
    for options, error, message in (
        ({"laod": 1.0}, InputError, "load"),
        ({"target": {"elbw": 1.0}}, InputError, "elbow"),
        ({"target": {"elbow": math.inf}}, ParameterError, "elbow"),
        ({"target": {"elbow": 30.0}}, InputError, r"at 30, beyond its stops at -1\.658 and 1\.6"),
        ({"start_pressure": {"bicep": 1e5}}, InputError, "biceps"),
        ({"start_pressure": 700e3}, InputError, "supply"),
        ({"load": -1.0}, ParameterError, "load"),
        ({"parameters": {"joint.knee.damping": 1.0}}, InputError, "knee"),
        ({"parameters": {"valve.delay": 0.02}}, InputError, "option `delay`"),
        ({"parameters": {"biceps:valve.closing_delay": 0.02}}, InputError, "option `delay`"),
    ):
        with pytest.raises(error, match=message):
            env.reset(options=options)


@pytest.mark.parametrize("muscle", ["shoulder_flexor", "triceps"])  # the first, and the last
def test_what_a_muscle_states_as_its_own_is_not_drawn_with_the_others(muscle, made):
    rig = pamsim.load_rig(TWO).with_parameters({f"{muscle}:passive.stiffness": 3e4})
    entry = rig.file.muscle["passive"]["stiffness"]
    shared = {"passive": {"stiffness": dataclasses.replace(entry, interval95=(9000.0, 9500.0))}}
    own = {"passive": {"stiffness": dataclasses.replace(entry, value=3e4, interval95=None)}}
    file = dataclasses.replace(
        rig.file,
        muscle={**rig.file.muscle, **shared},
        overrides={**rig.file.overrides, muscle: {**rig.file.overrides[muscle], **own}},
    )
    env = made(dataclasses.replace(rig, file=file), randomize=True)
    stiffness = []
    for seed in range(5):
        env.reset(seed=seed)
        held = [one.passive.stiffness for one in env.rigs.muscles(0)]
        assert held.pop(list(rig.muscles).index(muscle)) == 3e4
        assert len(set(held)) == 1
        stiffness += held[:1]
    assert len(set(stiffness)) == 5
    assert all(abs(one / entry.value - 1.0) < 0.1 for one in stiffness)
    env.reset(seed=0, options={"parameters": {"passive.stiffness": 1e4}})
    assert {one.passive.stiffness for one in env.rigs.muscles(0)} == {1e4}


def test_no_stiffness_is_had_where_moment_arms_change_or_all_muscles_are_slack(made):
    env = made("equimus_leg", task="stiffness")
    with pytest.raises(InputError, match="fixed tendons"):
        env.reset(seed=0)
    env = made("equimus_leg", task="step")
    env.reset(seed=0)
    assert np.isnan(env.rigs.stiffness()).all()
    env = made(pamsim.load_rig(TWO).with_parameters({"mounting.length_at_zero": 0.185}))
    assert [reach.stiffness for reach in env.rigs.reaches] == [(0.0, 0.0)] * 2
    assert np.isfinite(env.reset(seed=0)[0]).all()


def test_a_rig_folder_of_a_user_is_an_environment(tmp_path, made):
    pamsim.new_rig("mine", kind="leg", out=tmp_path / "mine")
    check_env(made(tmp_path / "mine", task="disturbance"), skip_render_check=True)
