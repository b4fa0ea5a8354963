"""A loop over an environment, what tasks ask of it, and the figures read off it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import pamsim
from pamsim.controllers.neural_policy import NeuralPolicy, PolicyFile, read_policy, write_policy
from pamsim.envs.actions import KINDS
from pamsim.envs.closed_loop import EpisodeRun, mean_score, run_episode, score
from pamsim.envs.scales import Reach
from pamsim.envs.tasks import TASKS
from pamsim.envs.train import Training, policy_files, train
from tests.unit.core.refusals import all_refused, refused
from tests.unit.physics.flat import air_flow

RIG = pamsim.load_rig("mas20_arm")


@dataclass(frozen=True)
class Held:
    """Always the same command."""

    fixed: tuple[float, float]
    period: float = 0.02
    command: str = "pressure_set"

    def start(self, first):
        return 0

    def step(self, observation, memory):
        assert observation.time == pytest.approx(memory * self.period)
        return self.fixed, memory + 1


@pytest.fixture
def made(opened):
    return lambda **options: opened(**{"max_episode_steps": 50, **options})


def test_air_let_in_is_what_flowed_through_the_valve(made):
    env = made(max_episode_steps=1000, frame_skip=4)
    run = run_episode(env, Held((500e3, 300e3), period=0.002), seed=0)
    row = env.unwrapped.rigs.gauges.rows[0, 0]
    flow = [air_flow(row, p + 101325.0, 500e3, 0.0) for p in run.pressure[:, 0]]
    assert run.air[:, 0].sum() == pytest.approx(np.sum(flow) * run.period, rel=0.01)
    assert run.air[:, 1].sum() < 0.2 * run.air[:, 0].sum()


def test_what_the_loop_commands_is_what_the_environment_gets(made):
    for action, command, wanted in (
        ("pressure_set", (0.0, 600e3), [-1.0, 1.0]),
        ("valve", (0.25, -1.0), [0.25, -1.0]),
        ("on_off", (0.5, -0.5), [1, 0, 0, 1]),
        ("on_off", (0.1, -0.1), [0, 0, 0, 0]),
    ):
        assert KINDS[action].action(command, 600e3).tolist() == wanted
    run = run_episode(made(), Held((350e3, 250e3)), seed=0)
    assert run.pressure[-1] == pytest.approx([350e3, 250e3], abs=1e3)
    assert len(run.position) == 50
    with refused("Cascade"):
        run_episode(made(action="valve"), Held((0.0, 0.0)), seed=0)
    stepped = Held((350e3, 250e3), period=math.nan)  # fails at its first step
    for endless in (made(max_episode_steps=-1), made().unwrapped):
        with refused("max_episode_steps"):
            run_episode(endless, stepped, seed=0)


def test_a_run_records_what_the_environment_took_and_what_reached_the_valves(made):
    low = run_episode(made(top_pressure=400e3), Held((600e3, 200e3)), seed=0)
    assert low.command[-1] == pytest.approx([400e3, 200e3])
    assert low.opening[-1] == pytest.approx([0.0, 0.0], abs=1e-3)
    for opening, taken in ((0.2, 0.0), (0.5, 1.0)):  # from a third on a valve is switched
        run = run_episode(made(action="on_off"), Held((opening, -opening), command="valve"), seed=0)
        assert np.array_equal(run.command, np.tile([taken, -taken], (50, 1)))
        assert np.array_equal(run.opening, run.command)
    late = run_episode(made(action="valve", delay=0.07), Held((1.0, -1.0), command="valve"), seed=0)
    assert (late.command == [1.0, -1.0]).all()
    # 3.5 periods: the fourth step is the first at whose end the valves are open.
    assert late.opening[:5, 0].tolist() == [0.0, 0.0, 0.0, 1.0, 1.0]
    assert np.array_equal(np.diff(late.pressure[:, 0]) > 1.0, late.opening[1:, 0] > 0.0)


def figures(angle, reference, **more):
    """What is read off a run of one joint."""
    n = len(angle)
    pairs = dict.fromkeys(("pressure", "command", "opening", "air"), np.zeros((n, 2)))
    run = {
        "period": 0.01,
        "joints": ("shaft",),
        "travel": np.full(1, 0.3),
        "start": np.zeros(1),
        "position": np.asarray(angle, float)[:, np.newaxis],
        "reference": np.asarray(reference, float)[:, np.newaxis],
        "stiffness": np.ones((n, 1)),
        "wanted_stiffness": np.zeros((n, 1)),
        "reward": 0.0,
    }
    return score(EpisodeRun(**{**run, **pairs, **more}))


def test_overshoot_and_settling_of_a_known_second_order_step():
    time = 0.01 * np.arange(1, 401)
    damping, turn = 0.4, 8.0
    fast = turn * math.sqrt(1.0 - damping**2)
    decay = np.exp(-damping * turn * time)
    step = 1.0 - decay * (np.cos(fast * time) + damping * turn / fast * np.sin(fast * time))
    found = figures(0.2 * step, np.full(400, 0.2))
    peak = math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
    assert found.overshoot == pytest.approx(peak, rel=0.01)
    last = time[np.abs(step - 1.0) > 0.05][-1]
    assert found.settling == pytest.approx(last, abs=1e-9)
    assert found.rmse == pytest.approx(0.2 * np.sqrt(np.mean((step - 1.0) ** 2)))


def test_a_step_is_judged_from_where_it_starts_and_against_what_the_joint_can_travel():
    left = np.exp(-np.arange(1, 401) / 30.0)

    def approach(start, goal, size=1.0):
        angle = size * (goal + (start - goal) * left)
        return figures(
            angle, np.full(400, size * goal), start=size * np.array([start]), travel=[0.3 * size]
        )

    up = approach(0.0, 0.3)
    assert up.settling == pytest.approx(0.01 * math.floor(30.0 * math.log(20.0)))
    for start, goal in ((0.5, 0.8), (0.5, 0.2), (0.5, 0.0), (0.3, 0.0)):
        found = approach(start, goal)
        for figure in ("overshoot", "settling"):
            # The same in mm on a joint that slides.
            assert getattr(approach(start, goal, 1e-3), figure) == getattr(found, figure)
        assert (found.overshoot, found.settling) == (0.0, pytest.approx(up.settling))
    assert math.isnan(approach(0.3, 0.3).settling)


def test_a_moving_reference_has_no_steps_and_switching_counts_changes_of_the_valve():
    time = np.linspace(0.0, 6.0, 300)
    found = figures(np.sin(time), np.sin(time))
    assert found.rmse == found.worst == 0.0
    assert all(map(math.isnan, (found.overshoot, found.settling, found.stiffness_error)))
    opening = np.zeros((100, 2))
    opening[10:20, 0] = 1.0  # 2 changes
    opening[50:60, 1] = 1.0
    opening[60:70, 1] = -0.5  # 3 changes
    opening[80:, 0] = 0.01  # a leak of the regulator is shut
    assert figures(np.zeros(100), np.zeros(100), opening=opening).switching == 5.0
    both = mean_score([figures(np.full(10, angle), np.zeros(10)) for angle in (0.3, 0.4)])
    assert both.rmse == pytest.approx(math.sqrt((0.3**2 + 0.4**2) / 2.0))
    assert both.worst == pytest.approx(0.4)


def test_an_episode_without_steps_or_one_that_broke_down_is_no_good_figure():
    steps = figures(np.full(50, 0.1), np.full(50, 0.2))
    mean = mean_score([steps, figures(np.zeros(50), np.full(50, 1e-4))])  # a step too low to be one
    assert (mean.settling, mean.overshoot) == (steps.settling, steps.overshoot) == (0.5, 0.0)
    assert math.isnan(mean.stiffness_error)
    broken = figures([0.2] * 10 + [math.nan], np.full(11, 0.2))
    assert broken.settling == pytest.approx(0.11)
    assert math.isnan(broken.overshoot)


def written(path, **changed):
    rng = np.random.default_rng(0)
    arrays = {
        "joints": np.array(["shaft"]),
        "muscles": np.array(["muscle_1", "muscle_2"]),
        "command": np.array("pressure_set"),
        "supply": np.array(600e3),
        "centre": np.zeros(8),
        "scale": np.array([0.5, 1.0, 6e5, 6e5, 0.5, 1.0, 10.0, 5.0]),
        "w_0": rng.normal(size=(5, 8)),
        "b_0": rng.normal(size=5),
        "w_1": rng.normal(size=(2, 5)),
        "b_1": rng.normal(size=2),
        **changed,
    }
    np.savez(path, **{name: a for name, a in arrays.items() if a is not None})
    return arrays


def test_a_policy_sees_what_the_environment_shows(tmp_path, made):
    numbers = written(tmp_path / "p.npz")
    env = made(task="sine")
    run = run_episode(env, NeuralPolicy.read(str(tmp_path / "p.npz"), RIG), seed=4)
    signals = env.unwrapped.rigs.signals
    observation, _ = env.reset(seed=4)
    for k in range(20):
        seen = signals.si(observation) / numbers["scale"]
        hidden = np.tanh(numbers["w_0"] @ seen + numbers["b_0"])
        fixed = np.clip(numbers["w_1"] @ hidden + numbers["b_1"], -1.0, 1.0)
        observation, *_, info = env.step(fixed.astype(np.float32))
        assert info["position"] == pytest.approx(run.position[k], abs=1e-9)


def test_a_policy_file_is_written_whole_and_another_rig_s_is_refused(tmp_path):
    path, rng = tmp_path / "p.npz", np.random.default_rng(0)
    policy = PolicyFile(
        joints=("shoulder", "elbow"),
        muscles=("a", "b", "c", "d"),
        command="valve",
        supply=6e5,
        centre=rng.normal(size=16),
        scale=rng.uniform(1.0, 2.0, 16),
        weights=(rng.normal(size=(5, 16)), rng.normal(size=(4, 5))),
        biases=(rng.normal(size=5), rng.normal(size=4)),
    )
    write_policy(path, policy)
    again = read_policy(path)
    for name in ("joints", "muscles", "command"):
        assert getattr(again, name) == getattr(policy, name)
    assert all(map(np.array_equal, again.weights, policy.weights))
    with refused("force"):  # it is not written over another
        Training(policy=policy, settings={}, seed=0, steps=[1], rewards=[-2.0]).save(path)
    bad = {
        "weights": ({"w_1": np.zeros((2, 4))}, "fit each other"),
        "outputs": ({"w_1": np.zeros((3, 5)), "b_1": np.zeros(3)}, "fit each other"),
        "missing": ({"b_0": None}, "b_0"),
        "joints": ({"joints": np.array(["elbow"])}, "shaft"),
        "supply": ({"supply": np.array("much")}, "name says"),
    }
    all_refused(bad, lambda changed: [written(path, **changed), NeuralPolicy.read(path, RIG)])
    path.write_text("hello")
    with refused("cannot be read as .npz"):
        NeuralPolicy.read(path, RIG)
    with refused("cannot read"):
        NeuralPolicy.read(tmp_path / "none.npz", RIG)


def test_what_cannot_be_trained_is_refused_first():
    bad = {
        "action": ({"steps": 1, "action": "on_off"}, "continuous"),
        "steps": ({"steps": 0}, "100000"),
        "task": ({"steps": 1, "task": "sin"}, "sine"),
    }
    all_refused(bad, lambda settings: train(**settings))
    assert [file.name for file in policy_files(Path("run.1"))] == ["run.1.npz", "run.1.json"]
    assert policy_files(Path("a/run.npz")) == [Path("a/run.npz"), Path("a/run.json")]
    all_refused({"here": (Path(), "a folder"), "up": (Path(".."), "a folder")}, policy_files)


def test_a_round_of_training_gives_a_policy_that_drives_the_rig(tmp_path, made):
    pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")
    result = train(steps=1, rig="two_joint_arm", task="regulation")
    assert result.apart < 1e-4
    files = result.save(tmp_path / "p")
    assert [file.name for file in files] == ["p.npz", "p.json"]
    policy = NeuralPolicy.read(files[0], pamsim.load_rig("two_joint_arm"))
    run = run_episode(made(rig="two_joint_arm", max_episode_steps=20), policy, seed=0)
    assert np.isfinite(run.position).all()


REACH = Reach(centre=0.1, travel=0.3, stiffness=(4.0, 9.0), torque=0.5)
TIME = 1e-3 * np.arange(8001)


def asked(task, seed=0):
    return TASKS[task](np.random.default_rng(seed), TIME, REACH)


def test_all_that_tasks_ask_for_is_within_reach_and_follows_from_the_seed():
    for task in TASKS:
        one, again, other = (asked(task, seed).position for seed in (1, 1, 2))
        assert np.array_equal(one, again)
        assert not np.array_equal(one, other)
        for found in (asked(task, seed) for seed in range(5)):
            assert np.abs(found.position - REACH.centre).max() <= REACH.travel * 1.6
            assert np.abs(found.torque).max() <= REACH.torque
            wanted = found.stiffness[found.stiffness != 0.0]
            assert ((wanted >= REACH.stiffness[0]) & (wanted <= REACH.stiffness[1])).all()
            assert (len(wanted) > 0) == (task == "stiffness")
            assert found.torque.any() == (task == "disturbance")
    step = asked("step").position  # held for two seconds
    assert TIME[1:][np.diff(step) != 0.0] == pytest.approx([2.0, 4.0, 6.0, 8.0])
