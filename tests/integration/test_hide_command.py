"""``pamsim hide``: recordings that the readers take, and the ground truth apart."""

import json

import numpy as np
import pytest

import pamsim
from pamsim.comparison.protocols import PROTOCOLS
from pamsim.core.errors import InputError
from pamsim.physics.record import pack
from pamsim.recordings.recording_reader import read_recordings
from pamsim.twins.hide import hide
from pamsim.twins.noise import with_variation
from tests.unit.diagnosis.by_link.reports import VERDICTS

QUICK = ("--protocols", "bursts", "--repeats", "2")


def recorded(rig, effects=(), **options):
    defaults = {"protocols": ("bursts",), "variation": 0.0, "repeats": 1, "noise": 0.0}
    return hide(rig, dict(effects), **defaults | options)


@pytest.fixture(scope="module")
def clean(rig):
    return recorded(rig).trials["bursts_1"]


def test_the_ground_truth_is_beside_the_recording_and_not_in_it(run, tmp_path):
    folder = tmp_path / "data"
    code, out, err = run(
        "hide", "air_leak+chain_backlash", "--size", "1,2", "--out", folder,
        *QUICK, "--no-forces", "--coloured", "--seed", "3", "--json", tmp_path / "t.json",
    )  # fmt: skip
    assert (code, "4 trials" in out) == (0, True), err
    truth = json.loads((tmp_path / "data.ground_truth.json").read_text(encoding="utf-8"))
    assert truth == json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))
    assert [e["name"] for e in truth["effects"]] == ["air_leak", "chain_backlash"]
    assert truth["parameters"]["chain.backlash"]["value"] == pytest.approx(6e-4)
    assert not any("leak" in path.read_text(encoding="utf-8") for path in folder.iterdir())
    found = read_recordings(folder)
    assert found.rig == "mas20_arm"
    assert [(t.name, t.protocol) for t in found.trials] == [
        (f"{name}_{k}", name) for name in ("bursts", "bursts_check") for k in (1, 2)
    ]
    assert set(found.trials[0].measured) == {"pressure_1", "pressure_2", "angle"}
    first, same, other = (found.trials[k].command for k in range(3))
    assert np.array_equal(first, same)
    assert not np.array_equal(first, other)


def test_bad_input_is_said_and_exits_with_2(run, tmp_path):
    for line, words in (
        ("air_lek", "did you mean 'air_leak'"),
        ("quadratic_drag", "no effect 'quadratic_drag'"),
        ("air_leak --protocols levels", "no protocol 'levels'"),
        ("air_leak --protocols burst", "did you mean 'bursts'"),
        ("air_leak --size 1,2", "--size has 2 numbers, air_leak needs 1"),
        ("none --protocols bursts --repeats 0", "at least one trial"),
        ("none --protocols bursts --duration 0", "a trial needs a finite time"),
        ("none --protocols bursts --duration 20ms", "is 0.02 s; a trial needs a finite time"),
        ("none --protocols bursts --duration inf", "--duration"),
        ("none --protocols bursts,bursts", "--protocols has bursts twice; name it once"),
        ("none --protocols bursts --noise nan", "--noise is nan; it must be 0 or above"),
        ("none --protocols bursts --variation -1", "--variation is -1"),
        ("none --seed -1", "-1 is not in the range"),
        ("air_leak --size -1", "air_leak: a size of -1 hides nothing"),
        ("air_leak --size 0", "a --size of 0 hides nothing"),
        ("air_leak+air_leak --size 1,3", "has an effect twice"),
        ("valve_flow+valve_asymmetry", "another hidden effect has set valve.conductance_exhaust"),
        ("valve_flow+valve_mismatch", "another hidden effect has set valve.conductance_fill"),
        ("none --rig mas30_arm", "did you mean 'mas20_arm'"),
        ("none --rig equimus_leg --quantised", "states neither encoder nor converter"),
    ):
        args = (*line.split(), "--out", tmp_path / "d")
        code, _, err = run("hide", *args)
        assert (code, words in err) == (2, True), line


def test_the_same_seed_gives_the_same_bits_and_another_does_not(rig):
    one, same, other = (recorded(rig, seed=seed, noise=1.0).trials for seed in (1, 1, 2))
    assert all(np.array_equal(one[k].angle, same[k].angle) for k in one)
    assert not np.array_equal(one["bursts_1"].angle, other["bursts_1"].angle)


def test_noise_is_as_large_as_said_and_coloured_noise_drifts(rig, clean):
    for coloured, drift in ((False, 0.0), (True, 0.5 * np.exp(-0.01 / 0.3))):
        noisy = recorded(rig, coloured=coloured, repeats=6, noise=2.0).trials
        off = np.stack([noisy[f"bursts_{k}"].pressure - clean.pressure for k in range(1, 7)])
        assert off.std() == pytest.approx(800.0, rel=0.1)
        beside = np.mean(off[:, 1:] * off[:, :-1]) / np.mean(off**2)
        assert beside == pytest.approx(drift, abs=0.1)


def test_without_effects_noise_and_variation_the_recording_is_the_rig_itself(rig, clean):
    plain = pamsim.simulate(rig, PROTOCOLS["bursts"].experiment(0))
    for name in ("angle", "pressure"):
        assert np.array_equal(getattr(clean, name), getattr(plain, name))


def test_trials_differ_a_little_from_one_to_the_next(rig):
    same, varied = (recorded(rig, variation=v, repeats=2).trials for v in (0.0, 0.01))
    assert np.array_equal(same["bursts_1"].angle, same["bursts_2"].angle)
    spread = np.ptp(varied["bursts_1"].pressure - varied["bursts_2"].pressure)
    assert 100.0 < spread < 2e4


def test_what_is_hidden_is_in_the_result(rig, clean, tmp_path):
    """A sensor's error is in what is measured alone; effects at rest can be hidden, too."""
    off = recorded(rig, {"angle_bias": 2.0})
    assert off.trials["bursts_1"].angle - clean.angle == pytest.approx(0.02)
    assert np.array_equal(off.trials["bursts_1"].pressure, clean.pressure)
    assert off.summary() == "angle_bias (2 typical sizes) hidden in 2 trials of mas20_arm"
    ground_truth = off.save(tmp_path / "data")
    assert json.loads(ground_truth.read_text(encoding="utf-8")) == off.to_dict()
    locked = recorded(rig, {"braid_locking": 1.0})
    assert locked.effects[0].stands_for == ("braid_locking",)
    assert set(locked.hidden) == {"passive.locking", "passive.stiffness"}


def test_steps_are_those_of_the_rig_s_encoder_and_not_of_a_machine_that_moves_the_joint(rig):
    step = 2.0 * np.pi / rig.sensor.encoder_increments
    for protocol, in_steps in (("bursts", True), ("stretch", False)):
        found = recorded(rig, protocols=(protocol,), duration=0.5, quantised=True)
        turns = found.trials[f"{protocol}_1"].angle / step
        assert np.allclose(turns, np.round(turns), atol=1e-6) is in_steps


def test_the_demo_s_page_has_its_film_unless_none_is_wanted(run, tmp_path, monkeypatch):
    def refused(*_, **__):
        raise InputError("no screen")

    monkeypatch.setattr(pamsim, "diagnose", lambda *_, **__: VERDICTS["named"])
    monkeypatch.setattr(
        "pamsim.report.film.film_gap", lambda path, *_, **__: path.write_bytes(b"GIF89a")
    )
    monkeypatch.setattr("pamsim.scene.picture.picture_rest", refused)
    for choice, films in (("--film", 1), ("--no-film", 0)):
        _, printed, err = run("demo", choice, "--no-open", "--out", tmp_path / choice)
        assert "hidden was coulomb_friction" in printed
        assert (printed + err).count("no picture: no screen") == films
        page = (tmp_path / choice / "index.html").read_text("utf-8")
        assert page.count("data:image/gif;base64,R0lG") == films
    trials = read_recordings(tmp_path / "--film" / "recording").trials
    stated = "20 trials of 2 s"
    assert stated in run("demo", "--help")[1]
    assert stated == f"{len(trials)} trials of {trials[0].time[-1]:.0f} s"


def test_what_varies_from_trial_to_trial_is_what_a_muscle_or_bellows_has():
    for name, own in (("mas20_arm", 4), ("equimus_leg", 3)):  # bellows have no tube
        rig = pamsim.load_rig(name)
        varied = with_variation(rig, np.random.default_rng(1), 0.01).muscles
        changed = {
            slot
            for muscle, before in rig.muscles.items()
            for slot, number in enumerate(pack(before))
            if number != pack(varied[muscle])[slot]
        }
        assert len(changed) == own
