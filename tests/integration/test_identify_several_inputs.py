"""``pamsim identify --input A --input B``: from a table to page, curves and python-control."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from tests.integration.test_identify_command import run
from tests.unit.linear.planted import lags, sampled, steps

TS, N = 0.05, 800
GAINS, CONSTANT = (0.02, -3.0), 0.4  # deg per kPa, deg per V


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    rng = np.random.default_rng(1)
    pressure, voltage = 100.0 * steps(rng, N, 20), 2.0 * steps(rng, N, 31)
    angle = sum(
        sampled([gain], lags(CONSTANT), u, TS)
        for gain, u in zip(GAINS, (pressure, voltage), strict=True)
    )
    angle = angle + 4.0 + 0.05 * rng.standard_normal(N)
    path = tmp_path_factory.mktemp("log") / "log.csv"
    path.write_text(
        "time_s,supply_kpa,fan_v,twice_v,still_v,angle_deg\n"
        + "".join(
            f"{TS * k:.2f},{p:.1f},{v:.1f},{2.0 * v:.1f},7,{y:.6f}\n"
            for k, (p, v, y) in enumerate(zip(pressure, voltage, angle, strict=True))
        )
    )
    return path


def test_numbers_are_those_of_the_columns_everywhere(log, monkeypatch, capsys, tmp_path):
    out, result = tmp_path / "out", tmp_path / "result.json"
    code, text, err = run(
        monkeypatch, capsys, log, "--input", "supply_kpa", "--input", "fan_v", "--order", "1",
        "--dead-time", "none", "--out", out, "--json", result,
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert "angle_deg from [1] supply_kpa, [2] fan_v: 1 trial(s) fitted" in text
    content = json.loads(result.read_text())
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
    page = (out / "index.html").read_text()
    assert "Frequency response to [2] fan_v." in page
    assert {"bode_1.png", "bode_2.png"} <= {path.name for path in out.iterdir()}
    with (out / "curves.csv").open() as file:
        header, first = list(csv.reader(file))[:2]
    assert header == [
        "trial", "time_s", "input1_kpa", "input2_v", "output_deg", "model_deg",
    ]  # fmt: skip
    assert len(first) == len(header)


def test_python_control_gets_gains_per_unit_of_each_column(log):
    found = pamsim.identify(log, input=["supply_kpa", "fan_v"], order=1, dead_time="none")
    assert found.transfer_function().dcgain() == pytest.approx(np.array([GAINS]), rel=0.02)
    si = found.transfer_function(si=True).dcgain()
    per_si = np.array([[GAINS[0] * np.pi / 180e3, GAINS[1] * np.pi / 180.0]])
    assert si == pytest.approx(per_si, rel=0.02)
    assert found.local is None


@pytest.mark.parametrize(
    ("changes", "mend"),
    [
        ({"input": ["fan_v", "twice_v"]}, "'twice_v' follows from fan_v: .* omit one of them"),
        ({"input": ["fan_v", "still_v"]}, "'still_v' never changes"),
        ({"input": ["fan_v", "angle_deg"]}, "share a column"),
        ({"input": ["fan_v", "supply_kpa"], "arx": (1, 1, 1)}, "models of one input"),
    ],
)
def test_inputs_that_cannot_be_told_apart_are_refused(log, changes, mend):
    with pytest.raises(InputError, match=mend):
        pamsim.identify(log, output="angle_deg", order=1, **changes)


def test_the_rate_of_an_integrating_output_is_in_its_unit(tmp_path):
    rng = np.random.default_rng(2)
    u = np.column_stack([steps(rng, N, 20), steps(rng, N, 31)])
    u = u - np.mean(u, axis=0)
    way = sum(sampled([8.0], [CONSTANT, 1.0, 0.0], u[:, i], TS) for i in range(2))
    way = way + 5.0 * TS * np.arange(N) + 0.05 * rng.standard_normal(N)
    path = tmp_path / "way.csv"
    rows = (f"{TS * k:.2f},{u[k, 0]:.6f},{u[k, 1]:.6f},{way[k]:.5f}" for k in range(N))
    path.write_text("\n".join(["time_s,a_v,b_v,way_mm", *rows]) + "\n")
    found = pamsim.identify(path, input=["a_v", "b_v"], output="way_mm", order=1, integrators=1)
    parameters = found.to_dict()["models"][0]["parameters"]
    assert parameters["r0"]["unit"] == "mm/s"
    assert parameters["r0"]["value"] == pytest.approx(5.0, rel=0.02)
    assert parameters["K[2]"]["unit"] == "mm/V/s"
    assert parameters["K[2]"]["value"] == pytest.approx(8.0, rel=0.02)
