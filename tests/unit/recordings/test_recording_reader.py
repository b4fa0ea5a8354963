"""Recordings: what was written is read, and each mistake in a user's file is one clear line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.recordings.recording import write_recording
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.signals import SignalNames
from pamsim.recordings.stated_noise import StatedNoise
from tests.unit.core.refusals import cases, refused
from tests.unit.recordings.drawn_recording import drawn_recording

INDEX = """\
schema = "pamsim-recording/1"
rig = "mas20_arm"

[[trial]]
file = "staircase_1.csv"
protocol = "staircase"
drive = "pressure_set"
load_kg = 1.2
"""


def pressure_table(rows=20):
    """A held step: set points far apart, pressures and angle that follow."""
    k = np.arange(rows)
    settled = 1.0 - np.exp(-k / 3.0)
    return {
        "time_s": 0.002 * k,
        "p1_set_kpa": np.full(rows, 400.0),
        "p2_set_kpa": np.full(rows, 100.0),
        "p1_kpa": 300.0 + 100.0 * settled,
        "p2_kpa": 300.0 - 200.0 * settled,
        "angle_deg": 20.0 * settled,
    }


def valve_table(rows=20):
    table = pressure_table(rows)
    commands = {"u1": np.full(rows, 0.5), "u2": np.full(rows, -0.5)}
    return {name: v for name, v in {**table, **commands}.items() if "_set_" not in name}


def text_of(table):
    rows = zip(*table.values(), strict=True)
    return "\n".join([",".join(table), *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n"


@pytest.fixture
def folder(tmp_path):
    def write(table, index=INDEX):
        (tmp_path / "recording.toml").write_text(index, encoding="utf-8")
        text = table if isinstance(table, str) else text_of(table)
        (tmp_path / "staircase_1.csv").write_text(text, encoding="utf-8")
        return tmp_path

    return write


def recording(kind, muscles, seed):
    names = SignalNames(joints={"shaft": "angle"}, muscles=("m0", "m1", "m2")[:muscles])
    return drawn_recording(names, kind, seed)


@pytest.mark.parametrize(("kind", "muscles"), [("pressure_set", 2), ("valve", 2), ("pulse", 3)])
def test_what_was_written_is_read_to_the_printed_digits(tmp_path, kind, muscles):
    runs = {"hold_300_1": recording(kind, muscles, 1), "hold_300_2": recording(kind, muscles, 2)}
    write_recording(tmp_path, 'a "rig"', runs)
    for path in (tmp_path, tmp_path / "recording.toml"):
        found = read_recordings(path)
        assert found.rig == 'a "rig"'
        assert found.notes == ()
        assert [trial.name for trial in found.trials] == list(runs)
        for trial, run in zip(found.trials, runs.values(), strict=True):
            assert (trial.protocol, trial.drive) == ("hold_300", kind)
            assert trial.load == pytest.approx(run.load, rel=1e-8)
            assert trial.muscles == muscles
            np.testing.assert_allclose(trial.time, run.time, rtol=1e-8)
            np.testing.assert_allclose(trial.command, run.command, rtol=1e-8)
            for channel, values in run.signals().items():
                np.testing.assert_allclose(trial.measured[channel], values, rtol=1e-8)


def test_a_protocol_may_be_named_and_a_rig_folder_is_found_from_elsewhere(tmp_path, monkeypatch):
    rig = tmp_path / "rigs" / "mine"
    rig.mkdir(parents=True)
    (rig / "params.toml").write_text("")
    monkeypatch.chdir(tmp_path)
    runs = {"step_300": recording("valve", 2, 1)}
    write_recording(tmp_path / "out" / "data", "rigs/mine", runs, {"step_300": "step_300"})
    monkeypatch.chdir(tmp_path / "out")
    found = read_recordings(tmp_path / "out" / "data")
    assert found.trials[0].protocol == "step_300"
    assert Path(found.rig, "params.toml").is_file()


def test_time_is_counted_from_the_first_row_and_noise_below_zero_is_no_error(folder):
    table = valve_table()
    table["time_s"] = table["time_s"] + 12.5
    table["p2_kpa"] = table["p2_kpa"] - 103.0
    del table["p1_kpa"]  # the pressure of one muscle alone
    trial = read_recordings(folder(table, INDEX.replace('"pressure_set"', '"valve"'))).trials[0]
    assert trial.time[[0, -1]] == pytest.approx([0.0, 0.038])
    assert trial.measured["pressure_2"].min() < 0.0
    assert "pressure_1" not in trial.measured
    assert trial.sample_interval == pytest.approx(0.002)


def test_what_is_missing_odd_or_unused_is_said(folder):
    table = pressure_table()
    del table["p2_kpa"]
    table["room_c"] = table["time_s"]
    table["u1"] = table["time_s"]
    table["time_s"] = table["time_s"] + np.where(np.arange(20) % 2, 0.0003, 0.0)
    notes = "\n".join(read_recordings(folder(table)).notes)
    for note in (
        "pressure_2 was not measured in any trial",
        "force_1 was not measured",
        "'room_c' is not used",
        "'u1' is not used",
        "not uniform: 0.0017 to 0.0023 s",
    ):
        assert note in notes
    assert "pressure_1" not in notes


def changed(**columns):
    """A pressure table with columns replaced (None removes one)."""
    table = pressure_table() | columns
    return {name: values for name, values in table.items() if values is not None}


P = pressure_table()
BAD_TABLES = {
    "no command": (changed(p2_set_kpa=None), "no command column 'p2_set_kpa'"),
    "no time": (changed(time_s=None), "no column 'time_s'"),
    "short": (pressure_table(7), "7 rows are too few"),
    "time stands": (
        changed(time_s=np.minimum(P["time_s"], 0.02)),
        "line 13: time_s = 0.02 does not come after 0.02 in line 12",
    ),
    "gap": (
        changed(time_s=P["time_s"] + np.where(np.arange(20) > 9, 0.01, 0.0)),
        "line 12: the clock jumps from 0.018 to 0.03 s, 6 times its usual step; split the trial",
    ),
    "milliseconds": (changed(time_s=np.arange(20) * 100.0), "divide it by 1000"),
    "word": (text_of(P).replace("\n0.004,400", "\n0.004,x"), "line 4: p1_set_kpa = 'x' is not a"),
    "bar by name": (text_of(P).replace("p1_kpa", "p1_bar"), "name it 'p1_kpa'"),
    "measured in bar": (changed(p1_kpa=P["p1_kpa"] / 100), "p1_kpa looks like bar; multiply it"),
    "measured in psi": (
        changed(p1_set_kpa=np.full(20, 393.0), p1_kpa=np.full(20, 57.0)),
        "looks like psi",
    ),
    "measured in Pa": (changed(p2_kpa=P["p2_kpa"] * 1e3), "p2_kpa looks like Pa"),
    "set point in bar": (changed(p1_set_kpa=np.full(20, 4.0)), "p1_set_kpa looks like bar"),
    "all in bar": (
        changed(**{name: P[name] / 100 for name in P if name.endswith("kpa")}),
        "if the columns hold bar, multiply them by 100",
    ),
    "all in Pa": (
        changed(**{name: P[name] * 1e3 for name in P if name.endswith("kpa")}),
        "if the column holds mbar, divide it by 10, if Pa by 1000",
    ),
    "absolute vacuum": (changed(p2_kpa=P["p2_kpa"] - 150.0), "far below the atmosphere"),
    "negative set point": (changed(p2_set_kpa=P["p2_set_kpa"] - 101.0), "is negative"),
    "rad": (changed(angle_deg=P["angle_deg"] / 57.3), "if the columns hold rad"),
    "force": (changed(force1_n=np.full(20, -3e12)), "force1_n = -3e+12 is more than any muscle"),
    "encoder counts": (changed(angle_deg=P["angle_deg"] * 100), "more than a turn"),
}


@pytest.mark.parametrize(("table", "expected"), cases(BAD_TABLES))
def test_a_bad_table_is_one_clear_line(folder, table, expected):
    with refused("staircase_1.csv", expected):
        read_recordings(folder(table))


@pytest.mark.parametrize(
    ("value", "expected"),
    [(1.01, "u2 = 1.01 is outside [-1, 1]"), (-50.0, "if it is percent, divide")],
)
def test_a_valve_beyond_fully_open_is_refused(folder, value, expected):
    table = valve_table()
    table["u2"][5] = value
    with refused("line 7", expected):
        read_recordings(folder(table, INDEX.replace('"pressure_set"', '"valve"')))


def test_noise_that_a_lab_states_is_read_in_si(folder):
    table = '[noise]\nangle = { rms = "0.1 deg", filter = "3 Hz" }\n[[trial]]'
    (trial,) = read_recordings(folder(pressure_table(), INDEX.replace("[[trial]]", table))).trials
    assert trial.noise == {"angle": StatedNoise(rms=np.deg2rad(0.1), cutoff=3.0)}


BAD_INDEXES = {
    "schema": ('"pamsim-recording/1"', '"pamsim-recording/9"', "schema is 'pamsim-recording/9'"),
    "key": ("load_kg", "load_g", "unknown key load_g; did you mean 'load_kg'"),
    "top key": ("rig =", "rigg =", "unknown key rigg; did you mean 'rig'"),
    "no trial": (INDEX[INDEX.index("[[") :], "", "no trial; write [[trial]]"),
    "drive": ('drive = "pressure_set"', 'drive = "presure_set"', "did you mean 'pressure_set'"),
    "negative load": ("load_kg = 1.2", "load_kg = -1", "write load_kg = the mass"),
    "load in gram": ("load_kg = 1.2", "load_kg = 1200", "write kg, not g"),
    "no file": ("staircase_1.csv", "staircase_9.csv", "cannot read"),
    "file twice": ("[[", '[[trial]]\nfile = "staircase_1.csv"\nprotocol = "a"\n'
                   'drive = "pressure_set"\nload_kg = 0\n[[', "give each its segments"),
    "noise of what": ("[[", '[noise]\nknee = { rms = "1 deg" }\n[[', "knee was not measured"),
    "noise in kg": ("[[", '[noise]\nangle = { rms = "1 kg" }\n[[', "[noise]: angle: rms"),
    "noise below 0": ("[[", '[noise]\nangle = { rms = "-1 deg" }\n[[', "must be 0 or more"),
    "noise as text": ("[[", 'noise = "little"\n[[', "write a table"),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "expected"), cases(BAD_INDEXES))
def test_a_bad_index_is_one_clear_line(folder, old, new, expected):
    assert old in INDEX
    with refused(expected):
        read_recordings(folder(pressure_table(), INDEX.replace(old, new, 1)))


def test_no_file_and_trials_of_different_rigs_are_no_recording(tmp_path):
    runs = {"a_1": recording("valve", 2, 1), "a_2": recording("valve", 3, 2)}
    with pytest.raises(InputError, match="no recording at"):
        read_recordings(tmp_path)
    write_recording(tmp_path, "mas20_arm", runs)
    with pytest.raises(InputError, match=r"a_2.csv: commands 3 muscles, a_1.csv 2"):
        read_recordings(tmp_path)


@pytest.mark.parametrize("seed", range(3))
def test_honest_but_unusual_trials_are_read(folder, seed):
    draw = np.random.default_rng(seed)
    noise = draw.normal(0.0, 0.4, 20)
    dead_supply = changed(p1_kpa=noise, p2_kpa=0.5 * noise)
    # As much as 400 kPa in bar, but only on average.
    dead_with_zero_error = changed(p1_kpa=4.0 + 15.0 * noise, p2_kpa=noise)
    held_arm = changed(angle_deg=P["angle_deg"] / 100.0, force1_n=P["p1_kpa"])
    small_step = changed(
        p1_set_kpa=np.full(20, 305.0),
        p1_kpa=300.0 + 0.05 * (P["p1_kpa"] - 300.0),
        p2_set_kpa=np.full(20, 300.0),
        p2_kpa=np.full(20, 300.0),
        angle_deg=P["angle_deg"] * 0.03,
    )
    vented = changed(p1_set_kpa=np.zeros(20), p2_set_kpa=np.zeros(20), p1_kpa=noise, p2_kpa=noise)
    for table in (dead_supply, dead_with_zero_error, held_arm, small_step, vented):
        assert len(read_recordings(folder(table)).trials) == 1


def test_a_rig_that_no_folder_can_be_called_is_left_to_load_rig(folder):
    name = "a" * 5000
    read = read_recordings(folder(pressure_table(), INDEX.replace("mas20_arm", name, 1)))
    assert read.rig == name
