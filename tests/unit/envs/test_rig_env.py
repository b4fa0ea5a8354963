"""One environment: Gymnasium's own check, the plant behind it, seeds, delay, instruments."""

import hashlib
import itertools
import math
import subprocess
import sys

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import pamsim
from pamsim.core.errors import EngineError, InputError, ParameterError
from pamsim.envs import ENVIRONMENT
from pamsim.envs.actions import KINDS
from pamsim.envs.episode import Episode, random_parameters
from pamsim.envs.rig_env import RigEnv
from pamsim.envs.tasks import TASKS
from pamsim.physics.spline import shares
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.sensors import lagged, through_backlash
from tests.unit.core.refusals import all_refused

PRESSURE, VALVE, ON_OFF = (f"pamsim/PamArm{kind}-v0" for kind in ("Pressure", "Valve", "OnOff"))
UNIT = 0.25  # error of the position, as a share of the travel, that costs 1
RIGS = ("mas20_arm", "two_joint_arm")


@pytest.fixture
def made(opened):
    short = {"max_episode_steps": 40, "frame_skip": 20}
    return lambda name=PRESSURE, **options: opened(name, **{**short, **options}).unwrapped


def played(env, actions, seed=0):
    """Observed signals [SI], rewards and true angles of an episode of the arm."""
    observation, info = env.reset(seed=seed)
    rows = [[*env.rigs.signals.si(observation), 0.0, info["position"][0]]]
    for action in actions:
        observation, reward, _, _, info = env.step(action)
        rows.append([*env.rigs.signals.si(observation), reward, info["position"][0]])
    return np.array(rows)


def actions(count):
    return np.random.default_rng(1).uniform(-1.0, 1.0, (count, 2)).astype(np.float32)


def held(count, *values):
    return np.tile(np.array(values or (0.0, 0.0), dtype=np.float32), (count, 1))


def simulated(env, moves, load=0.0, **changed):
    """What `simulate` makes of the commands of some actions."""
    experiment = Experiment(
        drive="pressure_set",
        command_time=env.rigs.period * np.arange(len(moves)),
        command_value=0.5 * env.rigs.top_pressure * (moves.astype(float) + 1.0),
        start_pressure=np.full(2, 300e3),
        duration=env.rigs.period * len(moves),
        sample_rate=1.0 / env.rigs.period,
        load=load,
    )
    rig = pamsim.load_rig("mas20_arm").with_parameters(changed)
    return pamsim.simulate(rig, experiment).completed()


@pytest.mark.parametrize("rig", RIGS)
def test_gymnasium_finds_nothing_to_say(rig, made):
    for action, task in zip(itertools.cycle(KINDS), TASKS, strict=False):
        check_env(made(ENVIRONMENT, rig=rig, action=action, task=task), skip_render_check=True)


def test_an_episode_is_what_simulate_makes_of_the_same_commands(made):
    env = made(load=1.2)
    rows = played(env, actions(30))
    run = simulated(env, actions(30), load=1.2)
    assert np.array_equal(rows[:, -1], run.angle)
    assert rows[:, 2:4] == pytest.approx(run.pressure, rel=1e-12)
    late = made(delay=0.013)  # not a whole number of periods
    run = simulated(late, actions(20), **{"valve.delay": 0.013})
    assert played(late, actions(20))[:, -1] == pytest.approx(run.angle, abs=1e-9)


@pytest.mark.parametrize("rig", RIGS)
def test_a_reset_keeps_the_data_and_leaves_nothing_in_it(rig, made):
    env = made(ENVIRONMENT, rig=rig, randomize=rig == "mas20_arm", task="disturbance")
    env.reset(seed=3)
    data = env.data
    rest = pamsim.save_state(env.model, data)
    for _ in range(12):
        env.step(env.action_space.sample())
    data.xfrc_applied[-1], data.qacc_warmstart[:] = 1.0, 2.0
    env.reset(seed=3)
    assert env.data is data
    assert np.array_equal(pamsim.save_state(env.model, data), rest)
    # And the engine's timers run beside it.
    model = mujoco.MjModel.from_xml_string("<mujoco><worldbody/></mujoco>")
    other = mujoco.MjData(model)
    mujoco.mj_step(model, other, 100)
    assert other.timer[mujoco.mjtTimer.mjTIMER_STEP].duration > 0.0


PLAYED = """
import hashlib, sys, gymnasium, numpy as np, pamsim.envs.rig_vector_env
env = gymnasium.make("pamsim/PamArmValve-v0", frame_skip=20, angle_noise=1e-3)
moves = np.random.default_rng(1).uniform(-1.0, 1.0, (25, 2)).astype(np.float32)
seen = [env.reset(seed=3)[0], *(env.step(a)[0] for a in moves)]
print(hashlib.sha256(np.array(seen).tobytes()).hexdigest())
assert not {"warp", "mujoco_warp"} & set(sys.modules), "they are an extra"
"""


def test_same_seed_same_bits_in_another_process(made):
    env = made(VALVE, angle_noise=1e-3)
    own = np.array([env.reset(seed=3)[0], *(env.step(move)[0] for move in actions(25))])
    command = [sys.executable, "-c", PLAYED]
    message = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert message.stdout.strip() == hashlib.sha256(own.tobytes()).hexdigest()


def test_effort_costs_the_squared_change_of_command(made):
    moves = actions(20)
    free, dear = made(effort=0.0), made(effort=0.5)
    change = np.diff(np.concatenate([np.zeros((1, 2)), moves]), axis=0)
    cost = played(free, moves)[1:, 8] - played(dear, moves)[1:, 8]
    assert cost == pytest.approx(0.5 * (change**2).mean(axis=1), abs=1e-6)


def test_a_torque_from_outside_turns_the_arm(made):
    angle = played(made(task="disturbance"), held(120))[:, -1]
    assert np.ptp(angle[:100]) < 1e-6
    assert np.ptp(angle[100:]) > 1e-3


def test_noise_and_encoder_are_of_the_stated_size(made):
    noisy = played(made(angle_noise=2e-3, pressure_noise=1e3), held(400))
    assert noisy[:, 0].std() == pytest.approx(2e-3, rel=0.15)
    assert noisy[:, 2].std() == pytest.approx(1e3, rel=0.15)
    rounded = played(made(instruments=True), actions(30))[:, 0]
    steps = rounded / (2.0 * math.pi / 2500.0)
    assert steps == pytest.approx(np.round(steps), abs=1e-6)
    assert len(np.unique(steps.round())) > 3
    env, coarse = made(instruments=True), {"sensor.encoder_increments": 100.0}
    start = {"start_pressure": {"muscle_1": 352e3, "muscle_2": 271e3}}
    for bits in (4.0, 14.0):  # each episode has its own instruments
        parameters = {**coarse, "sensor.converter_bits": bits}
        seen, _ = env.reset(seed=0, options={**start, "parameters": parameters})
        resolution = env.rigs.rig.with_parameters(parameters).sensor.pressure_step
        rounded = env.rigs.signals.si(seen)[[0, 2, 3]] / [2.0 * math.pi / 100.0, *[resolution] * 2]
        assert rounded == pytest.approx(np.round(rounded), abs=1e-6)
        assert rounded.all()


def test_an_instrument_shows_what_a_recording_would(made):
    errors = {
        "angle_lag": 0.05,
        "angle_backlash": 0.005,
        "angle_bend": 0.3,
        "angle_bias": 0.01,
        "learned_low": -0.02,
        "learned_high": 0.01,
        "learned_2": 0.004,
        "learned_7": -0.003,
        "pressure_scale": 1.1,
        "pressure_bend": 2e-7,
        "clock_offset": 0.1,  # of a log: the environment has none
    }
    rig = pamsim.load_rig("mas20_arm")
    env = made(rig=rig.with_parameters({f"sensor.{name}": to for name, to in errors.items()}))
    rows = played(env, actions(30))
    turned = through_backlash(rows[:, -1], 0.005)
    assert np.ptp(rows[:, -1]) > 0.01
    behind = lagged(env.rigs.period * np.arange(31), turned, 0.05)
    learned = shares(behind, -0.02, 0.01, 8) @ [0.0, 0.004, 0.0, 0.0, 0.0, 0.0, -0.003, 0.0]
    assert np.ptp(learned) > 1e-3
    assert rows[:, 0] == pytest.approx(behind + 0.3 * behind**2 + 0.01 + learned, abs=1e-12)
    true = env.rigs.true[0, 1]
    assert 1.1 * true + 2e-7 * true**2 == pytest.approx(rows[-1, 2])
    env.reset(seed=0)
    np.testing.assert_array_equal(played(env, actions(30)), rows)


def test_randomized_arms_spread_as_the_file_says(made):
    known = random_parameters(pamsim.load_rig("mas20_arm"))
    centre, sd, *_ = known["joint.shaft.damping"]
    assert centre == pytest.approx(0.3247)
    assert sd == pytest.approx((0.409 - 0.213) / 3.92, rel=1e-3)
    env, rng = made(randomize=True), np.random.default_rng(0)
    usual = Episode(start_pressure=(300e3, 300e3))
    episodes = [env.rigs._episodes.draw(rng, usual) for _ in range(300)]
    drawn = [episode.parameters["joint.shaft.damping"] for episode in episodes]
    assert np.mean(drawn) == pytest.approx(centre, abs=4 * sd / 300**0.5)
    assert np.std(drawn) == pytest.approx(sd, rel=0.15)
    one, other = (played(env, actions(2), seed=s)[:, -1] for s in (1, 2))
    assert not np.array_equal(one, other)
    assert env.rigs.drawn[0].parameters["joint.shaft.damping"] == env.model.dof_damping[0]


def test_on_off_valves_are_interlocked(made):
    both, none = (
        played(made(ON_OFF), [np.array(a, dtype=np.int8)] * 20)
        for a in ([1, 1, 1, 0], [0, 0, 1, 0])
    )
    continuous = played(made(VALVE), held(20, 0.0, 1.0))
    assert np.array_equal(both[:, -1], none[:, -1])
    assert np.array_equal(both[:, -1], continuous[:, -1])
    assert both[-1, 3] > both[0, 3]


def test_a_closed_environment_refuses_and_leaves_another_alone(made):
    one, other = made(), made()
    alone = played(one, actions(10))
    other.close()
    assert np.array_equal(played(one, actions(10)), alone)
    with pytest.raises(EngineError, match="closed"):
        played(other, actions(1))


def test_episodes_end_after_max_episode_steps_and_longer_ones_begin_as_shorter_ones(opened, made):
    env = opened(PRESSURE, max_episode_steps=10)
    env.reset(seed=0)
    assert [env.step(held(1)[0])[3] for _ in range(10)] == [False] * 9 + [True]
    assert gymnasium.spec(PRESSURE).max_episode_steps == 400
    for task in TASKS:
        env = made(task=task, frame_skip=1)
        env.reset(seed=1)
        short, long = (env.rigs._episodes.table(env.rigs.drawn[0], n) for n in (401, 1602))
        assert np.array_equal(long[:401], short)
    for _ in range(450):  # past the rows that are made at first
        *_, broken, ended, _ = env.step(held(1)[0])
        assert (broken, ended) == (False, False)
    assert np.array_equal(env.rigs._table[0], long[:802])


@pytest.mark.usefixtures("unchecked")
def test_a_run_that_breaks_down_terminates_with_finite_observations(made):
    env = made()
    env.reset(seed=0)
    env.rigs.plant.act[0, -1] = np.nan
    for _ in range(3):
        observation, reward, terminated, *_ = env.step(held(1)[0])
    assert terminated
    assert np.isfinite(observation).all()
    assert reward == -100.0


def test_a_picture_shows_the_arm(made):
    plain = made()
    plain.reset(seed=0)
    with pytest.raises(InputError, match="render_mode"):
        plain.render()
    env = made(render_mode="rgb_array", width=160, height=100)
    env.reset(seed=0)
    first = env.render()
    for action in held(40, 1.0, -1.0):
        env.step(action)
    assert first.shape == (100, 160, 3)
    assert np.abs(first.astype(int) - env.render()).max() > 50


def test_a_bad_option_is_refused_by_name(made):
    for options, error, message in (
        ({"taks": "step"}, InputError, "task"),
        ({"task": "sin"}, InputError, "sine"),
        ({"frame_skip": 2.5}, InputError, "whole"),
        ({"frame_skip": math.nan}, ParameterError, "frame_skip"),
        ({"load": (2.0, 1.0)}, InputError, "lower end"),
        ({"load": "heavy"}, InputError, "kg"),
        ({"load": -1.0}, ParameterError, "load"),
        ({"start_pressure": 900e3}, InputError, "supply"),
        ({"delay": math.nan}, ParameterError, "delay"),
        ({"action": "pulse"}, InputError, "on_off"),
        ({"rig": "mas20"}, InputError, "mas20_arm"),
        ({"rig": "two_joint_arm", "randomize": True}, InputError, "no 95 % interval"),
        ({"render_mode": "ansi"}, InputError, "rgb_array"),
    ):
        with pytest.raises(error, match=message):
            RigEnv(**options)
    bad = {
        "a number": ({"task": lambda rng, time, reach: 0.3}, "positions at the"),
        "nan": ({"task": lambda rng, time, reach: np.full(len(time), np.nan)}, "no finite number"),
        "a word": ({"task": lambda rng, time, reach: "up"}, "positions at the"),
        "no function": ({"reward": 1.0}, "give a function"),
        "one reward": ({"reward": lambda info: 1.0}, "return shape (1,)"),
        "infinite": (
            {"reward": lambda info: info["position"][:, 0] * np.inf},
            "a finite number for each",
        ),
    }
    all_refused(bad, lambda options: played(made(**options), actions(1)))
    sizes = {"one": (held(1)[:, :1], "shape (1,)"), "three": (np.zeros((1, 3)), "shape (3,)")}
    all_refused(sizes, lambda moves: played(made(), moves), "takes 2 numbers")
    options = {name: ({name: 0.0}, f"{name} is 0.0") for name in ("target", "parameters")}
    all_refused(options, lambda given: made().reset(seed=0, options=given))


def test_the_information_holds_the_target_the_terms_of_the_reward_and_whether_it_is_met(made):
    env = made(task="stiffness", effort=0.3)
    (joint,), (reach,) = env.rigs.rig.joints, env.rigs.reaches
    _, info = env.reset(seed=3)
    names = [f"reward_{name}" for name in ("position", "effort", "stiffness")]
    assert [info[name] for name in names] == [0.0] * 3
    for action in actions(5):
        asked = env.named()
        _, reward, _, _, info = env.step(action)
        assert info["target"] == pytest.approx(asked[f"{joint}.angle_set"])
        terms = [info[name] for name in names]
        assert sum(terms) == reward
        assert max(terms) < 0.0
        missed = abs(info["position"] - info["target"]).max() / (UNIT * reach.travel)
        ((have,),) = env.rigs.stiffness()
        assert terms[0] == pytest.approx(-missed)
        assert terms[2] == pytest.approx(-abs(have / asked[f"{joint}.stiffness_set"] - 1.0))
        assert info["is_success"] == (missed < 0.1)
    at_rest = made(task="regulation")
    _, info = at_rest.reset(seed=0)
    target = {"target": {joint: float(info["position"][0])}}
    _, info = at_rest.reset(seed=0, options=target)
    assert info["is_success"] is True


def test_the_stiffness_is_that_by_the_pulleys_of_the_episode(made):
    env, radii = made(task="stiffness"), ("tendon.chain_1.coef", "tendon.chain_2.coef")
    usual, found = float(env.rigs.rig.model.wrap_prm[1]), []
    for factor in (1.0, 1.5, 1.0):
        env.reset(seed=0, options={"parameters": dict.fromkeys(radii, factor * usual)})
        found.append(env.rigs.stiffness().item())
    assert found == pytest.approx([found[0], 1.5**2 * found[0], found[0]], rel=1e-3)


def growing(rng, time, reach):
    """A position that grows from the centre, with noise of the episode."""
    return reach.centre + (0.02 + 1e-4 * rng.uniform()) * time**2


def nearness(info):
    return 1.0 - np.abs(info["position"] - info["target"]).sum(axis=1)


def test_a_task_and_a_reward_of_ones_own(made):
    env = made(task=growing, reward=nearness, max_episode_steps=500)
    (joint,) = env.rigs.rig.joints
    env.reset(seed=1)
    bends = [env.named()[f"{joint}.acceleration_set"]]
    for action in held(410):  # beyond the first table
        seen, reward, _, _, info = env.step(action)
        bends.append(env.named()[f"{joint}.acceleration_set"])
        assert reward == 1.0 - abs(info["position"] - info["target"])[0]
    rate = 2.0 * (info["target"][0] - env.rigs.reaches[0].centre) / (410 * env.dt)
    ahead = env.named(seen)
    assert ahead[f"{joint}.angle_set"] > info["target"][0]
    assert ahead[f"{joint}.velocity_set"] == pytest.approx(rate, rel=0.02)
    assert bends == pytest.approx([0.04] * len(bends), abs=2e-4 + 1e-9)
    many = gymnasium.make_vec(
        PRESSURE, 3, vectorization_mode="vector_entry_point", task=growing, reward=nearness
    )
    many.reset(seed=1)
    _, rewards, _, _, info = many.step(many.action_space.sample())
    assert np.array_equal(rewards, nearness(info))
    many.close()


def test_an_action_is_made_from_pressures_or_openings(made):
    env = made(top_pressure=5e5)
    muscles = list(env.rigs.rig.muscles)
    env.reset(seed=0)
    action = env.action_of(dict(zip(muscles, (1e5, 5e5), strict=True)))
    assert action.tolist() == pytest.approx([-0.6, 1.0])
    assert made(VALVE).action_of(dict.fromkeys(muscles, -0.5)).tolist() == [-0.5, -0.5]
    bad = {
        "unknown": ({"bicep": 1e5}, "no muscle 'bicep'"),
        "missing": ({muscles[0]: 1e5}, f"no command for {muscles[1]}"),
    }
    all_refused(bad, env.action_of)
