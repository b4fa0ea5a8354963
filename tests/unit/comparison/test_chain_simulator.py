"""Links simulated with many parameter sets: exact at the rig as it is, near it elsewhere."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from pamsim.comparison import chain_runs
from pamsim.comparison.chain_runs import COARSE, ChainRuns, in_link, link_residuals, plain
from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.effects_on_rig import at_size, rig_effect
from pamsim.comparison.links import link_runs
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.noise_floor import FloorRoute
from pamsim.comparison.repeats import repeats
from pamsim.engine.rig import load_rig
from pamsim.engine.state import RestSteps
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.step_metrics import rough_noise
from pamsim.twins.hide import hide
from tests.unit.core.refusals import refused

ARM = load_rig("mas20_arm")
SETTINGS = {"protocols": ("bursts",), "repeats": 2, "duration": 1.0}


def recorded(folder, effects=None, rig=ARM, **settings):
    hide(rig, effects or {}, **{"forces": False, **SETTINGS, **settings}).save(folder)
    read = read_recordings(folder)
    data = CalibrationData(sources=(), rig=read.rig, trials=read.trials, tables=())
    return data.of_rig(rig).trials


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("chain") / "data")


@pytest.fixture(scope="module")
def chain(trials):
    return ChainSimulator(ARM, repeats(trials))


def links_of(chain):
    return {link.name: link for link in chain.links}


def losses_of(chain):
    """Mean square of the whitened rows of each trial."""
    rows = {}
    for block in chain.blocks:
        rows.setdefault(block.unit, []).append(block.white(chain.stated[block.rows]))
    return np.array([np.mean(np.concatenate(own) ** 2) for own in rows.values()])


def run(chain, values, links=None, **options):
    (found,) = chain.residuals([values], [frozenset(links or chain.links)], chain.stated, **options)
    return found


def rows_of(chain, link):
    """Which rows belong to a link."""
    of = np.repeat(chain.link_of, [block.size for block in chain.blocks])
    return of == chain.links.index(link)


def as_it_is(chain):
    """Link, trial and channel -> residual of the rig as it is."""
    return {
        (chain.links[link], block.unit, block.channel): chain.stated[block.rows]
        for block, link in zip(chain.blocks, chain.link_of, strict=True)
    }


def test_the_rig_as_it_is_has_the_residual_of_its_trials_own_inputs(chain, trials):
    repeated, alone = as_it_is(chain), as_it_is(ChainSimulator(ARM, repeats(trials[:1])))
    for key, own in link_residuals(ARM, trials).items():
        assert 0.0 < np.mean((repeated[key] - own) ** 2) < 5e-4 * np.mean(own**2)
        if key in alone:
            np.testing.assert_allclose(alone[key], own, rtol=0.0, atol=1e-9)
    for steps in (COARSE, 2, 1):
        np.testing.assert_allclose(run(chain, {}, steps=steps), chain.stated, rtol=0, atol=1e-9)


@pytest.mark.parametrize("protocol", ["bursts", "staircase"])
def test_a_rig_that_breaks_down_in_long_time_steps_gets_shorter_ones(
    tmp_path, protocol, monkeypatch
):
    """The bench pulled by measured forces, if it comes to rest in long time steps as well.

    Bursts break down in 10, a staircase in 5, too.
    """
    monkeypatch.setattr(chain_runs, "_PER_SWING", 1)
    bench = load_rig("muscle_bench")
    trials = recorded(tmp_path / "data", rig=bench, protocols=(protocol,), forces=True)
    chain = ChainSimulator(bench, repeats(trials))
    assert {link.name for link, *_ in link_residuals(bench, trials, steps=COARSE)} == {
        "valves and air",
        "muscle",
    }
    assert "joint and transmission" in links_of(chain)
    for link in range(len(chain.links)):
        units = {
            block.unit for block, of in zip(chain.blocks, chain.link_of, strict=True) if of == link
        }
        assert units == {trial.name for trial in trials}
    for steps in (COARSE, 2):
        np.testing.assert_allclose(run(chain, {}, steps=steps), chain.stated, rtol=0, atol=1e-9)


def test_a_rig_that_swings_fast_comes_to_rest_in_time_steps_in_which_it_swings(trials, monkeypatch):
    """The arm swings in half a second; with a hundredth of its inertia, in a tenth of that."""
    rested: list[RestSteps] = []
    real = chain_runs.sensed_signals

    def signals(jobs, *, rest_steps, **options):
        rested.append(rest_steps)
        return real(jobs, rest_steps=rest_steps, **options)

    monkeypatch.setattr(chain_runs, "sensed_signals", signals)
    runs = [(trials[0], run) for run in link_runs(ARM, trials[0])]
    light = load_rig("mas20_arm")
    light.model.body_mass[:] *= 0.01
    light.model.body_inertia[:] *= 0.01
    mujoco.mj_setConst(light.model, mujoco.MjData(light.model))
    found = []
    for rig in (ARM, light):
        rested.clear()
        chain = ChainRuns(rig, runs, threads=None)
        chain.simulate([{}], [{r.link for _, r in runs}], None, COARSE)
        (steps,) = set(rested)
        found.append(steps)
    usual, fast = found
    assert usual.later == fast.later == pytest.approx(0.01)
    assert usual.swinging >= usual.later  # none that damps its swings
    assert fast.swinging == pytest.approx(1e-3)
    assert 0.3 < fast.swings < 1.0


def test_a_rig_that_breaks_down_everywhere_is_not_mistaken_for_one_without_measurements(
    trials, monkeypatch
):
    monkeypatch.setattr(
        "pamsim.comparison.chain_runs.sensed_signals", lambda jobs, **_: [None for _ in jobs]
    )
    with refused("mas20_arm: the simulation of every link breaks down; check"):
        ChainSimulator(ARM, repeats(trials[:1]))
    with refused("nothing is measured besides inputs"):
        ChainSimulator(ARM, repeats([replace(trials[0], measured={})]))


def test_links_of_an_input_that_break_down_in_one_repeat_are_left_out_with_a_note(
    chain, trials, monkeypatch
):
    simulate, last = chain_runs.sensed_signals, trials[-1].name

    def broken(jobs, **settings):
        found = zip(jobs, simulate(jobs, **settings), strict=True)
        return [None if trial.name == last else signals for (_, trial, _), signals in found]

    assert chain.not_compared == ()
    monkeypatch.setattr(chain_runs, "sensed_signals", broken)
    own = ChainSimulator(ARM, repeats(trials))
    *_, group = repeats(trials)
    assert last in [trial.name for trial in group.trials]
    left = {trial.name for trial in trials} - {trial.name for trial in group.trials}
    assert {block.unit for block in own.blocks} == left
    assert own.not_compared == tuple(
        f"{link.name} of {group.name} and its repeats: a simulation breaks down"
        for link in chain.links
    )


def test_a_rig_without_a_gap_leaves_noise_and_coarse_steps_change_an_effect_by_little(chain):
    # Single trials of a second scatter by a quarter beside the noise that two repeats show.
    assert np.mean(losses_of(chain)) == pytest.approx(1.0, abs=0.2)
    values = {"hysteresis.force_per_pressure": 1.5e-4}
    coarse, fine = run(chain, values), run(chain, values, steps=1)
    moved = fine - chain.stated
    assert np.linalg.norm(coarse - fine) < 0.05 * np.linalg.norm(moved)


def test_measured_forces_act_at_the_radius_that_is_simulated(tmp_path):
    """Muscles that pull less than the model's are made up for at the radius of each set."""
    weak, value = ARM.with_parameters({"force.scale": 0.8}), {"tendon.chain_1.coef": 0.0115}
    trial, *_ = recorded(tmp_path / "data", rig=weak, repeats=1, forces=True)

    def runs_of(rig):
        runs = [(trial, run) for run in link_runs(rig, trial)]
        return ChainRuns(rig, runs, threads=None), [run for _, run in runs]

    chain, runs = runs_of(ARM)
    ((found,), other) = (
        chain.simulate([value], [{run.link for run in runs}], None, 1),
        {run: signals for _, run, signals in runs_of(ARM.with_parameters(value))[0].as_it_is()},
    )
    assert runs[-1].pulled == "shaft"
    expected = other[runs[-1]]["angle"]
    np.testing.assert_allclose(found[len(runs) - 1][0]["angle"], expected, atol=1e-3)  # of 0.24 rad


def test_values_change_the_links_that_they_act_in_and_no_others(chain):
    joint = links_of(chain)["muscle and joint"]
    in_joint = in_link("force.scale", joint)
    assert plain(in_joint) == "force.scale"
    assert chain.acts_in([in_joint]) == {joint}
    for values in (
        {in_joint: 1.1},
        {"valve.delay": 0.02},
        {"chamber.dead_volume": 3e-5},
        {"passive.stiffness": 4e3},
        {"creep.stiffness": 2e3, "creep.relaxation_time": 1.0},
        {"joint.shaft.frictionloss": 0.3},
        {"force.scale": 1.1},
        {"chain.backlash": 5e-4},
        {"sensor.angle_scale": 1.05},
    ):
        moved = np.abs(run(chain, values) - chain.stated)
        acts = chain.acts_in(values)
        for link in chain.links:
            largest = moved[rows_of(chain, link)].max()
            assert (largest > 1e-6) == (link in acts), (values, link.name, largest)


def test_trials_and_links_that_are_not_asked_for_keep_their_residual(chain):
    air = links_of(chain)["valves and air"]
    found = run(chain, {"valve.delay": 0.02}, only=[])
    np.testing.assert_array_equal(found, chain.stated)
    found = run(chain, {"force.scale": 1.2}, [air])
    other = ~rows_of(chain, air)
    np.testing.assert_array_equal(found[other], chain.stated[other])
    assert run(chain, {"valve.delay": -1.0}) is None  # out of its range


def test_forces_separate_the_joint(tmp_path):
    trials = recorded(tmp_path / "data", forces=True)
    chain = ChainSimulator(ARM, repeats(trials))
    assert [link.name for link in chain.links] == [
        "valves and air",
        "muscle",
        "muscle and joint",
        "joint and transmission",
    ]
    of = np.repeat(chain.link_of, [block.size for block in chain.blocks])
    moved = np.abs(run(chain, {"passive.stiffness": 4e3}) - chain.stated)
    size = [float(np.abs(chain.stated[of == i]).std()) for i in range(4)]
    assert moved[of == 1].max() > 5.0 * size[1]
    assert moved[of == 2].max() > 5.0 * size[2]
    # Given the measured forces, the joint hardly depends on what the muscles would exert.
    assert moved[of == 3].max() < 5.0 * size[3]


@pytest.mark.parametrize("effect", ["viscoelastic_creep:two_branch", "softening", "first_stroke"])
def test_what_changes_with_time_leaves_the_memory_of_hysteresis_at_rest(tmp_path, effect):
    """Along an imposed motion, and in the joint that is given what forces lie beyond those there.

    Begun without the way to rest, first forces were off by 4 to 15 N.
    """
    quiet = {"forces": True, "noise": 0.1, "variation": 0.0, "repeats": 1}
    given = recorded(tmp_path / "data", {effect: 1.0}, protocols=("staircase",), **quiet)
    there = ARM.with_parameters(at_size(ARM, rig_effect(ARM, effect), 1.0))
    most = {"muscle": 0.2, "joint and transmission": np.radians(0.02)}
    for (link, _, channel), residual in link_residuals(there, given).items():
        if link.name in most:
            assert abs(np.mean(residual[:30])) < most[link.name], channel


def test_the_noise_of_inputs_recorded_once_is_that_of_their_samples_inputs_included(trials):
    once = ChainSimulator(ARM, repeats(trials[:1]))
    assert {one.source for one in once.noise.values()} == {FloorRoute.WITHIN_TRIALS}
    losses = losses_of(once)
    assert np.all(np.abs(losses - 1.0) < 0.25)
    # Noise of the imposed pressures moves the angle, by more than its sensor's own noise.
    (angle,) = (one.noise for (_, channel), one in once.noise.items() if channel == "angle")
    assert angle.standard_deviation > 1.1 * rough_noise(trials[0].measured["angle"])
