"""A trial repeats in the engine what was recorded: commands, start, and the times to compare at."""

import dataclasses
import shutil

import numpy as np
import pytest

import pamsim
from pamsim.comparison.experiments import (
    at_times,
    experiment_of,
    grid_rate,
    on_steps,
    sensed_signals,
)
from pamsim.comparison.link_inputs import link_inputs
from pamsim.comparison.measurements import CalibrationData, read_calibration_data
from pamsim.comparison.rest_simulator import RestPredictor
from pamsim.comparison.trial_prediction import Prediction, TrialPredictor
from pamsim.core.errors import InputError, SimulationError
from pamsim.inference.noise_model import NoiseModel
from pamsim.inference.simulator_fit import NoiseSource, layout, stacked
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome, write_recording
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.static_table import StaticTable
from tests.unit.recordings.made_trial import made_trial

JITTERING = np.arange(100) / 100.0
JITTERING[1:-1] += np.random.default_rng(0).uniform(-2e-3, 2e-3, 98)


def trial(**changes):
    time = np.arange(100) / 100.0
    given = {
        "command": np.column_stack([np.where(time < 0.5, 0.0, 1.0), np.zeros(100)]),
        "measured": {"pressure_1": np.full(100, 2e5), "pressure_2": np.full(100, -50.0)},
        "time": time,
    }
    return made_trial(**{"drive": "valve", "load": 0.5, **given, **changes})


def test_commands_are_held_from_rest_at_the_first_measured_pressures():
    found = experiment_of(trial())
    assert found.command_time.tolist() == [0.0, 0.5]
    assert found.command_value.tolist() == [[0.0, 0.0], [1.0, 0.0]]
    assert found.start_pressure == pytest.approx([2e5, 0.0])
    assert (found.load, found.sample_rate, found.drive) == (0.5, 100.0, "valve")
    assert found.duration == pytest.approx(0.99)


def test_without_measured_pressures_the_first_set_points_are_the_start():
    set_points = np.column_stack([np.linspace(1e5, 2e5, 100), np.full(100, 3e5)])
    found = experiment_of(trial(drive="pressure_set", command=set_points, measured={}))
    assert found.start_pressure.tolist() == [1e5, 3e5]
    with pytest.raises(InputError, match="start pressure of muscle 2: record p2_kpa"):
        experiment_of(trial(measured={"pressure_1": np.full(100, 2e5)}))


def test_the_rate_is_the_trials_own_where_the_engine_has_it():
    for rate, expected in ((100.0, 100.0), (2000.0, 2000.0), (10.0, 10.0), (300.0, 2000.0)):
        assert grid_rate(np.arange(50) / rate) == pytest.approx(expected)
        assert grid_rate(np.round(np.arange(50) / rate, 6)) == pytest.approx(expected)
    assert grid_rate(JITTERING) == 2000.0  # simulated at every step


def test_a_command_whose_time_was_rounded_is_not_a_sample_late():
    time = np.arange(100) / 100.0
    shifted = (time + 1234.5) - 1234.5 + 3e-6  # what rounding leaves, to the late side
    shifted[0] = 0.0
    found = experiment_of(trial(time=shifted))
    assert found.command_time[1] == pytest.approx(0.5, abs=1e-12)
    assert found.command_at(time)[:, 0].tolist() == np.where(time < 0.5, 0.0, 1.0).tolist()


def test_a_clock_that_jitters_is_simulated_in_the_steps_that_a_rig_has(rig):
    one = trial(time=JITTERING)
    job = (rig, one, experiment_of(one))
    own, longer = (sensed_signals([job], timestep=step)[0] for step in (None, 3e-3))
    moved = np.ptp(own["angle"])
    assert moved > 0.1
    assert np.abs(longer["angle"] - own["angle"]).max() < 0.05 * moved
    at = on_steps(experiment_of(trial()), 3e-3)  # 3 steps in each of 10 ms, and up to the end
    assert at.sample_rate == pytest.approx(1.0 / 9e-3)
    assert at.duration * at.sample_rate == pytest.approx(110.0)
    assert on_steps(job[2], 5e-4) is job[2]


LEVELS = {
    "pressure_set": [[3e5, 3e5], [4e5, 2e5], [2e5, 4e5]],
    "valve": [[0.0, 0.0], [1.0, -1.0], [-1.0, 1.0]],
}


def steps(kind, sample_rate):
    return Experiment(
        drive=kind,
        command_time=np.array([0.0, 0.2, 0.6]),
        command_value=np.array(LEVELS[kind]),
        start_pressure=np.array([3e5, 3e5]),
        duration=1.0,
        sample_rate=sample_rate,
        load=1.2,
    )


@pytest.mark.parametrize("kind", ["pressure_set", "valve"])
def test_simulate_write_read_simulate_gives_the_same_signals(rig, tmp_path, kind):
    before = pamsim.simulate(rig, steps(kind, sample_rate=200.0))
    write_recording(tmp_path, "mas20_arm", {"steps_1": before})
    read = read_recordings(tmp_path).trials[0]
    again = at_times(pamsim.simulate(rig, experiment_of(read)), read)
    assert set(again) == set(read.measured)
    for channel, values in read.measured.items():
        scale = np.max(np.abs(values))
        np.testing.assert_allclose(again[channel], values, rtol=0, atol=1e-6 * scale)


def test_an_encoder_whose_sign_a_log_turned_reads_high_and_its_comparison_misses_nothing(
    rig, tmp_path
):
    """It counts up to the angle then; taken as counting down the mean would be an increment off."""
    run = pamsim.simulate(rig, steps("pressure_set", sample_rate=1000.0))
    step = 2.0 * np.pi / rig.sensor.encoder_increments
    mounted_turned = np.floor(-run.angle / step) * step
    own = {"t": run.time, "p_1": run.pressure[:, 0], "p_2": run.pressure[:, 1]}
    log = np.column_stack([*own.values(), mounted_turned])
    names = ",".join([*own, "beta"])
    np.savetxt(tmp_path / "log.csv", log, fmt="%.9g", delimiter=",", header=names, comments="")
    columns = ["shaft.angle=-beta:rad", "muscle_1.pressure=p_1:Pa", "muscle_2.pressure=p_2:Pa"]
    data = tmp_path / "data"
    pamsim.import_log(tmp_path / "log.csv", rig=rig, out=data, columns=columns, load=1.2)
    (read,) = read_calibration_data([data]).of_rig(rig).trials
    assert read.turned == {"angle"}
    seen = at_times(run, read, rig.sensor)["angle"] - read.measured["angle"]
    assert abs(seen.mean()) < 0.05 * step
    imposed = link_inputs(rig, read).positions["shaft"]
    assert abs(np.mean(imposed - run.angle)) < 0.1 * step
    unmarked = dataclasses.replace(read, turned=frozenset())
    off = at_times(run, unmarked, rig.sensor)["angle"] - read.measured["angle"]
    assert off.mean() == pytest.approx(-step, rel=0.05)


def test_signals_are_interpolated_to_the_trials_own_times(rig):
    time = np.array([0.0, 0.0123, 0.1011, 0.25])
    read = trial(time=time, command=np.tile([1.0, 0.0], (4, 1)))
    run = pamsim.simulate(rig, experiment_of(read))
    found = at_times(run, read)
    assert run.time[-1] >= time[-1]
    rising = found["pressure_1"]
    assert np.all(np.diff(rising) > 0.0)
    low = run.pressure[np.searchsorted(run.time, time[1:3]) - 1, 0]
    assert np.all(rising[1:3] >= low)
    assert np.all(rising[1:3] <= run.pressure[np.searchsorted(run.time, time[1:3]), 0])
    broken = dataclasses.replace(run, outcome=Outcome.NOT_FINITE, message="broke down")
    with pytest.raises(SimulationError, match="broke down"):
        at_times(broken, read)


def of_trials(*trials, tables=()):
    return CalibrationData(sources=(), rig=None, trials=trials, tables=tables)


def test_rows_at_rest_are_simulated_at_the_true_pressures_that_were_read(rig):
    scale, bias = 1.1, 2e4
    wrong = rig.with_parameters({"sensor.pressure_scale": scale, "sensor.pressure_bias": bias})
    true, start = np.array([[3e5, 1e5], [2e5, 3e5]]), np.full((2, 2), 3e5)

    def table(pressure, start):
        return StaticTable(
            name="rest",
            rows=("a", "b"),
            pressure=pressure,
            load=np.zeros(2),
            angle=np.zeros(2),
            start=start,
        )

    bench, one = pamsim.load_rig("muscle_bench"), of_trials(tables=(table(true[:, :1], None),))
    with pytest.raises(InputError, match="one joint that turns, rig 'muscle_bench' has rod"):
        TrialPredictor(bench, one)
    read = table(scale * true + bias, scale * start + bias)
    (right,) = TrialPredictor(rig, of_trials(tables=(table(true, start),))).predictions([rig])
    (found,) = TrialPredictor(wrong, of_trials(tables=(read,))).predictions([wrong])
    np.testing.assert_allclose(found.tables["rest"], right.tables["rest"], atol=1e-6)
    rows = RestPredictor(lambda _: wrong, read)
    np.testing.assert_allclose(rows.simulated(wrong), right.tables["rest"], atol=1e-6)
    rows.anchor({})
    (anchored,) = rows.predict([{}])
    np.testing.assert_allclose(anchored, right.tables["rest"], atol=1e-6)


def test_trials_with_another_load_do_not_show_the_noise(rig):
    read = {channel: np.full(100, 2e5) for channel in ("pressure_1", "pressure_2")}
    bare, again = (trial(name=name, measured=read) for name in ("bare", "again"))
    loaded = dataclasses.replace(again, load=1.2)
    for other, source in ((again, NoiseSource.REPEATS), (loaded, NoiseSource.RESIDUAL)):
        both = {one.name: read for one in (bare, other)}
        blocks = TrialPredictor(rig, of_trials(bare, other)).blocks(
            Prediction(trials=both, tables={})
        )
        places = layout(blocks)
        assert NoiseModel(places, stacked(blocks, places)).source("pressure_1") is source


def test_recordings_beside_each_other_are_of_one_rig_by_whatever_path(rig, tmp_path):
    for name in ("mine", "copy"):
        shutil.copytree(rig.file.folder, tmp_path / name)
    run = pamsim.simulate(rig, pamsim.pressure_step((3e5, 3e5), (3e5, 2e5), duration=0.1))
    for folder, own in (("one", "mine"), ("two", "mine"), ("three", "copy")):
        write_recording(tmp_path / folder, str(tmp_path / own), {"step_1": run})
    found = read_calibration_data([tmp_path / "one", tmp_path / "two"])
    assert found.rig == str(tmp_path / "one" / ".." / "mine")
    with pytest.raises(InputError, match="of different rigs"):
        read_calibration_data([tmp_path / "one", tmp_path / "three"])
    for folder in ("four", "five"):
        write_recording(tmp_path / folder, str(tmp_path / "mine"), {"step_1": run}, forces=False)
    missing = tuple(f"force_{i} was not measured in any trial" for i in (1, 2))
    both = read_calibration_data([tmp_path / "four", tmp_path / "five"])
    assert both.notes == missing
    one = read_calibration_data([tmp_path / "one", tmp_path / "five"])
    assert one.notes == tuple(f"five/{note}" for note in missing)
