"""``pamsim hide``: recordings that the readers take, and the ground truth apart."""

from __future__ import annotations

import json

import numpy as np
import pytest

import pamsim
from pamsim.comparison.protocols import PROTOCOLS
from pamsim.recordings.recording_reader import read_recordings
from pamsim.twins.hide import hide
from tests.typed_command import run as command

QUICK = ("--protocols", "bursts", "--repeats", "2")


def run(monkeypatch, capsys, *args):
    return command(monkeypatch, capsys, "hide", *args)


def test_the_ground_truth_is_beside_the_recording_and_not_in_it(monkeypatch, capsys, tmp_path):
    folder = tmp_path / "data"
    code, out, err = run(
        monkeypatch, capsys, "air_leak+chain_backlash", "--size", "1,2", "--out", folder,
        *QUICK, "--no-forces", "--coloured", "--seed", "3", "--json", tmp_path / "t.json",
    )  # fmt: skip
    assert code == 0, err
    assert "4 trials" in out
    truth = json.loads((tmp_path / "data.ground_truth.json").read_text(encoding="utf-8"))
    assert truth == json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))
    assert [e["name"] for e in truth["effects"]] == ["air_leak", "chain_backlash"]
    assert truth["parameters"]["chain.backlash"]["value"] == pytest.approx(6e-4)
    text = "".join(path.read_text(encoding="utf-8") for path in folder.iterdir())
    assert "leak" not in text
    found = read_recordings(folder)
    assert [t.name for t in found.trials] == [
        "bursts_1", "bursts_2", "bursts_check_1", "bursts_check_2"
    ]  # fmt: skip
    assert {t.protocol for t in found.trials} == {"bursts", "bursts_check"}
    assert set(found.trials[0].measured) == {"pressure_1", "pressure_2", "angle"}
    assert np.array_equal(found.trials[0].command, found.trials[1].command)
    assert not np.array_equal(found.trials[0].command, found.trials[2].command)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["air_lek", *QUICK], "did you mean 'air_leak'"),
        (["quadratic_drag", *QUICK], "no effect 'quadratic_drag'"),
        (["air_leak", "--protocols", "levels"], "no protocol 'levels'"),
        (["air_leak", "--protocols", "burst"], "did you mean 'bursts'"),
        (["air_leak", "--size", "1,2", *QUICK], "2 sizes for 1 effects"),
        (["none", "--protocols", "bursts", "--repeats", "0"], "at least one trial"),
        (["none", "--rig", "mas30_arm"], "did you mean 'mas20_arm'"),
    ],
)
def test_bad_input_is_said_and_exits_with_2(monkeypatch, capsys, tmp_path, args, words):
    code, _, err = run(monkeypatch, capsys, *args, "--out", tmp_path / "d")
    assert code == 2
    assert words in err


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


def recorded(rig, effects=(), **options):
    return hide(rig, dict(effects), protocols=("bursts",), **{"repeats": 3, **options})


def test_the_same_seed_gives_the_same_bits_and_another_does_not(rig):
    one, same, other = (recorded(rig, seed=seed, repeats=1).trials for seed in (1, 1, 2))
    assert all(np.array_equal(one[k].angle, same[k].angle) for k in one)
    assert not np.array_equal(one["bursts_1"].angle, other["bursts_1"].angle)


@pytest.mark.parametrize("coloured", [False, True])
def test_noise_is_as_large_as_said_and_coloured_noise_drifts(rig, coloured):
    noisy = recorded(rig, coloured=coloured, variation=0.0, repeats=6, noise=2.0).trials
    clean = recorded(rig, variation=0.0, repeats=1, noise=0.0).trials["bursts_1"]
    off = np.stack([noisy[f"bursts_{k}"].pressure - clean.pressure for k in range(1, 7)])
    assert off.std() == pytest.approx(800.0, rel=0.1)
    beside = np.mean(off[:, 1:] * off[:, :-1]) / np.mean(off**2)
    assert beside == pytest.approx(0.5 * np.exp(-0.01 / 0.3) if coloured else 0.0, abs=0.1)


def test_without_effects_noise_and_variation_the_recording_is_the_rig_itself(rig):
    found = recorded(rig, variation=0.0, repeats=1, noise=0.0)
    run = found.trials["bursts_1"]
    assert found.hidden == {}
    plain = pamsim.simulate(rig, PROTOCOLS["bursts"].experiment(0))
    assert np.array_equal(run.angle, plain.angle)
    assert np.array_equal(run.pressure, plain.pressure)


def test_trials_differ_a_little_from_one_to_the_next(rig):
    same, varied = (recorded(rig, variation=v, noise=0.0).trials for v in (0.0, 0.01))
    assert np.array_equal(same["bursts_1"].angle, same["bursts_2"].angle)
    spread = np.ptp(varied["bursts_1"].pressure - varied["bursts_2"].pressure)
    assert 100.0 < spread < 2e4


def test_a_sensor_s_error_is_in_what_is_measured_alone(rig):
    plain = recorded(rig, variation=0.0, noise=0.0, repeats=1).trials["bursts_1"]
    off = recorded(rig, [("angle_bias", 2.0)], variation=0.0, noise=0.0, repeats=1)
    assert off.trials["bursts_1"].angle - plain.angle == pytest.approx(0.02)
    assert np.array_equal(off.trials["bursts_1"].pressure, plain.pressure)


def test_a_loaded_rig_is_named_in_the_recording_and_the_result_sums_itself_up(rig, tmp_path):
    hidden = recorded(rig, {"air_leak": 2.0}, repeats=1)
    assert hidden.summary() == "air_leak (2 typical sizes) hidden in 2 trials of mas20_arm"
    ground_truth = hidden.save(tmp_path / "data")
    assert read_recordings(tmp_path / "data").rig == "mas20_arm"
    assert json.loads(ground_truth.read_text(encoding="utf-8")) == hidden.to_dict()


def test_every_effect_of_the_catalog_can_be_hidden_at_rest_ones_included(rig):
    hidden = recorded(rig, {"braid_locking": 1.0}, repeats=1)
    assert hidden.effects[0].stands_for == ("braid_locking",)
    assert set(hidden.hidden) == {"passive.locking", "passive.stiffness"}
