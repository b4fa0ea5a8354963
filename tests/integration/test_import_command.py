"""`pamsim import`: a lab's own log becomes a recording with the same numbers."""

from __future__ import annotations

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
from tests.typed_command import run

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


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return pamsim.new_rig("arm", "joint", out=tmp_path_factory.mktemp("rig") / "arm")


def write(path, columns):
    """A log in the format that its name ends with."""
    if path.suffix == ".npz":
        np.savez(path, **columns)
    elif path.suffix == ".mat":
        scipy.io.savemat(path, columns)
    elif path.suffix == ".parquet":
        pyarrow.parquet.write_table(pyarrow.table(columns), path)
    else:
        rows = np.column_stack(list(columns.values())).tolist()
        lines = [";".join(repr(cell).replace(".", ",") for cell in row) for row in rows]
        names = ";".join(name.partition(" [")[0] for name in columns)
        units = ";".join((name.partition("[")[2] or "-").strip("]") for name in columns)
        path.write_text("\n".join(["Logger 3", "by hand; today", names, units, *lines]))
    return path


def imported(folder, rig, log=LOG, suffix=".csv", **options):
    """What a log was taken for, and its trials."""
    folder.mkdir(exist_ok=True)
    found = pamsim.import_log(
        write(folder / f"run_7{suffix}", log), rig=rig, out=folder / "data", **options
    )
    return found, read_recordings(folder / "data").trials


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".parquet"])
def test_units_signs_and_absolute_pressures_arrive_in_si(suffix, rig, tmp_path):
    found, (trial,) = imported(tmp_path, rig, suffix=suffix)
    assert trial.drive == "measured"
    np.testing.assert_allclose(trial.time, TIME, atol=1e-12)
    np.testing.assert_allclose(trial.command, np.column_stack([FLEXOR, EXTENSOR]), atol=1.0)
    # Nothing says which way phi counts, but the muscles pull against it.
    np.testing.assert_allclose(trial.measured["elbow.angle"], ANGLE, atol=1e-9)
    (phi,) = (one for one in found.columns if one.column == "phi")
    assert any("sign turned" in warning for warning in phi.warnings)
    assert set(found.unused) == {"battery"}
    assert trial.protocol == "run"
    assert (tmp_path / "data" / f"run_7{suffix}").read_bytes() == (
        tmp_path / f"run_7{suffix}"
    ).read_bytes()


def test_mat_names_have_no_brackets_and_what_is_stated_counts(rig, tmp_path):
    log = {"t": TIME, "ch1": FLEXOR / 1e5, "ch2": EXTENSOR / 1e5, "phi": ANGLE}
    stated = ["flexor.pressure=ch1:bar", "extensor.pressure=ch2", "elbow.angle=-phi:rad"]
    found, (trial,) = imported(tmp_path, rig, log, ".mat", columns=stated)
    np.testing.assert_allclose(trial.measured["elbow.angle"], -ANGLE)  # as stated, though unlikely
    assert [one.column for one in found.columns if one.warnings] == ["ch2"]  # its unit was guessed


def test_commands_drive_where_there_are_some_and_their_period_is_proposed(rig, tmp_path):
    log = {**LOG, "P flexor cmd [Pa]": FLEXOR, "P extensor cmd [Pa]": EXTENSOR}
    found, (trial,) = imported(tmp_path / "a", rig, log)
    assert trial.drive == "pressure_set"
    assert "repeats every 1 s" in found.notes[0]
    found, trials = imported(tmp_path / "b", rig, log, period="1s", lead_in="1s", protocol="step")
    assert [t.protocol for t in trials] == ["step"] * 3
    np.testing.assert_allclose(trials[0].time[-1], 0.99)
    assert all(t.lead_in is not None for t in trials)
    found, trials = imported(tmp_path / "c", rig, log, segments=[(1.0, 2.0)], drive="measured")
    assert (trials[0].drive, trials[0].time.size) == ("measured", 100)


def test_a_torque_on_the_joint_drives_it_and_the_motion_where_that_is_stated(rig, tmp_path):
    log = {**LOG, "tau [Nm]": 0.5 * np.sin(TIME)}
    found, (trial,) = imported(tmp_path / "a", rig, log)
    assert found.drive == {"flexor": "measured", "extensor": "measured", "elbow": "torque"}
    np.testing.assert_allclose(trial.command[:, 2], 0.5 * np.sin(TIME))
    sealed = "flexor=sealed,extensor=sealed,elbow=angle"
    found, (trial,) = imported(tmp_path / "b", rig, log, drive=sealed)
    assert trial.drives.imposed == ("elbow",)
    assert set(trial.drives.muscles) == {"sealed"}
    with pytest.raises(InputError, match="did you mean 'elbow'"):
        imported(tmp_path / "c", rig, log, drive="elbo=angle")


def test_sealed_muscles_say_nothing_of_the_sign_of_a_joint_that_its_torque_drives(rig, tmp_path):
    """Their pressures follow the joint: they rise where it turns against them."""
    torque = 0.5 * np.sin(TIME)
    pressures = {"P flexor [Pa]": 2.5e5 - 2e4 * torque, "P extensor [Pa]": 2.5e5 + 2e4 * torque}
    for sense in (1.0, -1.0):
        log = {"t [s]": TIME, **pressures, "phi [rad]": sense * 0.2 * torque, "tau [Nm]": torque}
        folder = tmp_path / f"sense {sense:g}"
        found, (trial,) = imported(
            folder, rig, log, drive="flexor=sealed,extensor=sealed,elbow=torque"
        )
        np.testing.assert_allclose(trial.measured["elbow.angle"], 0.2 * torque, atol=1e-9)
        (phi,) = (one for one in found.columns if one.column == "phi")
        assert any("elbow is driven up" in warning for warning in phi.warnings) is (sense < 0.0)


def test_the_command_prints_what_it_understood_and_replaces_nothing_unasked(
    rig, tmp_path, monkeypatch, capsys
):
    log, out = write(tmp_path / "run.csv", LOG), tmp_path / "data"

    def imported(*more):
        words = ["import", log, "--rig", rig, "--out", out, *more]
        return run(monkeypatch, capsys, *words)

    code, shown, _ = imported("--json", tmp_path / "import.json")
    assert code == 0
    assert "is flexor.pressure in psi, absolute" in shown
    assert "not sure: phi: unit deg by its size; sign turned" in shown
    assert "not used: battery" in shown
    index = tomllib.loads((out / "recording.toml").read_text())
    assert index["columns"]["elbow.angle"] == {"column": "phi", "unit": "deg", "sign": -1}
    assert json.loads((tmp_path / "import.json").read_text())["drive"] == "measured"
    code, shown, error = imported()
    assert code == 2
    assert "is there already; --force replaces it" in error
    code, shown, error = imported(
        "--force", "--segments", "1:2,2:3", "--column", "elbow.angle=phi:deg"
    )
    assert code == 0
    assert "trials: 2" in shown
    code, shown, error = imported("--force", "--segments", "fill=1:2,vent=2:3")
    assert code == 0
    assert "trials: 2" in shown
    code, shown, error = imported("--force", "--segments", "1-2")
    assert code == 2
    assert "--segments 1-2: write BEGIN:END" in error


REFUSED = [
    ({"columns": ["knee.angle=phi"]}, LOG, "has no 'knee.angle'"),
    ({"columns": ["phi"]}, LOG, "write quantity=name"),
    ({"columns": ["elbow.angle=psi"]}, LOG, "no column 'psi'"),
    ({"columns": ["elbow.angle=phi:bar"]}, LOG, "elbow.angle: unit 'bar'"),
    ({"drive": "valve"}, LOG, "nothing drives flexor, extensor"),
    ({"drive": "motor"}, LOG, "no drive 'motor'"),
    ({"period": "9 s"}, LOG, "no period of 9 s"),
    ({}, {"phi": ANGLE, "P flexor [Pa]": FLEXOR}, "no clock"),
]


@pytest.mark.parametrize(("options", "log", "why"), REFUSED)
def test_what_cannot_be_a_recording_is_refused_and_leaves_nothing(options, log, why, rig, tmp_path):
    with pytest.raises(InputError, match=why):
        imported(tmp_path, rig, log, **options)
    assert not list((tmp_path / "data").glob("*"))


def test_the_index_is_there_once_it_is_right(rig, tmp_path, monkeypatch):
    def interrupted(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr("pamsim.comparison.import_log._turned", interrupted)
    with pytest.raises(KeyboardInterrupt):
        imported(tmp_path, rig)
    assert [path.name for path in (tmp_path / "data").iterdir()] == ["run_7.csv"]


def test_a_log_that_cannot_be_copied_whole_is_not_there(rig, tmp_path, monkeypatch):
    def full(source, target):
        target.write_bytes(source.read_bytes()[:100])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("shutil.copyfile", full)
    with pytest.raises(InputError, match=r"cannot write .*run_7\.csv: No space left"):
        imported(tmp_path, rig)
    assert not list((tmp_path / "data").iterdir())


def bare(path, *columns):
    """A log without header, to the numbers' last digit."""
    path.write_text(
        "\n".join(",".join(map(repr, row)) for row in np.column_stack(columns).tolist())
    )
    return path


KNOWN = ["flexor.pressure=column_1:Pa", "extensor.pressure=column_2:Pa", "elbow.angle=column_3:rad"]


def test_logs_without_header_and_clock_are_read_by_place_and_rate(rig, tmp_path):
    logs = [bare(tmp_path / f"run_{k}.csv", FLEXOR, EXTENSOR, ANGLE) for k in (1, 2)]
    out = tmp_path / "data"
    with pytest.raises(InputError, match=r"no clock among column_1, .* or give `rate`"):
        pamsim.import_log(logs, rig=rig, out=out, columns=KNOWN)
    pamsim.import_log(logs, rig=rig, out=out, columns=KNOWN, rate="100 Hz")
    for trial in read_recordings(out).trials:
        assert trial.protocol == "run"
        np.testing.assert_allclose(trial.time, TIME, atol=1e-12)
        np.testing.assert_allclose(trial.measured["elbow.angle"], ANGLE, rtol=1e-15)
    with pytest.raises(InputError, match=r"rate = '0 Hz' must be above 0"):
        pamsim.import_log(logs, rig=rig, out=tmp_path / "b", columns=KNOWN, rate="0 Hz")


def test_rows_of_one_time_stamp_are_spread_and_a_gap_stays_one(rig, tmp_path):
    """A clock of 20 ms on rows that are 10 ms apart."""
    coarse = np.floor(TIME / 0.02 + 1e-9) * 0.02
    columns = ["time=column_4:s", *KNOWN]
    log = bare(tmp_path / "run.csv", FLEXOR, EXTENSOR, ANGLE, coarse)
    pamsim.import_log(log, rig=rig, out=tmp_path / "data", columns=columns)
    found = read_recordings(tmp_path / "data")
    np.testing.assert_allclose(found.trials[0].time, TIME, atol=1e-12)
    assert any("200 rows repeat a time stamp" in note for note in found.notes)
    late = bare(tmp_path / "gap.csv", FLEXOR, EXTENSOR, ANGLE, coarse + 0.5 * (TIME > 2.0))
    with pytest.raises(InputError, match="the clock jumps"):
        pamsim.import_log(late, rig=rig, out=tmp_path / "b", columns=columns)


def test_a_torque_is_a_measured_force_times_its_arm_and_the_units_are_checked(rig, tmp_path):
    force = 30.0 * np.sin(TIME)
    log = {**LOG, "F [N]": force}
    _, (trial,) = imported(tmp_path / "a", rig, log, columns=["elbow.torque=-F*6.9mm:N"])
    np.testing.assert_allclose(trial.command[:, 2], -0.0069 * force, rtol=1e-12)
    assert 'times = "6.9mm"' in (tmp_path / "a/data/recording.toml").read_text()
    for factor, why in (
        ("6.9", "does not measure"),
        ("6.9 kg", "does not measure"),
        ("x", "not a number"),
    ):
        with pytest.raises(InputError, match=why):
            imported(tmp_path / "b", rig, log, columns=[f"elbow.torque=F*{factor}:N"])


def test_parts_of_one_log_are_trials_of_their_own_protocols(rig, tmp_path):
    parts = {"fill": [(0.0, 1.0), (1.0, 2.0)], "vent": [(2.0, 3.5)]}
    found, trials = imported(tmp_path / "a", rig, segments=parts)
    assert found.trials == ("run_7_fill_1", "run_7_fill_2", "run_7_vent")
    assert [t.protocol for t in trials] == ["fill", "fill", "vent"]
    assert len(list((tmp_path / "a/data").glob("*.csv"))) == 1
    np.testing.assert_allclose(trials[2].measured["elbow.angle"], ANGLE[200:350])
    with pytest.raises(InputError, match=r"segments overlap at 1\.5 s"):
        imported(tmp_path / "b", rig, segments={"fill": [(0.0, 2.0)], "vent": [(1.5, 3.0)]})


def test_columns_that_stand_still_are_read(rig, tmp_path):
    """A vented muscle and a joint that is held."""
    still = {**LOG, "P flexor [psia]": np.full(TIME.size, 14.7), "phi": np.zeros(TIME.size)}
    found, (trial,) = imported(tmp_path, rig, still)
    assert {one.quantity for one in found.columns} == {
        "time", "flexor.pressure", "extensor.pressure", "elbow.angle",
    }  # fmt: skip
    assert np.ptp(trial.measured["elbow.angle"]) == 0.0


def test_without_pyarrow_one_line_says_what_to_install(rig, tmp_path, monkeypatch):
    write(tmp_path / "log.parquet", LOG)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"pip install 'pamsim\[parquet\]'"):
        pamsim.import_log(tmp_path / "log.parquet", rig=rig, out=tmp_path / "data")


def test_logs_of_one_name_are_repeats_and_the_folder_of_the_log_may_be_the_recordings(
    rig, tmp_path
):
    logs = [write(tmp_path / f"stairs_{k}.csv", LOG) for k in (1, 2)]
    found = pamsim.import_log(logs, rig=rig, out=tmp_path)
    assert found.trials == ("stairs_1", "stairs_2")
    assert {t.protocol for t in read_recordings(tmp_path).trials} == {"stairs"}


def test_the_command_proposes_a_period_where_no_segments_are_given(
    rig, tmp_path, monkeypatch, capsys
):
    commands = {"P flexor cmd [Pa]": FLEXOR, "P extensor cmd [Pa]": EXTENSOR}
    log = write(tmp_path / "run.csv", {**LOG, **commands})
    words = ["import", log, "--rig", rig, "--out", tmp_path / "data"]
    assert "the command repeats every 1 s" in run(monkeypatch, capsys, *words)[1]
