"""``pamsim calibrate``: planted rigs come back, what data cannot show is said, nothing is lost."""

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
from pamsim.comparison.trial_prediction import TrialPredictor
from pamsim.core.errors import InputError
from pamsim.core.units import DEG_PER_RAD
from pamsim.recordings.recording import write_recording

ANGLE_NOISE, PRESSURE_NOISE = 0.05 / DEG_PER_RAD, 400.0
PLANTED = {
    "valve.conductance_fill": 6.1e-10,
    "valve.conductance_exhaust": 4.7e-10,
    "joint.shaft.damping": 0.4,
}


@pytest.fixture
def run(run):
    return lambda *words: run("calibrate", *words)


def valves(*openings):
    """A trial that holds each pair of valve openings for 0.25 s."""
    return pamsim.Experiment(
        drive="valve",
        command_time=0.25 * np.arange(len(openings)),
        command_value=np.array(openings),
        start_pressure=np.array([2.5e5, 2.5e5]),
        duration=0.25 * len(openings),
        sample_rate=100.0,
        settle=1.0,
    )


def noisy(recording, rng):
    count, muscles = recording.pressure.shape
    return dataclasses.replace(
        recording.with_angle(recording.angle + rng.normal(0.0, ANGLE_NOISE, count)),
        pressure=recording.pressure + rng.normal(0.0, PRESSURE_NOISE, (count, muscles)),
    )


def written(folder, trials):
    """A recording without its forces."""
    write_recording(folder, "mas20_arm", trials)
    for path in folder.glob("*.csv"):
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        keep = [i for i, name in enumerate(rows[0]) if not name.startswith("force")]
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([[row[i] for i in keep] for row in rows])
    return folder


@pytest.fixture(scope="module")
def recording(rig, tmp_path_factory):
    """Two trials of one protocol and one of another, of a rig with other valves and damping."""
    planted, rng = rig.with_parameters(PLANTED), np.random.default_rng(7)
    swing = valves((0.4, -0.5), (0.0, 0.0), (-0.6, 0.5), (0.0, 0.2))
    fill = valves((0.5, 0.3), (-0.2, 0.0), (0.0, -0.6), (0.2, 0.2))
    swung, filled = (pamsim.simulate(planted, one).completed() for one in (swing, fill))
    trials = {"swing_1": swung, "swing_2": swung, "fill_1": filled}
    trials = {name: noisy(run, rng) for name, run in trials.items()}
    return written(tmp_path_factory.mktemp("data") / "recording", trials)


@pytest.fixture(scope="module")
def report(recording, tmp_path_factory):
    return calibrate(
        [recording], free=list(PLANTED), hold_out=["fill"], out=tmp_path_factory.mktemp("out") / "o"
    )


def test_planted_parameters_are_recovered_within_intervals_down_to_the_noise(report):
    assert report.status == "converged"
    for parameter in report.parameters:
        low, high = parameter.interval95
        assert low < PLANTED[parameter.name] < high
        assert high - low < 0.1 * parameter.value  # and the intervals say something
    misfit = {row["channel"]: row for row in report.misfit()}
    for channel, noise in (("angle", 0.05), ("pressure_1", 0.4), ("pressure_2", 0.4)):
        row = misfit[channel]
        assert row["after"] == pytest.approx(noise, rel=0.15)
        assert row["held_out_after"] == pytest.approx(noise, rel=0.25)
        assert min(row["before"], row["held_out_before"]) > 2.0 * noise


def test_a_calibrated_rig_is_a_rig_and_says_where_its_numbers_are_from(report, rig, tmp_path):
    written = pamsim.load_rig(report.folder)
    expected = rig.with_parameters(dict(zip(PLANTED, report.fit.values.tolist(), strict=True)))
    np.testing.assert_allclose(written.model.actuator_user, expected.model.actuator_user, rtol=1e-9)
    entry = written.file.native["joint.shaft.damping"]
    assert entry.source == "identified by pamsim calibrate from recording"
    assert entry.interval95 == pytest.approx(report.parameters[2].interval95, rel=1e-4)
    untouched = written.file.muscle["valve"]["critical_ratio"]
    assert untouched.source == rig.file.muscle["valve"]["critical_ratio"].source
    text = report.summary()
    assert all(name in text for name in PLANTED)
    assert "converged: no parameter at a limit" in text
    folder, file = report.save(tmp_path / "saved")
    saved = json.loads(file.read_text(encoding="utf-8"))
    assert saved == {**report.to_dict(), "calibrated_rig": str(folder)}
    again = pamsim.load_rig(folder).model.actuator_user
    np.testing.assert_array_equal(again, written.model.actuator_user)


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
    free = list(PLANTED)[:2]
    found = calibrate([written(tmp_path / "data", trials)], rig=planted, free=free).fit
    for parameter in found.parameters:
        assert parameter.value == pytest.approx(PLANTED[parameter.name], rel=0.01)
    assert found.noise["pressure_1"].rms == pytest.approx(PRESSURE_NOISE, rel=0.15)


def test_coming_back_to_a_vector_with_other_starts_simulates_nothing_again(recording, rig):
    simulated = []
    data, freed = read_calibration_data([recording]).of_rig(rig), freed_parameters(rig, [*PLANTED])
    predictor = TrialPredictor(rig, data, simulated=lambda: simulated.append(1))
    problem = CalibrationProblem(predictor, freed)
    near = np.array(list(PLANTED.values()))
    far = 1.1 * near
    problem(np.array([near, far]))
    before = len(simulated)
    problem.linearise_starts(far)
    moved = len(simulated) - before
    assert moved == 2 * len(predictor.experiments)  # one for each muscle's start
    (again,) = problem(far[np.newaxis])
    assert len(simulated) == before + moved
    fresh = CalibrationProblem(TrialPredictor(rig, data), freed)
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


def test_what_angles_at_rest_cannot_show_is_named(rig, run, tmp_path):
    """How fast the air flows leaves no trace once the arm rests: no number may be claimed."""
    rows = ["p1_kpa,p2_kpa,load_kg,angle_deg"]
    for high, low in ((400, 150), (300, 100)):
        step = pamsim.pressure_step((1e3 * high,) * 2, (1e3 * high, 1e3 * low), duration=6.0)
        angle = pamsim.simulate(rig, step).angle[-1] * DEG_PER_RAD
        rows.append(f"{high},{low},0,{angle + 0.02 * (-1) ** len(rows):.4f}")
    table, file = tmp_path / "rest.csv", tmp_path / "r.json"
    table.write_text("\n".join(rows), encoding="utf-8")
    code, out, _ = run(
        table, "--free", "valve.conductance_fill=valve.conductance_exhaust",
        "--free", "chamber.dead_volume", "--max-iterations", "3", "--json", file,
    )  # fmt: skip
    assert code == 1
    assert "assumed: all muscles at the row's highest pressure" in out
    result = json.loads(file.read_text(encoding="utf-8"))
    assert result["status"] != "converged"
    for parameter in result["parameters"]:
        assert parameter["flags"], parameter["name"]
        assert f"warning: {parameter['sentence']}" in out
        interval = parameter["interval95"]  # none, or all that was allowed
        assert interval is None or interval == pytest.approx(parameter["bounds"])
    assert result["parameters"][0]["tied"] == ["valve.conductance_exhaust"]
    measured = [row["measured_deg"] for row in result["trials"][0]["rows"]]
    assert measured == pytest.approx([float(row.split(",")[-1]) for row in rows[1:]])


def test_before_a_fit_each_muscle_has_its_own_number(rig, tmp_path):
    """The rig that made a recording misses nothing, even if the fit frees one number for both."""
    weak = rig.with_parameters({"muscle_2:force.scale": 0.7})
    step = pamsim.pressure_step((3e5, 3e5), (3e5, 2e5), duration=0.3)
    pamsim.simulate(weak, step).save(tmp_path / "data", rig="mas20_arm")
    for free in ("force.scale", "muscle_1:force.scale=muscle_2:force.scale"):
        found = calibrate([tmp_path / "data"], rig=weak, free=[free], max_iterations=1)
        assert max(row["before"] for row in found.misfit()) < 1e-3
        assert any("force.scale" in note and "one number" in note for note in found.notes)


def test_a_single_recording_needs_no_list():
    with pytest.raises(InputError, match="no data at nowhere"):
        calibrate("nowhere")


def test_what_is_free_by_default_is_what_the_data_show(rig, tmp_path):
    """Valves play no part where the measured pressures drive."""
    triangle = {"protocols": ("triangle",), "duration": 0.6, "repeats": 2, "measured_drive": True}
    pamsim.hide(rig, {}, **triangle).save(tmp_path / "data")
    found = pamsim.calibrate([tmp_path / "data"], max_iterations=1)
    names = {one.name for one in found.freed}
    assert "joint.shaft.damping" in names
    for valve in ("valve.conductance_fill", "valve.conductance_exhaust"):
        assert valve not in names
        assert f"{valve} stays as it is: these data do not show it" in found.notes


def test_resumed_equals_uninterrupted(recording, rig, tmp_path):
    start = rig.with_parameters({name: 1.5 * value for name, value in PLANTED.items()})
    options = {"rig": start, "free": list(PLANTED), "hold_out": ["fill"]}
    whole = calibrate([recording], **options).fit
    options["out"] = tmp_path / "out"

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


def test_command_writes_rig_page_and_result(recording, run, tmp_path):
    folder, file = tmp_path / "out", tmp_path / "r.json"
    code, out, err = run(
        recording, "--free", "joint.shaft.damping", "--channels", "angle", "--hold-out", "swing",
        "--out", folder, "--json", file, "--bounds", "joint.shaft.damping=0.1:1",
        "--max-iterations", "3",
    )  # fmt: skip
    assert code in (0, 1), err
    assert "joint.shaft.damping" in out
    assert "note: force_1 was not measured" in out
    result = json.loads(file.read_text(encoding="utf-8"))
    assert result["schema"] == "pamsim-calibrate/1"
    assert {row["channel"] for row in result["misfit"]} == {"angle"}
    assert result["parameters"][0]["written"]["bounds"] == pytest.approx([0.1, 1.0])
    assert (folder / "rig" / "params.toml").is_file()
    page = (folder / "index.html").read_text(encoding="utf-8")
    for name in ("parameters", "trials"):
        assert f'<figure id="{name}">' in page
        assert (folder / f"{name}.png").stat().st_size > 10_000


def test_bad_input_is_one_line_and_exit_2(recording, run, tmp_path):
    locking = "DATA --free passive.locking"
    for line, words in (
        ("DATA --free valve.conductance_fil", "did you mean 'valve.conductance_fill'"),
        ("DATA --free joint.shft.damping", "no joint 'shft'"),
        ("DATA --free joint.shaft.armature", "give one with --bounds"),
        ("DATA --free passive.locking=chamber.dead_volume", "one number cannot be both"),
        (f"{locking},muscle_1:passive.locking", "is free already"),
        (f"{locking} --bounds passive.locking=30", "NAME=LOW:HIGH"),
        (f"{locking} --bounds passive.locking=1:2:3", "NAME=LOW:HIGH"),
        (f"{locking} --bounds braid.diameter=1:2", "it is not free"),
        (f"{locking}{2 * ' --bounds passive.locking=1:90'}", "has a range already"),
        (f"{locking} --bounds passive.locking=40:50", "is outside"),
        (f"{locking} --profile force.scale", "it is not free"),
        ("DATA --hold-out swng", "did you mean 'swing'"),
        ("DATA --hold-out swing,fill", "leaves nothing to fit"),
        ("DATA --channels angel", "did you mean 'angle'"),
        ("DATA --rig mas30_arm", "did you mean 'mas20_arm'"),
        ("DATA --resume", "--resume needs --out"),
        ("DATA --resume --out EMPTY", "nothing to resume"),
        ("DATA --threads 0", "0 threads"),
        ("DATA DATA", "is given twice"),
        ("none.csv", "give the folder of a recording, as `pamsim import`"),
    ):
        places = {"DATA": recording, "EMPTY": tmp_path}
        code, _, err = run(*(places.get(word, word) for word in line.split()))
        assert code == 2, line
        assert words in err
        assert len(err.strip().splitlines()) == 1
