"""Training a policy: an extra, named where it is missing; what comes out drives the rig."""

from __future__ import annotations

import sys

import gymnasium
import numpy as np
import pytest

import pamsim
from pamsim.controllers.neural_policy import NeuralPolicy
from pamsim.core.errors import EngineError, InputError
from pamsim.envs.closed_loop import run_episode
from pamsim.envs.train import Training, train
from pamsim.recordings.policy_file import PolicyFile, read_policy, write_policy


def test_without_the_extra_it_is_named_in_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(EngineError, match=r"pamsim\[rl\]") as caught:
        train(steps=1)
    assert "\n" not in str(caught.value)


def test_what_cannot_be_trained_is_refused_first():
    for settings, message in (
        ({"steps": 1, "action": "on_off"}, "continuous"),
        ({"steps": 0}, "100000"),
        ({"steps": 1, "task": "sin"}, "sine"),
    ):
        with pytest.raises(InputError, match=message):
            train(**settings)


def test_a_policy_file_is_written_whole_and_not_over_another(tmp_path):
    rng = np.random.default_rng(0)
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
    result = Training(policy=policy, settings={}, seed=0, steps=[1], rewards=[-2.0])
    write_policy(tmp_path / "p.npz", policy)
    again = read_policy(tmp_path / "p.npz")
    for name in ("joints", "muscles", "command"):
        assert getattr(again, name) == getattr(policy, name)
    assert all(map(np.array_equal, again.weights, policy.weights))
    with pytest.raises(InputError, match="force"):
        result.save(tmp_path / "p.npz")


def test_a_round_of_training_gives_a_policy_that_drives_the_rig(tmp_path):
    pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")
    result = train(steps=1, rig="two_joint_arm", task="regulation")
    assert result.apart < 1e-4
    files = result.save(tmp_path / "p")
    assert [file.name for file in files] == ["p.npz", "p.json"]
    policy = NeuralPolicy.read(files[0], pamsim.load_rig("two_joint_arm"))
    env = gymnasium.make("pamsim/Rig-v0", rig="two_joint_arm", max_episode_steps=20)
    run = run_episode(env, policy, seed=0)
    env.close()
    assert np.isfinite(run.position).all()
