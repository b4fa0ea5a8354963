"""`pamsim import`: a lab's own log becomes a recording with the same numbers."""

import errno
import json
import sys
import tomllib

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
import scipy.io

import pamsim
from pamsim.core.errors import InputError
from pamsim.recordings.recording_reader import read_recordings
from tests.unit.core.refusals import refused

TIME = np.arange(400) * 0.01
FLEXOR = np.where(np.arange(400) % 100 < 50, 3e5, 1e5)  # [Pa], repeats in a second
EXTENSOR = 4e5 - FLEXOR
ANGLE = 4e-6 * (FLEXOR - EXTENSOR) + 0.02 * np.cos(3.0 * TIME)  # [rad]
LOG = {
    "t_ms": 1e3 * TIME,
    "P flexor [psia]": (FLEXOR + 101325.0) / 6894.757293168,
    "P extensor [psia]": (EXTENSOR + 101325.0) / 6894.757293168,
    "phi": -np.degrees(ANGLE),
    "battery": np.full(TIME.size, 12.0),
}
COMMANDS = {"P flexor cmd [Pa]": FLEXOR, "P extensor cmd [Pa]": EXTENSOR}
BARE = ["flexor.pressure=column_1:Pa", "extensor.pressure=column_2:Pa", "elbow.angle=column_3:rad"]


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return pamsim.new_rig("arm", "joint", out=tmp_path_factory.mktemp("rig") / "arm")


def write(path, columns):
    """A log in the format that its name ends with; columns without names have no header."""
    if path.suffix == ".npz":
        np.savez(path, **columns)
    elif path.suffix == ".mat":
        scipy.io.savemat(path, columns)
    elif path.suffix == ".parquet":
        pyarrow.parquet.write_table(pyarrow.table(columns), path)
    elif not isinstance(columns, dict):
        rows = np.column_stack(columns).tolist()
        path.write_text("\n".join(",".join(map(repr, row)) for row in rows))
    else:
        rows = np.column_stack(list(columns.values())).tolist()
        lines = [";".join(repr(cell).replace(".", ",") for cell in row) for row in rows]
        names = ";".join(name.partition(" [")[0] for name in columns)
        units = ";".join((name.partition("[")[2] or "-").strip("]") for name in columns)
        path.write_text("\n".join(["Logger 3", "by hand; today", names, units, *lines]))
    return path


@pytest.fixture
def imported(rig, tmp_path):
    """Imports a log into a folder of its own: what it was taken for, and its trials."""

    def imported(log=LOG, suffix=".csv", folder="", **options):
        (tmp_path / folder).mkdir(exist_ok=True)
        path, out = write(tmp_path / folder / f"run_7{suffix}", log), tmp_path / folder / "data"
        return pamsim.import_log(path, rig=rig, out=out, **options), read_recordings(out).trials

    return imported


def test_units_signs_and_absolute_pressures_arrive_in_si(imported, tmp_path):
    for suffix in (".csv", ".npz", ".parquet"):
        found, (trial,) = imported(suffix=suffix, folder=suffix)
        assert (trial.drive, trial.protocol) == ("measured", "run")
        np.testing.assert_allclose(trial.time, TIME, atol=1e-12)
        np.testing.assert_allclose(trial.command, np.column_stack([FLEXOR, EXTENSOR]), atol=1.0)
        # Nothing says which way phi counts, but the muscles pull against it.
        np.testing.assert_allclose(trial.measured["elbow.angle"], ANGLE, atol=1e-9)
        (phi,) = (one for one in found.columns if one.column == "phi")
        assert any("sign reversed" in warning for warning in phi.warnings)
        assert set(found.unused) == {"battery"}
        log = f"run_7{suffix}"
        copy, given = tmp_path / suffix / "data" / log, tmp_path / suffix / log
        assert copy.read_bytes() == given.read_bytes()


def test_mat_names_have_no_brackets_and_what_is_stated_counts(imported):
    log = {"t": TIME, "ch1": FLEXOR / 1e5, "ch2": EXTENSOR / 1e5, "phi": ANGLE}
    stated = ["flexor.pressure=ch1:bar", "extensor.pressure=ch2", "elbow.angle=-phi:rad"]
    found, (trial,) = imported(log, ".mat", columns=stated)
    np.testing.assert_allclose(trial.measured["elbow.angle"], -ANGLE)  # as stated, though unlikely
    assert [one.column for one in found.columns if one.warnings] == ["ch2"]  # its unit was guessed


def test_commands_drive_where_there_are_some_and_their_period_is_proposed(imported):
    log = LOG | COMMANDS
    found, (trial,) = imported(log)
    assert trial.drive == "pressure_set"
    assert "repeats every 1 s" in found.notes[0]
    _, trials = imported(log, folder="b", period="1s", lead_in="1s", protocol="step")
    assert [t.protocol for t in trials] == ["step"] * 3
    np.testing.assert_allclose(trials[0].time[-1], 0.99)
    assert all(t.lead_in is not None for t in trials)
    _, (trial,) = imported(log, folder="c", segments=[(1.0, 2.0)], drive="measured")
    assert (trial.drive, trial.time.size) == ("measured", 100)


def test_a_torque_on_the_joint_drives_it_and_the_motion_where_that_is_stated(imported):
    log = {**LOG, "tau [Nm]": 0.5 * np.sin(TIME)}
    found, (trial,) = imported(log)
    assert found.drive == {"flexor": "measured", "extensor": "measured", "elbow": "torque"}
    np.testing.assert_allclose(trial.command[:, 2], 0.5 * np.sin(TIME))
    sealed = "flexor=sealed,extensor=sealed,elbow=angle"
    _, (trial,) = imported(log, folder="b", drive=sealed)
    assert trial.drives.imposed == ("elbow",)
    assert set(trial.drives.muscles) == {"sealed"}


def test_sealed_muscles_say_nothing_of_the_sign_of_a_joint_that_its_torque_drives(imported):
    """Their pressures follow the joint: they rise where it turns against them."""
    torque = 0.5 * np.sin(TIME)
    pressures = {"P flexor [Pa]": 2.5e5 - 2e4 * torque, "P extensor [Pa]": 2.5e5 + 2e4 * torque}
    for sense in (1.0, -1.0):
        log = {"t [s]": TIME, **pressures, "phi [rad]": sense * 0.2 * torque, "tau [Nm]": torque}
        sealed = "flexor=sealed,extensor=sealed,elbow=torque"
        found, (trial,) = imported(log, folder=f"sense {sense:g}", drive=sealed)
        np.testing.assert_allclose(trial.measured["elbow.angle"], 0.2 * torque, atol=1e-9)
        (phi,) = (one for one in found.columns if one.column == "phi")
        assert any("elbow is driven up" in warning for warning in phi.warnings) is (sense < 0.0)


def test_a_single_muscle_is_not_said_to_be_swapped(tmp_path):
    pressure = 2e5 + 1e5 * np.sin(TIME)
    log = {"t [s]": TIME, "p [Pa]": pressure, "x [m]": 1e-8 * pressure}
    warned = []
    for sense in (1.0, -1.0):
        path = write(tmp_path / f"sense {sense:g}.csv", log | {"x [m]": sense * log["x [m]"]})
        found = pamsim.import_log(path, rig="muscle_bench", out=tmp_path / f"{sense:g}")
        warned += [word for one in found.columns if one.kind == "position" for word in one.warnings]
    assert [word for word in warned if "sign" in word] == [
        "sign reversed, because it falls while the muscles pull it up"
    ]


def test_a_torque_is_a_measured_force_times_its_arm(imported, tmp_path):
    force = 30.0 * np.sin(TIME)
    _, (trial,) = imported({**LOG, "F [N]": force}, columns=["elbow.torque=-F*6.9mm:N"])
    np.testing.assert_allclose(trial.command[:, 2], -0.0069 * force, rtol=1e-12)
    assert 'times = "6.9mm"' in (tmp_path / "data/recording.toml").read_text()
    current = {**LOG, "I [A]": force}  # of a motor, times its torque constant
    _, (trial,) = imported(current, folder="b", columns=["elbow.torque=I*0.35 N*m/A:A"])
    np.testing.assert_allclose(trial.command[:, 2], 0.35 * force, rtol=1e-12)


def test_the_command_prints_what_it_understood_and_replaces_nothing_unasked(rig, tmp_path, run):
    log, out, file = write(tmp_path / "run.csv", LOG), tmp_path / "data", tmp_path / "import.json"

    def imported(*more, log=log):
        return run("import", log, "--rig", rig, "--out", out, *more)

    code, shown, _ = imported("--json", file)
    assert code == 0
    for words in (
        "is flexor.pressure in psi, absolute",
        "not sure: phi: unit deg by its size; sign reversed",
        "not used, name not known: battery",
    ):
        assert words in shown
    index = tomllib.loads((out / "recording.toml").read_text())
    assert index["columns"]["elbow.angle"] == {"column": "phi", "unit": "deg", "sign": -1}
    assert json.loads(file.read_text())["drive"] == "measured"
    code, _, error = imported()
    assert (code, "is there already; --force replaces it" in error) == (2, True)
    for segments in ("1:2,2:3", "fill=1:2,vent=2:3"):
        code, shown, _ = imported(
            "--force", "--segments", segments, "--column", "elbow.angle=phi:deg"
        )
        assert (code, "trials: 2" in shown) == (0, True)
    code, _, error = imported("--force", "--segments", "1-2")
    assert (code, "write BEGIN:END" in error) == (2, True)
    commanded = write(tmp_path / "b.csv", LOG | COMMANDS)
    assert "the command repeats every 1 s" in imported("--force", log=commanded)[1]


def test_what_cannot_be_a_recording_is_refused_and_leaves_nothing(imported, tmp_path):
    bare = [FLEXOR, EXTENSOR, ANGLE]
    coarse = np.floor(TIME / 0.02) * 0.02 + 0.5 * (TIME > 2.0)
    overlapping = {"fill": [(0.0, 2.0)], "vent": [(1.5, 3.0)]}
    for options, log, why in (
        ({"columns": ["knee.angle=phi"]}, LOG, "has no 'knee.angle'"),
        ({"columns": ["phi"]}, LOG, "write quantity=name"),
        ({"columns": ["elbow.angle=psi"]}, LOG, "no column 'psi'"),
        ({"columns": ["elbow.angle=phi:bar"]}, LOG, "elbow.angle: unit 'bar'"),
        *(
            ({"columns": [f"elbow.torque=battery*{factor}:N"]}, LOG, words)
            for factor, words in (
                ("6.9", "does not measure"),
                ("6.9 kg", "does not measure"),
                ("x", "not a number"),
            )
        ),
        ({"drive": "valve"}, LOG, "nothing drives flexor, extensor"),
        ({"drive": "motor"}, LOG, "no drive 'motor'"),
        (
            {"drive": "sealed"},
            {name: LOG[name] for name in ("t_ms", "phi", "battery")},
            r"all muscles are sealed, and no column gives .* `columns` flexor.pressure=NAME:bar",
        ),
        ({"drive": "elbo=angle"}, LOG, "did you mean 'elbow'"),
        ({"period": "9 s"}, LOG, "no period of 9 s"),
        ({"segments": overlapping}, LOG, r"segments overlap at 1\.5 s"),
        ({}, {"phi": ANGLE, "P flexor [Pa]": FLEXOR}, "no clock"),
        ({"columns": BARE}, bare, r"no clock among column_1, .* or give `rate`"),
        ({"columns": BARE, "rate": "0 Hz"}, bare, r"rate = '0 Hz' must be above 0"),
        ({"columns": ["time=column_4:s", *BARE]}, [*bare, coarse], "the clock jumps"),
    ):
        with pytest.raises(InputError, match=why):
            imported(log, **options)
        assert not list((tmp_path / "data").glob("*")), why


def test_a_log_of_one_row_is_refused_in_one_line(rig, tmp_path):
    """Its clock has no step, by which its unit is guessed otherwise."""
    log = tmp_path / "run.csv"
    log.write_text("t,p flexor,p extensor\n0,1e5,1e5\n")
    with pytest.raises(InputError, match="1 rows are too few"):
        pamsim.import_log(log, rig=rig, out=tmp_path / "data")


def test_the_index_is_there_once_it_is_right(imported, tmp_path, monkeypatch):
    def interrupted(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr("pamsim.comparison.import_log.turned_joints", interrupted)
    with pytest.raises(KeyboardInterrupt):
        imported()
    assert [path.name for path in (tmp_path / "data").iterdir()] == ["run_7.csv"]


def test_a_log_that_cannot_be_copied_whole_is_not_there(imported, tmp_path, monkeypatch):
    def full(source, target):
        target.write_bytes(source.read_bytes()[:100])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("shutil.copyfile", full)
    with pytest.raises(InputError, match=r"cannot write .*run_7\.csv: No space left"):
        imported()
    assert not list((tmp_path / "data").iterdir())


def test_logs_without_header_and_clock_are_read_by_place_and_rate(rig, tmp_path):
    """Logs of one name are repeats, and their folder may be that of the recording."""
    logs = [write(tmp_path / f"run_{k}.csv", [FLEXOR, EXTENSOR, ANGLE]) for k in (1, 2)]
    found = pamsim.import_log(logs, rig=rig, out=tmp_path, columns=BARE, rate="100 Hz")
    assert found.trials == ("run_1", "run_2")
    for trial in read_recordings(tmp_path).trials:
        assert trial.protocol == "run"
        np.testing.assert_allclose(trial.time, TIME, atol=1e-12)
        np.testing.assert_allclose(trial.measured["elbow.angle"], ANGLE, rtol=1e-15)


def test_rows_of_one_time_stamp_are_spread(rig, tmp_path):
    """A clock of 20 ms on rows that are 10 ms apart."""
    coarse = np.floor(TIME / 0.02 + 1e-9) * 0.02
    log = write(tmp_path / "run.csv", [FLEXOR, EXTENSOR, ANGLE, coarse])
    columns = ["time=column_4:s", *BARE]
    pamsim.import_log(log, rig=rig, out=tmp_path / "data", columns=columns)
    found = read_recordings(tmp_path / "data")
    np.testing.assert_allclose(found.trials[0].time, TIME, atol=1e-12)
    assert any("200 rows repeat a time stamp" in note for note in found.notes)


def test_a_clock_that_begins_again_runs_on_where_that_is_stated(imported, tmp_path):
    """Also in milliseconds, and where a schedule is laid beside it."""
    again = LOG | {"t_ms": 1e3 * np.mod(TIME, 1.0)}
    shut = write(tmp_path / "shut.csv", SHUT)
    with refused("state `wraps` of a clock that begins again"):
        imported(again)
    for folder, schedule in (("alone", ()), ("scheduled", shut)):
        _, (trial,) = imported(again, folder=folder, schedule=schedule, wraps="1 s")
        np.testing.assert_allclose(trial.time, TIME, atol=1e-12)
    with refused("`wraps` -1s: it must be above 0 s"):
        imported(again, folder="other", wraps="-1s")
    for folder, schedule in (("rate", ()), ("rate, scheduled", shut)):
        with refused("run_7.csv: `wraps` 1s needs a clock, and `rate` replaces it"):
            imported(
                [FLEXOR, EXTENSOR, ANGLE],
                columns=BARE,
                folder=folder,
                rate="100Hz",
                wraps="1s",
                schedule=schedule,
            )


def test_columns_to_ignore_drive_nothing_and_a_stated_unit_holds_for_others_of_its_kind(imported):
    """5 kPa are too little of the supply's pressure for a guess by their size."""
    log = {"t_s": TIME, "p1": 0.01 * FLEXOR, "p2": 0.01 * EXTENSOR, "p1_set": FLEXOR, "phi": ANGLE}
    states = ["elbow.angle=phi:rad", "flexor.pressure=p1:Pa"]
    found, (trial,) = imported(log, columns=states, ignore=["p1_set"])
    assert found.unused["p1_set"] == "ignored"
    assert found.drive == "measured"
    np.testing.assert_allclose(trial.measured["extensor.pressure"], 0.01 * EXTENSOR, rtol=1e-12)
    with refused("to ignore"):
        imported(log, folder="other", ignore=["p9"])


def test_parts_of_one_log_are_trials_of_their_own_protocols(imported, tmp_path):
    parts = {"fill": [(0.0, 1.0), (1.0, 2.0)], "vent": [(2.0, 3.5)]}
    found, trials = imported(segments=parts)
    assert found.trials == ("run_7_fill_1", "run_7_fill_2", "run_7_vent")
    assert [t.protocol for t in trials] == ["fill", "fill", "vent"]
    assert len(list((tmp_path / "data").glob("*.csv"))) == 1
    np.testing.assert_allclose(trials[2].measured["elbow.angle"], ANGLE[200:350])


def test_columns_that_stand_still_are_read(imported):
    """A vented muscle and a joint that is held."""
    still = {**LOG, "P flexor [psia]": np.full(TIME.size, 14.7), "phi": np.zeros(TIME.size)}
    found, (trial,) = imported(still)
    assert set(found.unused) == {"battery"}
    assert np.ptp(trial.measured["elbow.angle"]) == 0.0


def test_without_pyarrow_one_line_says_what_to_install(rig, tmp_path, monkeypatch):
    write(tmp_path / "log.parquet", LOG)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"pip install 'pamsim\[parquet\]'"):
        pamsim.import_log(tmp_path / "log.parquet", rig=rig, out=tmp_path / "data")


def test_two_loggers_become_one_log_on_the_clock_of_the_first(rig, tmp_path, run):
    jerk = np.exp(-(((TIME - 1.7) / 0.2) ** 2))  # once: all else repeats in a second
    angle, later = ANGLE + 0.05 * jerk, 0.37
    keep = ("t_ms", "P flexor [psia]", "P extensor [psia]")
    first = {**{name: LOG[name] for name in keep}, "sync": angle}
    second = {"time [s]": TIME - later, "phi": np.degrees(angle), "trigger": -2.0 * angle}
    log = write(tmp_path / "air.txt", first)
    beside = write(tmp_path / "arm.txt", second)
    twice = {**second, "time [s]": TIME - 0.01 * (np.arange(400) == 4)}
    stands = write(tmp_path / "stands.txt", twice)
    asked = ("import", log, "--rig", rig, "--out", tmp_path / "out")
    by = ("--beside", beside)
    code, shown, _ = run(*asked, *by, "--shared", "sync=trigger")
    assert code == 0
    assert "arm.txt lies beside air.txt by an offset of 0.3700 +- " in shown
    (trial,) = read_recordings(tmp_path / "out").trials
    np.testing.assert_allclose(trial.measured["elbow.angle"], angle, atol=1e-3)
    np.testing.assert_allclose(trial.measured["flexor.pressure"], FLEXOR, atol=1.0)
    code, shown, _ = run(*asked, *by, "--force", "--offset", "0.37s")
    assert (code, "an offset of 0.37 s as stated" in shown) == (0, True)
    (again,) = read_recordings(tmp_path / "out").trials
    np.testing.assert_allclose(again.measured["elbow.angle"], angle, atol=1e-9)
    for more, why in (
        (by, "the offset of its clock from that of"),
        ((*by, "--shared", "sync=phase"), "no column 'phase' to find the offset of the clocks by"),
        ((*by, "--offset", "90s"), "have no time in common: the second runs from 89.6"),
        (("--beside", stands, "--offset", "1s"), "time: the clock stands or runs back at 0.03 s"),
        (
            ("--beside", beside, "--beside", beside, "--offset", "1s"),
            "1 logs and 2 --beside them; give one for each",
        ),
    ):
        code, _, error = run(*asked, "--force", *more)
        assert (code, error.count("\n")) == (2, 1)
        assert why in error


def test_a_schedule_states_what_was_commanded_and_short_pulses_let_as_much_air_through(
    rig, tmp_path, run
):
    keep = ("t_ms", "P flexor [psia]", "P extensor [psia]", "phi")
    log = write(tmp_path / "air.txt", {name: LOG[name] for name in keep})
    sample = TIME[1] - TIME[0]
    # A pulse of a quarter of a sample in the third, and one of five samples from the sixth on.
    begins = np.array([0.0, 2.5, 2.75, 6.0, 11.0]) * sample
    opened = np.array([0.0, 0.8, 0.0, -0.5, 0.0])
    pulses = write(
        tmp_path / "pulses.csv",
        {"time_s": begins - 1.0, "flexor_valve": opened, "extensor_valve": 0.0 * opened},
    )
    asked = ("import", log, "--rig", rig, "--out", tmp_path / "out", "--schedule", pulses)
    code, shown, _ = run(*asked, "--offset", "1s")
    assert code == 0
    assert "pulses.csv is what was commanded: flexor_valve, extensor_valve; it changes" in shown
    assert "within 2.5 ms, in samples of 10 ms as their mean: sample the log faster" in shown
    (trial,) = read_recordings(tmp_path / "out").trials
    assert trial.drive == "valve"
    expected = np.zeros(TIME.size)
    expected[2], expected[6:11] = 0.25 * 0.8, -0.5
    np.testing.assert_allclose(trial.command, np.outer(expected, [1.0, 0.0]), atol=1e-12)
    both = {"flexor_valve": opened, "phi": opened}
    twice = write(tmp_path / "twice.csv", {"time_s": begins, **both})
    late = write(tmp_path / "late.csv", {"time_s": begins + 1.0, **both})
    for schedules, why in (
        ((twice,), "phi is a column of"),
        ((late,), "add a row with what was commanded before"),
        ((pulses, pulses), "1 logs and 2 --schedule; give one for each"),
    ):
        options = [part for one in schedules for part in ("--schedule", one)]
        code, _, error = run(*asked[:-2], "--force", *options)
        assert (code, error.count("\n")) == (2, 1)
        assert why in error


AIR = {name: LOG[name] for name in ("t_ms", "P flexor [psia]", "P extensor [psia]")}
ARM = {"time [s]": TIME, "phi [rad]": ANGLE, "lamp": 0.0 * TIME}
SHUT = {"time_s": TIME[:9], "flexor_valve": 0.0 * TIME[:9], "extensor_valve": 0.0 * TIME[:9]}


@pytest.fixture
def joined(rig, tmp_path):
    """Imports a log with a table beside it or its schedule: what was found, and its trial."""

    def joined(log, other, by="beside", **options):
        out, first = tmp_path / "out", write(tmp_path / "air.txt", log)
        tables = {by: write(tmp_path / "other.txt", other)}
        found = pamsim.import_log(
            first, rig=rig, out=out, offset="0s", force=True, **tables, **options
        )
        return found, read_recordings(out).trials[0]

    return joined


def test_a_scheduled_command_changes_at_its_rows_alone(joined):
    """Levels that no binary number is, and a row that begins within a sample."""
    schedule = {
        "time_s": np.array([0.0, 0.7, 2.3, 3.005]),
        "flexor_set [kPa]": np.array([300.0, 333.3, 123.4, 210.1]),
        "extensor_set [kPa]": np.array([300.0, 100.0, 250.7, 250.7]),
    }
    _, trial = joined(AIR | {"phi": LOG["phi"]}, schedule, "schedule")
    flexor, extensor = (np.flatnonzero(np.diff(column)) + 1 for column in trial.command.T)
    assert (flexor.tolist(), extensor.tolist()) == ([70, 230, 300, 301], [70, 230])
    np.testing.assert_allclose(trial.command[300, 0], 0.5 * (123.4e3 + 210.1e3), rtol=1e-9)
    late = AIR | {"t_ms": AIR["t_ms"] + 1e6, "phi": LOG["phi"]}  # since the logger was turned on
    found, _ = joined(late, schedule, "schedule")
    assert "the log begins after its last row, which holds throughout: check" in found.notes[0]


def test_commands_of_a_second_logger_hold_until_its_next_row(joined):
    log = AIR | {"phi": LOG["phi"]}
    _, trial = joined(log, {name: v[::10] for name, v in ({"t [s]": TIME} | COMMANDS).items()})
    expected = np.column_stack([FLEXOR, EXTENSOR])[: trial.time.size]
    np.testing.assert_allclose(trial.command, expected, rtol=1e-12)


def test_a_gap_of_a_second_logger_is_not_bridged_and_a_schedule_shares_no_signal(joined):
    with refused("1 logs and 0 `beside` them; give one for each"):
        joined(AIR | {"phi": ANGLE}, SHUT, "schedule", shared="phi=lamp")
    with refused("other.txt: line 105: the clock jumps from 0.99 to 1.2 s, 21 times its usual"):
        joined(AIR, {name: np.delete(v, range(100, 120)) for name, v in ARM.items()})


def test_columns_of_two_loggers_with_one_name_are_all_kept(joined):
    log = {"t [s]": TIME, "ch": FLEXOR, "ch_2": EXTENSOR}
    stated = ["flexor.pressure=ch:Pa", "extensor.pressure=ch_2:Pa", "elbow.angle=ch_3:rad"]
    _, trial = joined(log, {"time [s]": TIME, "ch": ANGLE, "lamp": TIME}, columns=stated)
    np.testing.assert_allclose(trial.command, np.column_stack([FLEXOR, EXTENSOR]))
    np.testing.assert_allclose(trial.measured["elbow.angle"], ANGLE)


def test_a_column_with_a_cell_that_is_no_number_is_left_out_with_a_note(joined):
    spoilt = {"force [N]": np.where(np.arange(400) == 7, np.nan, 1.0)}
    for log, other, by, where in (
        (AIR | spoilt, ARM, "beside", "air.txt"),
        (AIR, ARM | spoilt, "beside", "other.txt"),
        (AIR | {"phi": LOG["phi"]} | spoilt, SHUT, "schedule", "air.txt"),
    ):
        found, _ = joined(log, other, by)
        assert f"not used, not all cells of {where} are numbers: force" in found.notes[0]
        with refused(f"{where}: line 12: force = nan"):
            joined(log, other, by, columns=["flexor.force=force"])


def test_what_is_stated_of_a_clock_counts_while_tables_are_joined(joined):
    pressures = {name: values for name, values in AIR.items() if name != "t_ms"}
    opened = FLEXOR / 1e6
    valves = {"time_s": TIME, "flexor_valve": opened, "extensor_valve": -opened}
    schedule = {name: values[::50] for name, values in valves.items()}
    for stated, second in (("time=t:min", 60.0), ("time=t*2s:1", 2.0)):
        log = {"t": TIME / second} | pressures
        _, trial = joined(log, ARM, columns=[stated])
        np.testing.assert_allclose(trial.time, TIME, atol=1e-9)
        np.testing.assert_allclose(trial.measured["elbow.angle"], ANGLE, atol=1e-9)
        _, trial = joined(log | {"phi": ANGLE}, schedule, "schedule", columns=[stated])
        np.testing.assert_allclose(trial.command, np.outer(opened, [1.0, -1.0]))


def test_the_clock_of_a_second_table_may_be_stated(joined):
    other = {"n": 1e3 * TIME, "phi [rad]": ANGLE, "lamp": 0.0 * TIME}
    for clocks in (["time=n:ms"], ["time=n:ms", "time=t_ms:ms"]):
        _, trial = joined(AIR, other, columns=clocks)
        np.testing.assert_allclose(trial.measured["elbow.angle"], ANGLE, atol=1e-9)
    shut = {"n": SHUT["time_s"], **{name: v for name, v in SHUT.items() if name != "time_s"}}
    _, trial = joined(AIR | {"phi": ANGLE}, shut, "schedule", columns=["time=n:s"])
    assert trial.drive == "valve"
    with refused("no column 'm' for time"):
        joined(AIR, ARM, columns=["time=m:ms"])


def test_numbered_logs_stay_repeats_with_the_tables_that_are_joined_to_them(rig, tmp_path):
    tables = {"run": AIR, "arm": ARM, "shut": SHUT}
    logs, arms, shut = (
        [write(tmp_path / f"{name}_{k}.csv", table) for k in (1, 2)]
        for name, table in tables.items()
    )
    found = pamsim.import_log(
        logs, rig=rig, out=tmp_path / "out", beside=arms, schedule=shut, offset="0s"
    )
    assert found.trials == ("run_and_arm_commanded_1", "run_and_arm_commanded_2")
    trials = read_recordings(tmp_path / "out").trials
    assert [trial.protocol for trial in trials] == ["run"] * 2
    with pytest.raises(InputError, match="2 logs and 1 `protocol`; give one for each"):
        pamsim.import_log(logs, rig=rig, out=tmp_path / "other", protocol=["fill"])


def test_one_schedule_is_of_all_logs_and_a_rate_is_their_clock(rig, tmp_path):
    columns = [FLEXOR, EXTENSOR, ANGLE]
    logs = [write(tmp_path / f"pulses_check_{k}.csv", columns) for k in (1, 2)]
    opened = {"time_s": [0.0, 1.0, 1.5], "flexor_valve": [0.0, 0.5, 0.0]}
    shut = {"extensor_valve": [0.0, 0.0, 0.0]}
    schedule = write(tmp_path / "schedule.csv", opened | shut)
    pamsim.import_log(
        logs, rig=rig, out=tmp_path / "out", schedule=schedule, rate="100Hz", columns=BARE
    )
    with refused("a `rate` of 0 Hz; it must be above 0"):
        pamsim.import_log(logs, rig=rig, out=tmp_path, schedule=schedule, rate="0Hz", columns=BARE)
    for trial in read_recordings(tmp_path / "out").trials:
        assert trial.protocol == "pulses_check"
        np.testing.assert_allclose(trial.time, TIME, atol=1e-12)
        assert np.array_equal(trial.command[:, 0], np.where((TIME >= 1) & (TIME < 1.5), 0.5, 0.0))
        np.testing.assert_allclose(trial.measured["flexor.pressure"], FLEXOR)


def test_names_may_hold_any_character(imported):
    log = {"𝜃 [deg]" if name == "phi" else name: values for name, values in LOG.items()}
    found, _ = imported(log, columns=["elbow.angle=𝜃:deg"], protocol="𝜃")
    assert "𝜃" in {one.column for one in found.columns}


def test_what_is_no_list_of_numbers_in_a_file_of_arrays_is_noted(imported):
    found, _ = imported(LOG | {"gain": np.float64(3.0)}, ".npz")
    assert "not used, no list of numbers: gain" in found.notes
