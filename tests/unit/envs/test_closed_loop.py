"""A loop over an environment, and the figures read off it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

import pamsim
from pamsim.controllers.neural_policy import NeuralPolicy
from pamsim.core.errors import InputError
from pamsim.envs.actions import KINDS
from pamsim.envs.closed_loop import EpisodeRun, mean_score, run_episode, score
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
    env = made()
    for action, command, wanted in (
        ("pressure_set", (0.0, 600e3), [-1.0, 1.0]),
        ("valve", (0.25, -1.0), [0.25, -1.0]),
        ("on_off", (0.5, -0.5), [1, 0, 0, 1]),
        ("on_off", (0.1, -0.1), [0, 0, 0, 0]),
    ):
        assert KINDS[action].action(command, 600e3).tolist() == wanted
    run = run_episode(env, Held((350e3, 250e3)), seed=0)
    assert run.pressure[-1] == pytest.approx([350e3, 250e3], abs=1e3)
    assert len(run.position) == 50


def test_a_controller_of_the_other_kind_is_refused(made):
    with pytest.raises(InputError, match="Cascade"):
        run_episode(made(action="valve"), Held((0.0, 0.0)), seed=0)


def made_run(angle, reference, **more):
    n = len(angle)
    given = {
        "period": 0.01,
        "joints": ("shaft",),
        "position": np.asarray(angle, float)[:, np.newaxis],
        "reference": np.asarray(reference, float)[:, np.newaxis],
        "pressure": np.zeros((n, 2)),
        "command": np.zeros((n, 2)),
        "opening": np.zeros((n, 2)),
        "air": np.zeros((n, 2)),
        "stiffness": np.ones((n, 1)),
        "wanted_stiffness": np.zeros((n, 1)),
        "reward": 0.0,
    }
    return EpisodeRun(**{**given, **more})


def test_overshoot_and_settling_of_a_known_second_order_step():
    time = 0.01 * np.arange(1, 401)
    damping, turn = 0.4, 8.0
    fast = turn * math.sqrt(1.0 - damping**2)
    decay = np.exp(-damping * turn * time)
    step = 1.0 - decay * (np.cos(fast * time) + damping * turn / fast * np.sin(fast * time))
    found = score(made_run(0.2 * step, np.full(400, 0.2)))
    assert found.overshoot == pytest.approx(
        math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2)), rel=0.01
    )
    last = time[np.abs(step - 1.0) > 0.05][-1]
    assert found.settling == pytest.approx(last, abs=1e-9)
    assert found.rmse == pytest.approx(0.2 * np.sqrt(np.mean((step - 1.0) ** 2)))


def test_a_reference_that_moves_has_no_steps_and_a_free_stiffness_no_error():
    time = np.linspace(0.0, 6.0, 300)
    found = score(made_run(np.sin(time), np.sin(time)))
    assert found.rmse == found.worst == 0.0
    assert all(map(math.isnan, (found.overshoot, found.settling, found.stiffness_error)))


def test_switching_counts_changes_between_fill_shut_and_exhaust():
    opening = np.zeros((100, 2))
    opening[10:20, 0] = 1.0  # 2 changes
    opening[50:60, 1] = 1.0
    opening[60:70, 1] = -0.5  # 3 changes
    opening[80:, 0] = 0.01  # a leak of the regulator is shut
    assert score(made_run(np.zeros(100), np.zeros(100), opening=opening)).switching == 5.0


def test_means_over_episodes():
    one = score(made_run(np.full(10, 0.3), np.zeros(10)))
    other = score(made_run(np.full(10, 0.4), np.zeros(10)))
    both = mean_score([one, other])
    assert both.rmse == pytest.approx(math.sqrt((0.3**2 + 0.4**2) / 2.0))
    assert both.worst == pytest.approx(0.4)


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
    policy = NeuralPolicy.read(str(tmp_path / "p.npz"), RIG)
    run = run_episode(env, policy, seed=4)
    signals = env.unwrapped.rigs.signals
    observation, _ = env.reset(seed=4)
    for k in range(20):
        hidden = np.tanh(
            numbers["w_0"] @ (signals.si(observation) / numbers["scale"]) + numbers["b_0"]
        )
        fixed = np.clip(numbers["w_1"] @ hidden + numbers["b_1"], -1.0, 1.0)
        observation, *_, info = env.step(fixed.astype(np.float32))
        assert info["position"] == pytest.approx(run.position[k], abs=1e-9)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"w_1": np.zeros((2, 4))}, "fit each other"),
        ({"b_0": None}, "b_0"),
        ({"w_1": np.zeros((3, 5)), "b_1": np.zeros(3)}, "fit each other"),
        ({"joints": np.array(["elbow"])}, "shaft"),
        ({"supply": np.array("much")}, "name says"),
    ],
)
def test_what_is_no_policy_for_this_arm_is_refused(changed, message, tmp_path):
    written(tmp_path / "p.npz", **changed)
    with pytest.raises(InputError, match=message):
        NeuralPolicy.read(tmp_path / "p.npz", RIG)
    (tmp_path / "text.npz").write_text("hello")
    for name, why in (("none", "cannot read"), ("text", r"cannot be read as \.npz")):
        with pytest.raises(InputError, match=why):
            NeuralPolicy.read(tmp_path / f"{name}.npz", RIG)
