"""``tests.plant.hide``: recordings of the plant, and a ground truth in physical terms."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import pamsim
from pamsim.core.errors import InputError
from pamsim.recordings.recording_reader import read_recordings
from pamsim.twins.noise import ANGLE_NOISE
from tests.plant.hide import command, hide

QUICK = {"protocols": ("bursts",), "repeats": 1, "duration": 0.4}


def test_other_formulas_are_in_the_ground_truth_alone_with_their_size_in_physical_terms(tmp_path):
    folder = tmp_path / "data"
    effects, sizes = "air_leak+eccentric_encoder+sticking_friction", ("--size", "1,1,2")
    trials = [
        "--protocols",
        "pulses,bursts",
        "--repeats",
        "1",
        "--duration",
        "400ms",
        "--quantised",
    ]
    ran = CliRunner().invoke(command, [effects, *sizes, *trials, "--out", str(folder)])
    assert ran.exit_code == 0, ran.output
    ground_truth = json.loads((tmp_path / "data.ground_truth.json").read_text(encoding="utf-8"))
    effects = {effect["name"]: effect for effect in ground_truth["effects"]}
    assert list(effects) == ["sticking_friction", "laminar_leak", "eccentric_encoder"]
    assert effects["laminar_leak"]["stands_for"] == ["air_leak"]
    assert "laminar" in effects["laminar_leak"]["formulation"]
    assert effects["eccentric_encoder"]["stands_for"] == []
    breakaway = effects["sticking_friction"]["physical"]["breakaway_torque"]
    assert breakaway["value"] == pytest.approx(0.6, rel=0.01)
    assert breakaway["unit"] == "N*m"
    assert ground_truth["parameters"]["joint.shaft.frictionloss"]["value"] == pytest.approx(0.33)
    assert ground_truth["settings"]["formulation"] == "independent"
    text = "".join(path.read_text(encoding="utf-8") for path in folder.iterdir())
    assert not any(word in text for word in ("encoder", "leak", "independent", "timestep"))
    trial = read_recordings(folder).trials[0]
    assert trial.time[-1] == pytest.approx(0.4)
    steps = trial.measured["angle"] / (2.0 * np.pi / 2500)
    assert np.abs(steps - np.round(steps)).max() < 1e-4


def test_an_effect_of_the_library_keeps_its_formula_in_the_plant(rig):
    hidden = hide(rig, {"air_leak": 2.0}, formulation="plant", **QUICK)
    assert [(one.name, one.formulation) for one in hidden.effects] == [("air_leak", "library")]
    assert list(hidden.hidden) == ["chamber.leak_conductance"]
    same = hide(rig.with_parameters(hidden.hidden), {}, formulation="plant", **QUICK)
    assert np.array_equal(hidden.trials["bursts_1"].angle, same.trials["bursts_1"].angle)


def test_seeds_noise_and_inputs_are_those_of_the_library(rig):
    own, other = (one(rig, {}, **QUICK, seed=3) for one in (hide, pamsim.hide))
    assert list(own.trials) == list(other.trials)
    for name, trial in own.trials.items():
        there = other.trials[name]
        assert np.array_equal(trial.command, there.command)
        assert np.abs(trial.angle - there.angle).max() < np.radians(0.05)  # noise aside, the same


def test_bad_input_is_said(rig):
    for effects, options, words in (
        ({"cogging_torqe": 1.0}, {}, "did you mean 'cogging_torque'"),
        ({"added_inertia": 1.0}, {}, "has no other formula"),
        ({"laminar_leak": -1.0}, {}, "must be above 0, not -1"),
        ({}, {"protocols": ("chrp",)}, "did you mean 'chirp'"),
        ({}, {"formulation": "indepndent"}, "did you mean 'independent'"),
        ({}, {"step": 0.0}, "must be above 0"),
    ):
        with pytest.raises(InputError, match=words):
            hide(rig, effects, **QUICK | options)


def test_a_longer_step_moves_no_sample_by_a_hundredth_of_the_noise(rig):
    levels = QUICK | {"protocols": ("levels",), "variation": 0.0, "noise": 0.0}
    fine, coarse = (
        hide(rig, {"sticking_friction": 0.5}, **levels, step=step).trials
        for step in (3.5e-4, 1.4e-3)
    )
    for name in fine:
        off = np.abs(coarse[name].angle - fine[name].angle) / ANGLE_NOISE
        assert 0.0 < off.max() < 0.01
