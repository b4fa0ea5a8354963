"""Planted effects appear in the gap of their own link, and in no other."""

from dataclasses import replace

import numpy as np
import pytest

from pamsim.comparison import link_inputs
from pamsim.comparison.chain_runs import link_residuals
from pamsim.comparison.link_gaps import gap_per_link
from pamsim.comparison.measurements import read_calibration_data
from pamsim.engine.rig import load_rig
from pamsim.engine.simulate import simulate
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.segments import trials_of as trials_of_log
from pamsim.twins.hide import hide
from tests.unit.recordings.made_trial import made_trial

SETTINGS = {"protocols": ("triangle", "staircase"), "duration": 2.0, "repeats": 3}
AIR, MUSCLE, JOINT = "valves and air", "muscle", "joint and transmission"
BOTH = "muscle and joint"
ARM = load_rig("mas20_arm")


def trials_of(folder, effects, rig=ARM, **settings):
    hide(rig, effects, **(SETTINGS | settings)).save(folder / "data")
    return read_calibration_data([folder / "data"]).of_rig(rig).trials


def exceeding(gaps):
    return {one.link for one in gaps.outputs if one.exceeds}


@pytest.mark.parametrize(
    ("effects", "forces", "links"),
    [
        ({"muscle_hysteresis": 1.0}, False, {BOTH}),
        ({"valve_delay": 1.0, "coulomb_friction": 1.0}, False, {AIR, BOTH}),
        ({"valve_delay": 1.0, "muscle_hysteresis": 1.0, "coulomb_friction": 1.0}, True,
         {AIR, MUSCLE, JOINT}),
    ],
)  # fmt: skip
def test_an_effect_is_born_in_its_own_link(tmp_path, effects, forces, links):
    gaps = gap_per_link(ARM, trials_of(tmp_path, effects, forces=forces, seed=2))
    assert exceeding(gaps) == links
    order = [link for link in (AIR, MUSCLE, BOTH, JOINT) if link in links]
    assert gaps.born_in == order[0]
    for one in gaps.outputs:
        assert one.floors > 1.5 if one.exceeds else one.floors < 1.6


def test_with_nothing_hidden_no_link_exceeds_its_floor(tmp_path):
    gaps = gap_per_link(ARM, trials_of(tmp_path, {}, seed=1, coloured=True))
    assert len(gaps.outputs) == 5
    assert not exceeding(gaps)
    assert gaps.born_in == ""
    # Two trials to each degree of freedom of a floor, for what varies from trial to trial.
    assert all(one.floors < 1.6 for one in gaps.outputs)


CREEPING = ARM.with_parameters({"creep.stiffness": 2e3})


@pytest.mark.parametrize(
    ("rig", "settings"),
    [(ARM, {}), (load_rig("two_joint_arm"), {}), (CREEPING, {"forces": False})],
    ids=["arm", "two joints", "creep, which rests where it is held"],
)
def test_without_noise_every_link_is_met_to_a_quarter_of_usual_noise(tmp_path, rig, settings):
    trials = trials_of(tmp_path, {}, rig, noise=0.0, variation=0.0, repeats=1, **settings)
    usual = {"pressure": 400.0, "force": 1.5, "angle": 9e-4}
    for (link, _, channel), residual in link_residuals(rig, trials).items():
        noise = usual[channel.split(".")[-1].split("_")[0]]
        assert np.sqrt(np.mean(residual**2)) < 0.25 * noise, link.name


@pytest.mark.parametrize("pressures", [False, True])
def test_a_part_of_a_log_begins_as_its_lead_in_has_left_the_rig(pressures):
    """Cut out in motion: simulated from rest, the knee would be off by 1 to 7 degrees."""
    leg = load_rig("equimus_leg")
    levels = 1e3 * np.array([[6.0, 3.0], [18.0, 8.0], [10.0, 12.0]])  # Pa
    experiment = Experiment(
        drive="pressure_set",
        command_time=0.4 * np.arange(6),
        command_value=np.tile(levels, (2, 1)),
        start_pressure=levels[0],
        duration=2.4,
        sample_rate=100.0,
    )
    run = simulate(leg, experiment)
    read = leg.names.joint_channels + leg.names.of_muscles("pressure") * pressures
    command = np.repeat(experiment.command_value, 40, axis=0)[[*range(240), -1]]
    measured = {channel: run.signal(channel) for channel in read}
    log = made_trial(command, measured, time=run.time, muscle_names=tuple(leg.muscles))
    entry = {"period": None, "segments": [[1.3, 2.3]], "lead_in": "1.2 s", "rate": None}
    (part,) = trials_of_log(log, entry, "log")
    residuals = link_residuals(leg, [part])
    assert len(residuals) == len(read)
    for (link, _, channel), residual in residuals.items():
        usual = {"pressure": 400.0, "angle": 9e-4}[channel.rpartition(".")[2]]
        assert np.sqrt(np.mean(residual**2)) < 0.25 * usual, link.name


def test_one_log_is_judged_by_the_noise_within_it_which_is_said(tmp_path):
    trials = trials_of(tmp_path, {"valve_delay": 1.0}, repeats=1, forces=False, variation=0.0)
    gaps = gap_per_link(ARM, trials)
    assert gaps.born_in == AIR
    assert {one.floor_from for one in gaps.outputs} <= {"within trials", "holds"}
    assert any("inputs recorded once" in note for note in gaps.notes)


def test_trials_with_another_load_show_no_floor(tmp_path):
    one, other, *_ = trials_of(tmp_path, {}, repeats=2, protocols=("triangle",), duration=0.5)
    for load, known in ((0.0, {"repeats"}), (1.2, {"within trials", "holds"})):
        gaps = gap_per_link(ARM, [one, replace(other, load=load)])
        assert {output.floor_from for output in gaps.outputs} <= known


def forces(noise=0.0):
    """Residuals of both forces at a held joint, away from where its hysteresis is symmetric."""
    command = np.tile([1.5e5, 3.5e5], (600, 1))
    measured = {"angle": np.full(600, -0.45) + noise}
    measured |= {"force_1": np.zeros(600), "force_2": np.zeros(600)}
    found = link_residuals(ARM, [made_trial(command, measured, drive="measured")])
    return np.stack([residual for (link, *_), residual in found.items() if link.name == MUSCLE])


def test_static_noise_of_an_imposed_motion_does_not_move_hysteresis(monkeypatch):
    quiet, noise = forces(), np.random.default_rng(4).normal(0.0, 1e-3, 600)
    drift = []
    for smooth in (True, False):
        if not smooth:
            monkeypatch.setattr(link_inputs, "smoothed", lambda _, values, *__: values)
        off = forces(noise) - quiet
        drift.append(np.abs(off[:, 300:].mean(axis=1) - off[:, :100].mean(axis=1)).max())
    assert drift[0] < 0.2  # of a loop that is 10 N wide
    assert drift[1] > 5.0 * drift[0]  # the noise itself, imposed, moves it on
