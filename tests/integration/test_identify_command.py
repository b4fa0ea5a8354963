"""``pamsim identify`` from a planted plant to its numbers, and from each mistake to one line."""

from __future__ import annotations

import json
from html.parser import HTMLParser

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.recordings.recording import Outcome, Recording, write_recording
from tests.typed_command import run as command
from tests.unit.report.page_laws import check_page

GAIN, FAST, SLOW = 0.05, 0.08, 0.5  # deg/kPa, s, s
RATE = 50.0
FINE = 20
SMALL = ("--arx", "1,1,1", "--oe", "1,1,1")  # where discrete models are not what a test is about


def run(monkeypatch, capsys, *args):
    return command(monkeypatch, capsys, "identify", *args)


def response(difference, delay=0.0):
    """Two lags on a held input, computed on a finer grid."""
    y = np.repeat(difference - difference[0], FINE)
    skipped = round(delay * RATE * FINE)
    y = np.concatenate([np.zeros(skipped), y])[: y.size]
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


STAIRS = np.repeat([0.0, 100.0, 200.0, 100.0, 0.0], round(2.5 * RATE))


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planted")
    trials = {
        "telegraph_1": trial(telegraph(1), 1, load=1.2),
        "telegraph_2": trial(telegraph(2), 2, load=1.2),
        "staircase_1": trial(STAIRS, 3),
    }
    write_recording(folder, "mas20_arm", trials)
    return folder


class Page(HTMLParser):
    """Tags that open and close as they should, and the images."""

    def __init__(self, text):
        super().__init__()
        self.open, self.images = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag == "img":
            self.images.append(dict(attrs)["src"])
        elif tag not in ("meta", "br", "wbr"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_a_planted_plant_is_found_and_recommended(monkeypatch, capsys, recording, tmp_path):
    out = tmp_path / "page"
    args = (recording, "--protocol", "telegraph", "--hold-out", "telegraph_2")
    code, text, err = run(
        monkeypatch, capsys, *args, "--out", out, "--json", tmp_path / "result.json"
    )
    assert (code, err) == (0, "")
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["schema"] == "pamsim-identify/4"
    assert result["recommended"] == "second_order"
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
    page = Page((out / "index.html").read_text(encoding="utf-8"))
    assert page.open == []
    assert sorted(path.name for path in out.glob("*.png")) == [
        "bode.png", "fit.png", "scan.png", "step.png"
    ]  # fmt: skip
    assert len(page.images) == 4
    rows = (out / "curves.csv").read_text().splitlines()
    assert rows[0] == "trial,time_s,input_kpa,output_deg,model_deg"
    assert len(rows) == 1 + sum(t["samples"] for t in result["trials"])
    columns = np.array([[float(cell) for cell in row.split(",")[1:]] for row in rows[1:]]).T
    assert set(columns[1]) == {-120.0, 120.0}
    np.testing.assert_allclose(columns[2], columns[3], atol=0.3)
    assert np.ptp(columns[2]) > 5.0


def test_a_dead_time_is_found_where_there_is_one(monkeypatch, capsys, tmp_path):
    write_recording(tmp_path, "mas20_arm", {"a_1": trial(telegraph(5, 15), 5, delay=0.07)})
    json_file = tmp_path / "r.json"
    code, _, _ = run(
        monkeypatch,
        capsys,
        tmp_path,
        "--order",
        "2",
        "--poles",
        "real",
        *SMALL,
        "--json",
        json_file,
    )
    result = json.loads(json_file.read_text())
    assert code == 0
    assert [m["name"] for m in result["models"]][:2] == ["second_order", "second_order_dead_time"]
    assert result["recommended"] == "second_order_dead_time"
    best = result["models"][1]["parameters"]
    assert best["L"]["value"] == pytest.approx(0.07, abs=0.01)


def test_each_step_of_a_staircase_is_an_operating_point(monkeypatch, capsys, recording, tmp_path):
    json_file = tmp_path / "r.json"
    code, text, _ = run(
        monkeypatch, capsys, recording, "--trial", "staircase_1", "--order", "1",
        "--dead-time", "none", *SMALL, "--json", json_file,
    )  # fmt: skip
    assert code == 0
    assert "4 operating points" in text
    local = json.loads(json_file.read_text())["local"]
    assert [model["direction"] for model in local["models"]] == [1, 1, -1, -1]
    for model in local["models"]:
        assert model["pressure_kpa"] == pytest.approx(300.0, abs=2.0)
        assert model["amplitude"] == pytest.approx(50.0)
        assert model["parameters"]["K"]["value"] == pytest.approx(GAIN, rel=0.1)
    assert {item["parameter"] for item in local["dependences"]} == {"K", "T"}
    gain = next(item for item in local["dependences"] if item["parameter"] == "K")
    assert gain["mean"] == pytest.approx(GAIN, rel=0.1)


def test_a_plain_log_of_any_columns_is_identified(monkeypatch, capsys, tmp_path):
    drive = telegraph(7, 15)
    path = tmp_path / "scope.csv"
    rows = zip(np.arange(drive.size) / RATE + 3.0, drive / 24.0, response(drive) * 0.1, strict=True)
    lines = [f"{t:.4f},{u:.3f},{y:.6f}" for t, u, y in rows]
    path.write_text("\n".join(["time_s,drive_v,height_mm", *lines]) + "\n")
    json_file = tmp_path / "r.json"
    code, text, _ = run(
        monkeypatch, capsys, path, "--input", "drive_v", "--output", "height_mm",
        "--order", "2", "--dead-time", "none", *SMALL, "--json", json_file,
    )  # fmt: skip
    assert code == 0
    assert "held from row to row: drive_v" in text
    best = json.loads(json_file.read_text())["models"][0]["parameters"]
    assert best["K"]["value"] == pytest.approx(GAIN * 0.1 * 24.0, rel=0.01)
    assert best["K"]["unit"] == "mm/V"
    assert best["T2"]["value"] == pytest.approx(SLOW, rel=0.01)


def test_tables_without_a_clock_are_fitted_together(monkeypatch, capsys, tmp_path):
    for name, seed in (("day", 7), ("night", 8)):
        drive = telegraph(seed, 20)
        rows = zip(drive, response(drive), strict=True)
        lines = [f"{u:.3f};{y:.6f}".replace(".", ",") for u, y in rows]
        (tmp_path / f"{name}.csv").write_text("\n".join(["Power (V);T out", *lines]) + "\n")
    json_file = tmp_path / "r.json"
    shared = ("--order", "1", "--dead-time", "none", *SMALL, "--no-local", "--dt", "0.02 min")
    tables = (tmp_path / "day.csv", tmp_path / "night.csv")
    code, text, err = run(
        monkeypatch, capsys, *tables, "--hold-out", "night", *shared, "--json", json_file
    )
    assert (code, err) == (0, "")
    assert "Power (V) is taken as the input and T out as the output" in text
    trials = json.loads(json_file.read_text())["trials"]
    assert [(t["name"], t["role"]) for t in trials] == [("day", "fitted"), ("night", "held_out")]
    assert trials[0]["sample_s"] == pytest.approx(1.2)
    code, text, err = run(
        monkeypatch, capsys, *tables, "--hold-out", "30%", *shared, "--json", json_file, "--force"
    )
    assert (code, err) == (0, "")
    assert "2 trial(s) fitted, 2 held out" in text
    trials = json.loads(json_file.read_text())["trials"]
    assert [t["samples"] for t in trials] == [294, 294, 126, 126]


def test_a_frequency_response_is_fitted_as_one(monkeypatch, capsys, tmp_path):
    w = np.geomspace(0.1, 100.0, 30)
    size = 20.0 * np.log10(2.0 / np.hypot(1.0, 0.3 * w))
    rows = zip(w, size, -np.degrees(np.arctan(0.3 * w)), strict=True)
    lines = [",".join(f"{number:.6g}" for number in row) for row in rows]
    path = tmp_path / "bode.csv"
    path.write_text("\n".join(["omega_rad_s,magnitude_db,phase_deg", *lines]) + "\n")
    place, out = ("--json", tmp_path / "r.json"), ("--out", tmp_path / "out")
    code, text, err = run(monkeypatch, capsys, path, "--order", "1", *place, *out)
    assert (code, err) == (0, "")
    assert "* order_1: fits 100.00 %" in text
    best = json.loads((tmp_path / "r.json").read_text())["models"][0]["parameters"]
    assert best["T"]["value"] == pytest.approx(0.3, rel=1e-3)
    assert (tmp_path / "out" / "curves.csv").is_file()
    assert (tmp_path / "out" / "bode.png").read_bytes()[:4] == b"\x89PNG"
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "<dt>T</dt><dd><b>0.3000 s</b>" in page
    check_page(page)
    code, _, err = run(monkeypatch, capsys, path, "--dt", "2s")
    assert (code, "--dt is for trials" in err) == (2, True)


def test_no_model_that_can_be_trusted_is_a_finding(monkeypatch, capsys, tmp_path):
    write_recording(tmp_path, "mas20_arm", {"a_1": trial(telegraph(9, 10), 9)})
    code, text, _ = run(
        monkeypatch, capsys, tmp_path, "--order", "3", "--dead-time", "none", "--poles", "real",
        *SMALL,
    )  # fmt: skip
    assert code == 1
    assert "recommended: none" in text


BAD = {
    "no data": ([], "give DATA, or --simulate"),
    "no folder": (["nowhere"], "no recording at nowhere"),
    "no file": (["nowhere.csv"], "cannot read nowhere.csv"),
    "data and simulation": (
        ["DATA", "--simulate", "mas20_arm"],
        "--simulate describes a simulated",
    ),
    "load of data": (["DATA", "--load", "1"], "--load describes a simulated step"),
    "unknown rig": (["--simulate", "mas21_arm"], "did you mean 'mas20_arm'"),
    "one set point": (["--simulate", "mas20_arm", "--pressure", "300"], "commands 1 muscles"),
    "unknown trial": (["DATA", "--trial", "telegraph_3"], "did you mean 'telegraph_"),
    "unknown protocol": (["DATA", "--protocol", "stairs"], "did you mean 'staircase'"),
    "unknown held-out": (["DATA", "--hold-out", "x"], "--hold-out: 'x' is not in the data"),
    "held-out share": (["DATA", "--hold-out", "130%"], "--hold-out = 1.3 is no share"),
    "clock of a recording": (["DATA", "--dt", "2s"], "--dt is for tables"),
    "all held out": (
        ["DATA", "--trial", "staircase_1", "--hold-out", "staircase_1"],
        "no trial is left",
    ),
    "unknown column": (["DATA", "--input", "p1_bar"], "no column 'p1_bar'"),
    "mixed units": (["DATA", "--output", "angle_deg+p1_kpa"], "use columns of one unit"),
    "same column": (["DATA", "--input", "angle_deg"], "share a column"),
    "no valves": (["DATA", "--input", "u1-u2"], "no column 'u1'"),
    "order": (["DATA", "--order", "9"], "give 0 to 6"),
    "zeros alone": (["DATA", "--zeros", "1"], "--zeros needs --order"),
    "too many zeros": (["DATA", "--order", "2", "--zeros", "3"], "zeros = 3 of 2 poles"),
    "dead time": (["DATA", "--dead-time", "fre"], "did you mean 'free'"),
    "poles": (["DATA", "--poles", "complex"], "--poles 'complex' is not known"),
    "start": (["DATA", "--initial-state", "fre"], "did you mean 'free'"),
    "arx": (["DATA", "--arx", "2,2"], "write three whole numbers"),
    "place": (["DATA", "--order", "1", "--out", "FILE"], "cannot write"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_clear_line_and_exit_2(monkeypatch, capsys, recording, tmp_path, name):
    args, expected = BAD[name]
    (tmp_path / "file").write_text("")
    places = {"DATA": recording, "FILE": tmp_path / "file"}
    monkeypatch.chdir(tmp_path)
    code, out, err = run(monkeypatch, capsys, *(places.get(arg, arg) for arg in args))
    assert code == 2
    assert expected in err
    assert len(err.strip().splitlines()) == 1
    assert "Traceback" not in err
    assert out == ""  # nothing is computed first
