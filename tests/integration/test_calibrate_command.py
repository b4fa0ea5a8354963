"""``pamsim calibrate``: planted rigs come back, what data cannot show is said, nothing is lost."""

from __future__ import annotations

import csv
import dataclasses
import json

import numpy as np
import pytest

import pamsim
from pamsim.calibration.calibrate import calibrate
from pamsim.calibration.calibration_problem import CalibrationProblem
from pamsim.comparison.free_parameters import freed_parameters
from pamsim.comparison.measurements import read_calibration_data
from pamsim.core.units import DEG_PER_RAD
from pamsim.recordings.recording import write_recording
from tests.typed_command import run as command

RATE = 100.0
ANGLE_NOISE, PRESSURE_NOISE = 0.05 / DEG_PER_RAD, 400.0
PLANTED = {
    "valve.conductance_fill": 6.1e-10,
    "valve.conductance_exhaust": 4.7e-10,
    "joint.shaft.damping": 0.4,
}
FREE = ",".join(PLANTED)


def run(monkeypatch, capsys, *args):
    return command(monkeypatch, capsys, "calibrate", *args)


def valves(*openings):
    """A trial that holds each pair of valve openings for 0.25 s."""
    return pamsim.Experiment(
        drive="valve",
        command_time=0.25 * np.arange(len(openings)),
        command_value=np.array(openings),
        start_pressure=np.array([2.5e5, 2.5e5]),
        duration=0.25 * len(openings),
        sample_rate=RATE,
        settle=2.0,
    )


EXPERIMENTS = {
    "swing": valves((0.4, -0.5), (0.0, 0.0), (-0.6, 0.5), (0.0, 0.2)),
    "fill": valves((0.5, 0.3), (-0.2, 0.0), (0.0, -0.6), (0.2, 0.2)),
}


def noisy(recording, rng):
    count, muscles = recording.pressure.shape
    return dataclasses.replace(
        recording.with_angle(recording.angle + rng.normal(0.0, ANGLE_NOISE, count)),
        pressure=recording.pressure + rng.normal(0.0, PRESSURE_NOISE, (count, muscles)),
    )


def without_forces(folder):
    for path in folder.glob("*.csv"):
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        keep = [i for i, name in enumerate(rows[0]) if not name.startswith("force")]
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([[row[i] for i in keep] for row in rows])


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


@pytest.fixture(scope="module")
def recording(rig, tmp_path_factory):
    """Two trials of one protocol and one of another, of a rig with other valves and damping."""
    planted, rng = rig.with_parameters(PLANTED), np.random.default_rng(7)
    runs = {name: pamsim.simulate(planted, e).completed() for name, e in EXPERIMENTS.items()}
    trials = {
        "swing_1": noisy(runs["swing"], rng),
        "swing_2": noisy(runs["swing"], rng),
        "fill_1": noisy(runs["fill"], rng),
    }
    folder = tmp_path_factory.mktemp("data") / "recording"
    write_recording(folder, "mas20_arm", trials)
    without_forces(folder)
    return folder


@pytest.fixture(scope="module")
def report(recording, tmp_path_factory):
    return calibrate(
        [recording], free=list(PLANTED), hold_out=["fill"], out=tmp_path_factory.mktemp("out") / "o"
    )


def test_planted_parameters_are_recovered_within_their_intervals(report):
    assert report.status == "converged"
    for parameter in report.parameters:
        low, high = parameter.interval95
        assert low < PLANTED[parameter.name] < high
        assert high - low < 0.1 * parameter.value  # and the intervals say something


def test_misfit_falls_to_the_noise_on_trials_never_fitted_too(report):
    misfit = {row["channel"]: row for row in report.misfit()}
    for channel, noise in (("angle", 0.05), ("pressure_1", 0.4), ("pressure_2", 0.4)):
        row = misfit[channel]
        assert row["after"] == pytest.approx(noise, rel=0.15)
        assert row["held_out_after"] == pytest.approx(noise, rel=0.25)
        assert row["before"] > 2.0 * noise
        assert row["held_out_before"] > 2.0 * noise


def test_calibrated_rig_is_a_rig_and_says_where_its_numbers_are_from(report, rig):
    written = pamsim.load_rig(report.folder)
    expected = rig.with_parameters(dict(zip(PLANTED, report.fit.values.tolist(), strict=True)))
    np.testing.assert_allclose(written.model.actuator_user, expected.model.actuator_user, rtol=1e-9)
    entry = written.file.native["joint.shaft.damping"]
    assert entry.source == "identified by pamsim calibrate from recording"
    assert entry.interval95 == pytest.approx(report.parameters[2].interval95, rel=1e-4)
    untouched = written.file.muscle["valve"]["critical_ratio"]
    assert untouched.source == rig.file.muscle["valve"]["critical_ratio"].source


def test_a_calibration_sums_itself_up_and_saves_itself(report, tmp_path):
    text = report.summary()
    assert all(name in text for name in PLANTED)
    assert "converged: no parameter at a limit" in text
    folder, file = report.save(tmp_path / "saved")
    saved = json.loads(file.read_text(encoding="utf-8"))
    assert saved == {**report.to_dict(), "calibrated_rig": str(folder)}
    again, written = (pamsim.load_rig(f).model.actuator_user for f in (folder, report.folder))
    np.testing.assert_array_equal(again, written)
    assert len(pamsim.plot(report).axes) > 1


def test_a_start_read_from_one_noisy_sample_does_not_bias_the_fit(rig, tmp_path):
    """Valves shut for most of the trial: a wrong start would stay, and be taken for flow."""
    planted, rng = rig.with_parameters(PLANTED), np.random.default_rng(3)
    still = valves((0.0, 0.0), (0.3, -0.3), (0.0, 0.0), (0.0, 0.0))
    run = pamsim.simulate(planted, still).completed()
    trials = {}
    for i, off in enumerate((1.2e3, 0.8e3)):
        one = noisy(run, rng)
        one.pressure[0] += off  # first samples two and three standard deviations off
        trials[f"still_{i + 1}"] = one
    write_recording(tmp_path / "data", "mas20_arm", trials)
    without_forces(tmp_path / "data")
    free = list(PLANTED)[:2]
    found = calibrate([tmp_path / "data"], rig=planted, free=free).fit
    for parameter in found.parameters:
        assert parameter.value == pytest.approx(PLANTED[parameter.name], rel=0.01)
    assert found.noise["pressure_1"].rms == pytest.approx(PRESSURE_NOISE, rel=0.15)


def test_a_rig_of_coarse_steps_is_calibrated(recording):
    coarse = pamsim.load_rig("mas20_arm")
    coarse.model.opt.timestep = 1e-3  # other clocks, tried as mistakes, fall between its steps
    found = calibrate([recording], rig=coarse, free=["joint.shaft.damping"])
    assert found.fit.parameters[0].interval95 is not None


def test_coming_back_to_a_vector_with_other_starts_simulates_nothing_again(recording, rig):
    simulated = []
    problem = CalibrationProblem(
        rig,
        read_calibration_data([recording]).of_rig(rig),
        freed_parameters(rig, list(PLANTED)),
        simulated=lambda: simulated.append(1),
    )
    near, far = np.array(list(PLANTED.values())), 1.1 * np.array(list(PLANTED.values()))
    problem(np.array([near, far]))
    before = len(simulated)
    problem.linearise_starts(far)
    moved = len(simulated) - before
    assert moved == 2 * len(problem.predictor.experiments)  # one for each muscle's start
    (again,) = problem(far[np.newaxis])
    assert len(simulated) == before + moved
    fresh = CalibrationProblem(rig, problem.data, problem.freed)
    fresh.linearise_starts(far)
    (same,) = fresh(far[np.newaxis])
    for one, other in zip(again, same, strict=True):
        np.testing.assert_array_equal(one.residual, other.residual)


def test_result_does_not_hang_on_the_rig_it_starts_from(recording, rig, report):
    """What a wrong start pressure does is taken where the fit ends, not where it began."""
    start = rig.with_parameters(PLANTED)
    near = calibrate([recording], rig=start, free=list(PLANTED), hold_out=["fill"]).fit
    for one, other in zip(near.parameters, report.parameters, strict=True):
        low, high = one.interval95
        assert abs(one.value - other.value) < 0.05 * (high - low)


def test_what_angles_at_rest_cannot_show_is_named(rig, monkeypatch, capsys, tmp_path):
    """How fast the air flows leaves no trace once the arm rests: no number may be claimed."""
    rows = ["p1_kpa,p2_kpa,load_kg,angle_deg"]
    for high, low in ((400, 150), (300, 100)):
        step = pamsim.pressure_step((1e3 * high,) * 2, (1e3 * high, 1e3 * low), duration=6.0)
        angle = pamsim.simulate(rig, step).angle[-1] * DEG_PER_RAD
        rows.append(f"{high},{low},0,{angle + 0.02 * (-1) ** len(rows):.4f}")
    table = tmp_path / "rest.csv"
    table.write_text("\n".join(rows), encoding="utf-8")
    code, out, _ = run(
        monkeypatch, capsys, table, "--free", "valve.conductance_fill=valve.conductance_exhaust",
        "--free", "chamber.dead_volume", "--max-iterations", "3", "--json", tmp_path / "r.json",
    )  # fmt: skip
    assert code == 1
    assert "assumed: all muscles at the row's highest pressure" in out
    result = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert result["status"] != "converged"
    for parameter in result["parameters"]:
        assert parameter["flags"], parameter["name"]
        assert f"warning: {parameter['sentence']}" in out
        interval = parameter["interval95"]  # none, or all that was allowed
        assert interval is None or interval == pytest.approx(parameter["bounds"])
    assert result["parameters"][0]["tied"] == ["valve.conductance_exhaust"]
    measured = [row["measured_deg"] for row in result["trials"][0]["rows"]]
    assert measured == pytest.approx([float(row.split(",")[-1]) for row in rows[1:]])


def test_what_is_free_by_default_is_what_the_data_show(rig, tmp_path):
    """Valves play no part where the measured pressures drive."""
    made = pamsim.hide(
        rig, {}, protocols=("triangle",), duration=1.0, repeats=2, measured_drive=True
    )
    made.save(tmp_path / "data")
    found = pamsim.calibrate([tmp_path / "data"], max_iterations=2)
    names = {one.name for one in found.freed}
    assert "joint.shaft.damping" in names
    for valve in ("valve.conductance_fill", "valve.conductance_exhaust"):
        assert valve not in names
        assert f"{valve} stays as it is: these data do not show it" in found.notes


def test_resumed_equals_uninterrupted(recording, report, tmp_path):
    options = {"free": list(PLANTED), "hold_out": ["fill"], "out": tmp_path / "out"}
    whole = report.fit

    def interrupt(done, total, what):
        assert (total is None) == (what == "first simulations")
        assert total is None or total > done
        if "iteration 2" in what:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        calibrate([recording], **options, progress=interrupt)
    saved = json.loads((tmp_path / "out" / "checkpoint.json").read_text(encoding="utf-8"))
    assert saved["current"] is not None
    resumed = calibrate([recording], **options, resume=True).fit
    np.testing.assert_allclose(resumed.values, whole.values, rtol=1e-6)
    for one, other in zip(resumed.parameters, whole.parameters, strict=True):
        assert one.interval95 == pytest.approx(other.interval95, rel=1e-4)


def test_command_writes_rig_page_and_result(recording, monkeypatch, capsys, tmp_path):
    out_folder = tmp_path / "out"
    code, out, err = run(
        monkeypatch, capsys, recording, "--free", "joint.shaft.damping", "--channels", "angle",
        "--hold-out", "swing", "--out", out_folder, "--json", tmp_path / "r.json",
        "--bounds", "joint.shaft.damping=0.1:1", "--max-iterations", "3",
    )  # fmt: skip
    assert code in (0, 1), err
    assert "joint.shaft.damping" in out
    assert "note: force_1 was not measured" in out
    result = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert result["schema"] == "pamsim-calibrate/1"
    assert {row["channel"] for row in result["misfit"]} == {"angle"}
    assert result["parameters"][0]["written"]["bounds"] == pytest.approx([0.1, 1.0])
    assert (out_folder / "rig" / "params.toml").is_file()
    page = (out_folder / "index.html").read_text(encoding="utf-8")
    for name in ("parameters", "trials"):
        assert f'<figure id="{name}">' in page
        assert (out_folder / f"{name}.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--free", "valve.conductance_fil"], "did you mean 'valve.conductance_fill'"),
        (["--free", "joint.shft.damping"], "no joint 'shft'"),
        (["--free", "joint.shaft.frictionloss"], "give its range with --bounds"),
        (["--free", "passive.locking=chamber.dead_volume"], "one number cannot be both"),
        (["--free", "passive.locking,muscle_1:passive.locking"], "is free already"),
        (["--free", "passive.locking", "--bounds", "passive.locking=30"], "NAME=LOW:HIGH"),
        (["--free", "passive.locking", "--bounds", "passive.locking=1:2:3"], "NAME=LOW:HIGH"),
        (["--free", "passive.locking", "--bounds", "braid.diameter=1:2"], "it is not free"),
        (["--free", "passive.locking", "--bounds", "passive.locking=40:50"], "is outside"),
        (["--free", "passive.locking", "--profile", "force.scale"], "it is not free"),
        (["--hold-out", "swng"], "did you mean 'swing'"),
        (["--hold-out", "swing,fill"], "leaves nothing to fit"),
        (["--channels", "angel"], "did you mean 'angle'"),
        (["--rig", "mas30_arm"], "did you mean 'mas20_arm'"),
        (["--resume"], "--resume needs --out"),
        (["--threads", "0"], "0 threads"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(recording, monkeypatch, capsys, options, words):
    code, _, err = run(monkeypatch, capsys, recording, *options)
    assert code == 2
    assert words in err
    assert len(err.strip().splitlines()) == 1


def test_nothing_to_resume_and_no_data_are_said(recording, monkeypatch, capsys, tmp_path):
    code, _, err = run(monkeypatch, capsys, recording, "--resume", "--out", tmp_path)
    assert (code, "nothing to resume" in err) == (2, True)
    code, _, err = run(monkeypatch, capsys, tmp_path / "none.csv")
    assert (code, "cannot read" in err) == (2, True)
    code, _, err = run(monkeypatch, capsys, recording, recording)
    assert (code, "is given twice" in err) == (2, True)
