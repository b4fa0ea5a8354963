"""``pamsim identify`` from a planted plant to its numbers, and from each mistake to one line."""

import csv
import json

import numpy as np
import pytest
from scipy.signal import lfilter

import pamsim
from pamsim.core.errors import InputError
from pamsim.recordings.recording import Outcome, Recording, write_recording
from tests.typed_command import run as command
from tests.unit.identification.planted import FEW, lags, log, sampled, steps
from tests.unit.report.page_laws import check_page

GAIN, FAST, SLOW = 0.05, 0.08, 0.5  # deg/kPa, s, s
RATE, FINE = 50.0, 20
# Where discrete models and dead times are not what a test is about.
SMALL = ("--arx", "1,1,1", "--oe", "1,1,1")
PLAIN = ("--dead-time", "none", *SMALL)


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Runs the command: its exit code, output, errors and result."""

    def run(*words):
        file = tmp_path / "result.json"
        code, out, err = command(monkeypatch, capsys, "identify", *words, "--json", file, "--force")
        return code, out, err, json.loads(file.read_text()) if file.exists() else None

    return run


def response(difference, delay=0.0):
    """Two lags on a held input, computed on a finer grid."""
    y = np.repeat(difference - difference[0], FINE)
    y = np.concatenate([np.zeros(round(delay * RATE * FINE)), y])[: y.size]
    for constant in (FAST, SLOW):
        pole = np.exp(-1.0 / (RATE * FINE * constant))
        y = lfilter([0.0, 1.0 - pole], [1.0, -pole], y)
    return GAIN * y[::FINE]


def trial(difference, seed, *, load=0.0, delay=0.0):
    draw = np.random.default_rng(seed)
    command = np.column_stack([300.0 + difference / 2, 300.0 - difference / 2]) * 1e3
    noise = lfilter([1.0], [1.0, -0.5], 0.03 * draw.normal(size=difference.size))
    return Recording(
        time=np.arange(difference.size) / RATE,
        joints={"shaft": "angle"},
        positions=np.radians(response(difference, delay) + noise + 2.0)[:, np.newaxis],
        velocities=np.zeros((difference.size, 1)),
        pressure=command + 200.0 * draw.normal(size=command.shape),
        tension=np.full(command.shape, 100.0),
        command=command,
        drive="pressure_set",
        load=load,
        muscles=("muscle_1", "muscle_2"),
        outcome=Outcome.COMPLETED,
        message="",
        final_state=np.zeros(1),
    )


def telegraph(seed, holds=30):
    levels = np.random.default_rng(seed).choice([-120.0, 120.0], holds)
    return np.concatenate([np.full(20, -120.0), np.repeat(levels, 20)])


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planted")
    stairs = np.repeat([0.0, 100.0, 200.0, 100.0, 0.0], round(2.5 * RATE))
    trials = {
        "telegraph_1": trial(telegraph(1), 1, load=1.2),
        "telegraph_2": trial(telegraph(2), 2, load=1.2),
        "staircase_1": trial(stairs, 3),
    }
    write_recording(folder, "mas20_arm", trials)
    return folder


def test_a_planted_plant_is_found_and_recommended(run, recording, tmp_path):
    out = tmp_path / "page"
    held = ("--protocol", "telegraph", "--hold-out", "telegraph_2")
    code, text, err, result = run(recording, *held, "--out", out)
    assert (code, err) == (0, "")
    assert (result["schema"], result["recommended"]) == ("pamsim-identify/4", "second_order")
    assert "held-out" in result["reason"]
    assert [t["role"] for t in result["trials"]] == ["fitted", "held_out"]
    models = {model["name"]: model for model in result["models"]}
    best = models["second_order"]
    planted = {"K": GAIN, "T1": FAST, "T2": SLOW}
    assert set(best["parameters"]) == set(planted)
    for key, value in planted.items():
        low, high = best["parameters"][key]["interval95"]
        # Wider than 95 % by half: one draw of the noise may miss by more than its interval.
        slack = 0.25 * (high - low)
        assert low - slack < value < high + slack, key
        assert high - low < 0.1 * value, key
    assert best["independence"]["independent"]
    assert not models["first_order"]["independence"]["independent"]
    assert models["first_order"]["aicc_above_best"] > 10.0
    assert best["fit_percent_held_out"] == pytest.approx(best["fit_percent"], abs=1.0)
    # Noise of the planted deviation is what the best model leaves.
    assert best["held_out"][0]["rms"] == pytest.approx(0.03 / np.sqrt(0.75), rel=0.1)
    assert best["poles_rad_per_s"][0][0] == pytest.approx(-1.0 / SLOW, rel=0.02)
    assert {"arx_1_1_1", "arx_2_2_1", "oe_1_1_1", "oe_2_2_1"} <= set(models)
    assert (models["arx_2_2_1"]["delay_samples"], best["delay_samples"]) == (1, None)
    assert "* second_order" in text
    page = (out / "index.html").read_text(encoding="utf-8")
    check_page(page)
    assert page.count("<img") == 4
    assert {path.stem for path in out.glob("*.png")} == {"bode", "fit", "scan", "step"}
    header, *rows = (out / "curves.csv").read_text().splitlines()
    assert header == "trial,time_s,input_kpa,output_deg,model_deg"
    assert len(rows) == sum(t["samples"] for t in result["trials"])
    columns = np.array([[float(cell) for cell in row.split(",")[1:]] for row in rows]).T
    assert set(columns[1]) == {-120.0, 120.0}
    np.testing.assert_allclose(columns[2], columns[3], atol=0.3)
    assert np.ptp(columns[2]) > 5.0


def test_a_dead_time_is_found_where_there_is_one(run, tmp_path):
    folder = tmp_path / "data"
    write_recording(folder, "mas20_arm", {"a_1": trial(telegraph(5, 15), 5, delay=0.07)})
    code, _, _, result = run(folder, "--order", "2", "--poles", "real", *SMALL)
    assert (code, result["recommended"]) == (0, "second_order_dead_time")
    assert [m["name"] for m in result["models"]][:2] == ["second_order", "second_order_dead_time"]
    found = result["models"][1]["parameters"]["L"]["value"]
    assert found == pytest.approx(0.07, abs=0.01)


def test_each_step_of_a_staircase_is_an_operating_point(run, recording):
    code, text, _, result = run(recording, "--trial", "staircase_1", "--order", "1", *PLAIN)
    assert (code, "4 operating points" in text) == (0, True)
    models, dependences = result["local"]["models"], result["local"]["dependences"]
    assert [model["direction"] for model in models] == [1, 1, -1, -1]
    for model in models:
        assert model["pressure_kpa"] == pytest.approx(300.0, abs=2.0)
        assert model["amplitude"] == pytest.approx(50.0)
        assert model["parameters"]["K"]["value"] == pytest.approx(GAIN, rel=0.1)
    means = {item["parameter"]: item["mean"] for item in dependences}
    assert set(means) == {"K", "T"}
    assert means["K"] == pytest.approx(GAIN, rel=0.1)


def test_a_plain_log_of_any_columns_is_identified(run, tmp_path):
    drive = telegraph(7, 15)
    columns = (np.arange(drive.size) / RATE + 3.0, drive / 24.0, response(drive) * 0.1)
    path = log(tmp_path / "scope.csv", "time_s,drive_v,height_mm", *columns)
    asked = ("--input", "drive_v", "--output", "height_mm", "--order", "2")
    code, text, _, result = run(path, *asked, *PLAIN)
    assert (code, "assumed constant from each row to the next: drive_v" in text) == (0, True)
    best = result["models"][0]["parameters"]
    assert best["K"]["value"] == pytest.approx(GAIN * 0.1 * 24.0, rel=0.01)
    assert best["K"]["unit"] == "mm/V"
    assert best["T2"]["value"] == pytest.approx(SLOW, rel=0.01)


def test_a_table_beside_a_recording_need_not_begin_at_rest(recording, tmp_path):
    drive = telegraph(7, 15)
    columns = (np.arange(drive.size) / RATE, 300.0 + drive / 2, 300.0 - drive / 2, response(drive))
    path = log(tmp_path / "log.csv", "time_s,p1_set_kpa,p2_set_kpa,angle_deg", *columns)
    for data, start in ((recording, "rest"), ([recording, path], "free")):
        assert pamsim.identify(data, **FEW).shown.fit.structure.start == start


def test_tables_without_a_clock_are_fitted_together(run, tmp_path):
    for name, seed in (("day", 7), ("night", 8)):
        drive = telegraph(seed, 20)
        rows = zip(drive, response(drive), strict=True)
        lines = [f"{u:.3f};{y:.6f}".replace(".", ",") for u, y in rows]
        (tmp_path / f"{name}.csv").write_text("\n".join(["Power (V);T out", *lines]) + "\n")
    asked = (tmp_path / "day.csv", tmp_path / "night.csv", "--order", "1", "--no-local", *PLAIN)
    code, text, err, result = run(*asked, "--dt", "0.02 min", "--hold-out", "night")
    assert (code, err) == (0, "")
    assert "Power (V) is taken as the input and T out as the output" in text
    assert [(t["name"], t["role"]) for t in result["trials"]] == [
        ("day", "fitted"), ("night", "held_out")
    ]  # fmt: skip
    assert result["trials"][0]["sample_s"] == pytest.approx(1.2)
    code, text, err, result = run(*asked, "--dt", "0.02 min", "--hold-out", "30%")
    assert (code, err, "2 trial(s) fitted, 2 held out" in text) == (0, "", True)
    assert [t["samples"] for t in result["trials"]] == [294, 294, 126, 126]


def test_a_frequency_response_is_fitted_as_one(run, tmp_path):
    w, out = np.geomspace(0.1, 100.0, 30), tmp_path / "out"
    size = 20.0 * np.log10(2.0 / np.hypot(1.0, 0.3 * w))
    columns = (w, size, -np.degrees(np.arctan(0.3 * w)))
    path = log(tmp_path / "bode.csv", "omega_rad_s,magnitude_db,phase_deg", *columns)
    code, text, err, result = run(path, "--order", "1", "--out", out)
    assert (code, err) == (0, "")
    assert "* order_1: fits 100.00 %" in text
    assert result["models"][0]["parameters"]["T"]["value"] == pytest.approx(0.3, rel=1e-3)
    assert (out / "curves.csv").is_file()
    assert (out / "bode.png").read_bytes()[:4] == b"\x89PNG"
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "<dt>T</dt><dd><b>0.3000 s</b>" in page
    check_page(page)
    code, _, err, _ = run(path, "--dt", "2s")
    assert (code, "--dt is for trials" in err) == (2, True)


def test_no_model_that_can_be_trusted_is_a_finding(run, tmp_path):
    folder = tmp_path / "data"
    write_recording(folder, "mas20_arm", {"a_1": trial(telegraph(9, 10), 9)})
    code, text, _, _ = run(folder, "--order", "3", "--poles", "real", *PLAIN)
    assert (code, "recommended: none" in text) == (1, True)


TS, N = 0.05, 800
GAINS, CONSTANT = (0.02, -3.0), 0.4  # deg per kPa, deg per V


@pytest.fixture(scope="module")
def two_inputs(tmp_path_factory):
    """Of two inputs, with columns that follow from them or stand still."""
    rng = np.random.default_rng(1)
    pressure, voltage = 100.0 * steps(rng, N, 20), 2.0 * steps(rng, N, 31)
    angle = 4.0 + sum(
        sampled([gain], lags(CONSTANT), u, TS)
        for gain, u in zip(GAINS, (pressure, voltage), strict=True)
    )
    angle = angle + 0.05 * rng.standard_normal(N)
    header = "time_s,supply_kpa,fan_v,twice_v,still_v,angle_deg"
    columns = (TS * np.arange(N), pressure, voltage, 2.0 * voltage, np.full(N, 7.0), angle)
    return log(tmp_path_factory.mktemp("log") / "log.csv", header, *columns)


def test_several_inputs_have_the_numbers_of_their_columns_everywhere(two_inputs, run, tmp_path):
    out = tmp_path / "out"
    inputs = ("--input", "supply_kpa", "--input", "fan_v")
    asked = (*inputs, "--order", "1", "--dead-time", "none")
    code, text, err, content = run(two_inputs, *asked, "--out", out)
    assert (code, err) == (0, "")
    assert "angle_deg from [1] supply_kpa, [2] fan_v: 1 trial(s) fitted" in text
    assert [into["expression"] for into in content["inputs"]] == ["supply_kpa", "fan_v"]
    (model,) = (m for m in content["models"] if m["name"] == content["recommended"])
    for name, value, unit in (
        ("K[1]", GAINS[0], "deg/kPa"),
        ("K[2]", GAINS[1], "deg/V"),
        ("T", CONSTANT, "s"),
    ):
        shown = model["parameters"][name]
        assert shown["unit"] == unit
        assert shown["interval95"][0] < value < shown["interval95"][1], name
    assert not [m["name"] for m in content["models"] if m["kind"] != "continuous"]
    assert "Frequency response to [2] fan_v." in (out / "index.html").read_text()
    assert {"bode_1.png", "bode_2.png"} <= {path.name for path in out.iterdir()}
    with (out / "curves.csv").open() as file:
        header, first = list(csv.reader(file))[:2]
    assert header == ["trial", "time_s", "input1_kpa", "input2_v", "output_deg", "model_deg"]
    assert len(first) == len(header)


def test_python_control_gets_gains_per_unit_of_each_column(two_inputs):
    found = pamsim.identify(two_inputs, input=["supply_kpa", "fan_v"], order=1, dead_time="none")
    assert found.transfer_function().dcgain() == pytest.approx(np.array([GAINS]), rel=0.02)
    si = found.transfer_function(si=True).dcgain()
    per_si = np.array([[GAINS[0] * np.pi / 180e3, GAINS[1] * np.pi / 180.0]])
    assert si == pytest.approx(per_si, rel=0.02)
    assert found.local is None
    for inputs, more, mend in (
        (["fan_v", "twice_v"], {}, "'twice_v' follows from fan_v: .* omit one of them"),
        (["fan_v", "still_v"], {}, "'still_v' never changes"),
        (["fan_v", "angle_deg"], {}, "share a column"),
        (["fan_v", "supply_kpa"], {"arx": (1, 1, 1)}, "models of one input"),
        (["fan_v"], {"arx": (1, 1)}, "`arx` = .*: give three whole numbers"),
    ):
        with pytest.raises(InputError, match=mend):
            pamsim.identify(two_inputs, input=inputs, output="angle_deg", order=1, **more)


def test_the_rate_of_an_integrating_output_is_in_its_unit(tmp_path):
    rng = np.random.default_rng(2)
    u = np.column_stack([steps(rng, N, 20), steps(rng, N, 31)])
    u = u - np.mean(u, axis=0)
    way = sum(sampled([8.0], [CONSTANT, 1.0, 0.0], u[:, i], TS) for i in range(2))
    way = way + 5.0 * TS * np.arange(N) + 0.05 * rng.standard_normal(N)
    columns = (TS * np.arange(N), *u.T, way)
    path = log(tmp_path / "way.csv", "time_s,a_v,b_v,way_mm", *columns)
    found = pamsim.identify(path, input=["a_v", "b_v"], output="way_mm", order=1, integrators=1)
    parameters = found.to_dict()["models"][0]["parameters"]
    for name, unit, value in (("r0", "mm/s", 5.0), ("K[2]", "mm/V/s", 8.0)):
        assert parameters[name]["unit"] == unit
        assert parameters[name]["value"] == pytest.approx(value, rel=0.02)


def test_bad_input_is_one_clear_line_and_exit_2(monkeypatch, capsys, recording, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.chdir(tmp_path)
    for line, expected in (
        ("", "give DATA, or --simulate"),
        ("nowhere", "no recording at nowhere"),
        ("nowhere.csv", "cannot read nowhere.csv"),
        ("DATA --simulate mas20_arm", "--simulate describes a simulated"),
        ("DATA --load 1", "--load describes a simulated step"),
        ("--simulate mas21_arm", "did you mean 'mas20_arm'"),
        ("--simulate mas20_arm --pressure 300", "the drive has 1"),
        ("DATA --trial telegraph_3", "did you mean 'telegraph_"),
        ("DATA --protocol stairs", "did you mean 'staircase'"),
        ("DATA --hold-out x", "--hold-out: 'x' is not in the data"),
        ("DATA --hold-out 130%", "--hold-out = 1.3 is no share"),
        ("DATA --dt 2s", "--dt is for tables"),
        ("DATA --trial staircase_1 --hold-out staircase_1", "no trial is left"),
        ("DATA --input p1_bar", "no column 'p1_bar'"),
        ("DATA --output angle_deg+p1_kpa", "use columns of one unit"),
        ("DATA --input angle_deg", "share a column"),
        ("DATA --input u1-u2", "no column 'u1'"),
        ("DATA --order 9", "give 0 to 6"),
        ("DATA --zeros 1", "--zeros needs --order"),
        ("DATA --order 2 --zeros 3", "zeros = 3 of 2 poles"),
        ("DATA --dead-time fre", "did you mean 'free'"),
        ("DATA --poles complex", "--poles 'complex' is not known"),
        ("DATA --initial-state fre", "did you mean 'free'"),
        ("DATA --arx 2,2", "write three whole numbers"),
        ("DATA --order 1 --out file", "cannot write"),
    ):
        words = [recording if word == "DATA" else word for word in line.split()]
        code, out, err = command(monkeypatch, capsys, "identify", *words)
        assert (code, out) == (2, ""), line  # nothing is computed first
        assert expected in err
        assert len(err.strip().splitlines()) == 1
