"""Recordings: what was written is read, and each mistake in a user's file is one clear line."""

from pathlib import Path

import numpy as np
import pytest

from pamsim.recordings.recording import write_recording
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.signals import SignalNames
from pamsim.recordings.stated_noise import StatedNoise
from tests.unit.core.refusals import all_refused, refused
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
VALVE = INDEX.replace('"pressure_set"', '"valve"')

K = np.arange(20)
SETTLED = 1.0 - np.exp(-K / 3.0)
P = {  # a held step: set points far apart, pressures and angle that follow
    "time_s": 0.002 * K,
    "p1_set_kpa": np.full(20, 400.0),
    "p2_set_kpa": np.full(20, 100.0),
    "p1_kpa": 300.0 + 100.0 * SETTLED,
    "p2_kpa": 300.0 - 200.0 * SETTLED,
    "angle_deg": 20.0 * SETTLED,
}
OPEN = {"p1_set_kpa": None, "p2_set_kpa": None, "u1": np.full(20, 0.5), "u2": np.full(20, -0.5)}


def changed(**columns):
    """The held step with columns replaced; None removes one."""
    return {name: values for name, values in (P | columns).items() if values is not None}


def text_of(table):
    rows = zip(*table.values(), strict=True)
    return "\n".join([",".join(table), *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n"


@pytest.fixture
def read(tmp_path):
    def read_written(table, index=INDEX):
        (tmp_path / "recording.toml").write_text(index, encoding="utf-8")
        text = table if isinstance(table, str) else text_of(table)
        (tmp_path / "staircase_1.csv").write_text(text, encoding="utf-8")
        return read_recordings(tmp_path)

    return read_written


def recording(kind, muscles, seed):
    names = SignalNames(joints={"shaft": "angle"}, muscles=("m0", "m1", "m2")[:muscles])
    return drawn_recording(names, kind, seed)


@pytest.mark.parametrize(("kind", "muscles"), [("pressure_set", 2), ("valve", 2), ("pulse", 3)])
def test_what_was_written_is_read_to_the_printed_digits(tmp_path, kind, muscles):
    runs = {"hold_300_1": recording(kind, muscles, 1), "hold_300_2": recording(kind, muscles, 2)}
    write_recording(tmp_path, 'a "rig"', runs)
    for path in (tmp_path, tmp_path / "recording.toml"):
        found = read_recordings(path)
        assert (found.rig, found.notes) == ('a "rig"', ())
        assert [trial.name for trial in found.trials] == list(runs)
        for trial, run in zip(found.trials, runs.values(), strict=True):
            assert (trial.protocol, trial.drive, trial.muscles) == ("hold_300", kind, muscles)
            assert trial.load == pytest.approx(run.load, rel=1e-8)
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


def test_time_is_counted_from_the_first_row_and_noise_below_zero_is_no_error(read):
    late = {"time_s": P["time_s"] + 12.5, "p2_kpa": P["p2_kpa"] - 103.0, "p1_kpa": None}
    trial = read(changed(**OPEN, **late), VALVE).trials[0]
    assert trial.time[[0, -1]] == pytest.approx([0.0, 0.038])
    assert trial.measured["pressure_2"].min() < 0.0
    assert "pressure_1" not in trial.measured  # the pressure of one muscle alone
    assert trial.sample_interval == pytest.approx(0.002)
    noise = '[noise]\nangle = { rms = "0.1 deg", filter = "3 Hz" }\n[[trial]]'
    (trial,) = read(P, INDEX.replace("[[trial]]", noise)).trials
    assert trial.noise == {"angle": StatedNoise(rms=np.deg2rad(0.1), cutoff=3.0)}


def test_what_is_missing_odd_or_unused_is_said(read, tmp_path):
    uneven = P["time_s"] + np.where(K % 2, 0.0003, 0.0)
    table = changed(p2_kpa=None, room_c=P["time_s"], u1=P["time_s"], time_s=uneven)
    notes = "\n".join(read(table).notes)
    for note in (
        "pressure_2 was not measured in any trial",
        "force_1 was not measured",
        "every file: not used: 'room_c', 'u1'",
        "not uniform: 0.0017 to 0.0023 s; `rate` in [[trial]] makes an even one",
    ):
        assert note in notes
    assert "pressure_1" not in notes
    (tmp_path / "staircase_2.csv").write_text(text_of(table), encoding="utf-8")
    two = INDEX + INDEX[INDEX.index("[[trial]]") :].replace("_1", "_2")
    (note,) = [n for n in read(table, two).notes if "not uniform" in n]
    assert note.startswith("staircase_1 and 1 more: ")
    even = INDEX.replace("[[trial]]", '[[trial]]\nrate = "400 Hz"')
    assert "not uniform" not in "\n".join(read(table, even).notes)


def test_a_copy_of_a_trial_is_said_to_be_no_repeat(tmp_path):
    """Repeats that agree to the last digit would prove that there is no noise."""
    run, other = recording("valve", 2, 1), recording("valve", 2, 2)
    for runs, copies in (({"a_1": run, "a_2": other}, 0), ({"a_1": run, "a_2": run}, 1)):
        write_recording(tmp_path / str(copies), "mas20_arm", runs)
        notes = read_recordings(tmp_path / str(copies)).notes
        assert sum("a_2 is a copy of a_1" in note for note in notes) == copies


def pressures(factor):
    return {name: P[name] * factor for name in P if name.endswith("kpa")}


GAP = P["time_s"] + np.where(K > 9, 0.01, 0.0)
JUMP = "line 12: the clock jumps from 0.018 to 0.03 s, 6 times its usual step; split the trial"
STANDS = "line 13: time_s = 0.02 does not come after 0.02 in line 12"
BAD_TABLES = {
    "no command": (changed(p2_set_kpa=None), "no command column 'p2_set_kpa'"),
    "no time": (changed(time_s=None), "no column 'time_s'"),
    "short": ({name: values[:7] for name, values in P.items()}, "7 rows are too few"),
    "time stands": (changed(time_s=np.minimum(P["time_s"], 0.02)), STANDS),
    "gap": (changed(time_s=GAP), JUMP),
    "milliseconds": (changed(time_s=K * 100.0), "divide it by 1000"),
    "word": (text_of(P).replace("\n0.004,400", "\n0.004,x"), "line 4: p1_set_kpa = 'x' is not a"),
    "bar by name": (text_of(P).replace("p1_kpa", "p1_bar"), "name it 'p1_kpa'"),
    "measured in bar": (changed(p1_kpa=P["p1_kpa"] / 100), "p1_kpa looks like bar; multiply it"),
    "in psi": (changed(p1_set_kpa=K * 0 + 393.0, p1_kpa=K * 0 + 57.0), "looks like psi"),
    "measured in Pa": (changed(p2_kpa=P["p2_kpa"] * 1e3), "p2_kpa looks like Pa"),
    "set point in bar": (changed(p1_set_kpa=np.full(20, 4.0)), "p1_set_kpa looks like bar"),
    "all in bar": (changed(**pressures(0.01)), "if the columns hold bar, multiply them by 100"),
    "all in Pa": (changed(**pressures(1e3)), "holds mbar, divide it by 10, if Pa by 1000"),
    "absolute": (
        changed(p2_set_kpa=100.0 + 10.0 * K, p2_kpa=201.3 + 10.0 * K + 3.0 * (-1.0) ** K),
        "p2_kpa is 101 kPa above p2_set_kpa, as an absolute pressure is; pressures are gauge",
    ),
    "absolute vacuum": (changed(p2_kpa=P["p2_kpa"] - 150.0), "far below the atmosphere"),
    "negative set point": (changed(p2_set_kpa=P["p2_set_kpa"] - 101.0), "is negative"),
    "rad": (changed(angle_deg=P["angle_deg"] / 57.3), "if the columns hold rad"),
    "force": (changed(force1_n=K * 0 - 3e12), "force1_n = -3e+12 is more than any muscle"),
    "encoder counts": (changed(angle_deg=P["angle_deg"] * 100), "more than a turn"),
}


def test_a_bad_table_is_one_clear_line(read):
    all_refused(BAD_TABLES, read, "staircase_1.csv")
    for value, expected in (
        (1.01, "u2 = 1.01 is outside [-1, 1]"),
        (-50.0, "if it is percent, divide"),
    ):
        beyond = OPEN | {"u2": np.where(K == 5, value, -0.5)}
        with refused("line 7", expected):
            read(changed(**beyond), VALVE)


def test_sealed_muscles_of_which_nothing_is_recorded_are_asked_for_their_pressures(read):
    """Their number is not known; the air is known by the pressure at its start."""
    sealed = INDEX.replace("pressure_set", "sealed")
    bare = {name: P[name] for name in ("time_s", "angle_deg")}
    with refused("staircase_1.csv: drive = 'sealed'", "record that of each, as p1_kpa or NAME_kpa"):
        read(bare, sealed)
    (trial,) = read(bare | {"p1_kpa": P["p1_kpa"], "p2_kpa": P["p2_kpa"]}, sealed).trials
    assert trial.muscles == 2


AGAIN = INDEX[INDEX.index("[[") :].replace('"staircase"', '"a"')
BAD_INDEXES = {
    "schema": ('"pamsim-recording/1"', '"pamsim-recording/9"', "schema is 'pamsim-recording/9'"),
    "key": ("load_kg", "load_g", "unknown key load_g; did you mean 'load_kg'"),
    "top key": ("rig =", "rigg =", "unknown key rigg; did you mean 'rig'"),
    "no trial": (INDEX[INDEX.index("[[") :], "", "no trial; write [[trial]]"),
    "drive": ('"pressure_set"', '"presure_set"', "did you mean 'pressure_set'"),
    "negative load": ("load_kg = 1.2", "load_kg = -1", "write load_kg = the mass"),
    "load in gram": ("load_kg = 1.2", "load_kg = 1200", "write kg, not g"),
    "no file": ("staircase_1.csv", "staircase_9.csv", "cannot read"),
    "file twice": ("[[", AGAIN + "[[", "give each its segments"),
    "segments overlap": ("load_kg", "segments = [[0, 0.02], [0.01, 0.038]]\nload_kg", "at 0.01 s"),
    "noise of what": ("[[", '[noise]\nknee = { rms = "1 deg" }\n[[', "knee was not measured"),
    "noise in kg": ("[[", '[noise]\nangle = { rms = "1 kg" }\n[[', "[noise]: angle: rms"),
    "noise below 0": ("[[", '[noise]\nangle = { rms = "-1 deg" }\n[[', "must be 0 or more"),
    "noise as text": ("[[", 'noise = "little"\n[[', "write a table"),
}


def test_a_bad_index_is_one_clear_line(read, tmp_path):
    assert all(old in INDEX for old, *_ in BAD_INDEXES.values())
    all_refused(BAD_INDEXES, lambda old, new: read(P, INDEX.replace(old, new, 1)))
    write_recording(tmp_path / "names", "mas20_arm", {"a_1": recording("valve", 2, 1)})
    (tmp_path / "names" / "a_1.txt").write_bytes((tmp_path / "names" / "a_1.csv").read_bytes())
    index = tmp_path / "names" / "recording.toml"
    text = index.read_text()
    index.write_text(text + text[text.index("[[") :].replace("a_1.csv", "a_1.txt"))
    with refused("two trials are called 'a_1'; rename one of the files"):
        read_recordings(index)
    (tmp_path / "names" / "a_1.txt").unlink()
    for number, make in enumerate((Path.symlink_to, Path.hardlink_to)):
        make(link := tmp_path / "names" / f"link_{number}.csv", tmp_path / "names" / "a_1.csv")
        for file in (link.name, "./a_1.csv", "../names/a_1.csv"):
            index.write_text(text + text[text.index("[[") :].replace("a_1.csv", file))
            with refused(f"{file} is the same file as a_1.csv"):
                read_recordings(index)
    index.write_text(text)
    name = "a" * 5000  # no folder can be called so: left to load_rig
    assert read(P, INDEX.replace("mas20_arm", name, 1)).rig == name
    empty = tmp_path / "empty"
    empty.mkdir()
    with refused("no recording at"):
        read_recordings(empty)
    write_recording(
        empty, "mas20_arm", {"a_1": recording("valve", 2, 1), "a_2": recording("valve", 3, 2)}
    )
    with refused("a_2.csv: commands 3 muscles, a_1.csv 2"):
        read_recordings(empty)


def test_honest_but_unusual_trials_are_read(read):
    level = np.full(20, 300.0)
    for seed in range(3):
        noise = np.random.default_rng(seed).normal(0.0, 0.4, 20)
        small = {"p1_set_kpa": level + 5.0, "p1_kpa": level + 0.05 * (P["p1_kpa"] - 300.0)}
        small |= {"p2_set_kpa": level, "p2_kpa": level, "angle_deg": P["angle_deg"] * 0.03}
        vented = {"p1_set_kpa": 0.0 * K, "p2_set_kpa": 0.0 * K}
        for columns in (
            {"p1_kpa": noise, "p2_kpa": 0.5 * noise},  # a dead supply
            # As much as 400 kPa in bar, but only on average.
            {"p1_kpa": 4.0 + 15.0 * noise, "p2_kpa": noise},
            {"angle_deg": P["angle_deg"] / 100.0, "force1_n": P["p1_kpa"]},  # a held arm
            small,
            vented | {"p1_kpa": noise, "p2_kpa": noise},
        ):
            assert len(read(changed(**columns)).trials) == 1
