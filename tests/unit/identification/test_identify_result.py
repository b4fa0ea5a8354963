"""identify as a function: arguments in, one object out, with text, dict, files and a figure."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pamsim.identification.identify import identify
from pamsim.recordings.trial import Trial, TrialSet
from pamsim.report.identify_figures import measured_and_model
from tests.unit.linear.planted import refuses

TS, GAIN, LAG = 0.02, 1e-6, 0.4


def trial(name, seed, n=400):
    """A lag from the pressure difference to the angle, driven by a random telegraph signal."""
    draw = np.random.default_rng(seed)
    difference = 1e5 * np.repeat(draw.choice([-1.0, 1.0], n // 40 + 1), 40)[:n]
    difference[:20] = difference[0]
    pole, angle = np.exp(-TS / LAG), np.zeros(n)
    for k in range(1, n):
        into = GAIN * (difference[k - 1] - difference[0])
        angle[k] = pole * angle[k - 1] + (1.0 - pole) * into
    command = np.column_stack([3e5 + difference / 2.0, 3e5 - difference / 2.0])
    return Trial(
        name=name,
        protocol="telegraph",
        drive="pressure_set",
        load=0.0,
        time=TS * np.arange(n),
        command=command,
        measured={
            "angle": angle + 5e-4 * draw.normal(size=n),
            "pressure_1": command[:, 0],
            "pressure_2": command[:, 1],
        },
    )


DATA = TrialSet(rig="mas20_arm", trials=(trial("telegraph_1", 1), trial("telegraph_2", 2)))


@pytest.fixture(scope="module")
def result():
    return identify(
        DATA,
        input="p1_set_kpa-p2_set_kpa",
        output="angle_deg",
        order=1,
        dead_time="none",
        arx=(1, 1, 1),
        oe=(1, 1, 1),
        hold_out=["telegraph_2"],
        local=False,
    )


def test_the_result_holds_models_in_si_and_writes_them_in_the_units_of_the_columns(result):
    assert result.recommendation.name == "first_order"
    fit = result.shown.fit
    assert fit.gain == pytest.approx(GAIN, rel=0.02)
    assert fit["T"].value == pytest.approx(LAG, rel=0.02)
    assert [score.name for score in fit.held_out] == ["telegraph_2"]
    written = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    gain = written["models"][0]["parameters"]["K"]
    assert gain["unit"] == "deg/kPa"
    assert gain["value"] == pytest.approx(fit.gain * 1e3 * 180.0 / np.pi, rel=1e-12)
    assert written["models"][0]["trials"][0]["rms"] == pytest.approx(np.degrees(5e-4), rel=0.1)


def test_its_transfer_function_is_in_the_units_of_the_columns_or_in_si(result):
    (gain, lag) = (result.shown.fit.gain, result.shown.fit["T"].value)
    system, in_si = result.transfer_function(), result.transfer_function(si=True)
    assert float(in_si.dcgain()) == pytest.approx(gain)
    assert float(system.dcgain()) == pytest.approx(gain * 1e3 * 180.0 / np.pi, rel=1e-12)
    assert float(system.poles()[0].real) == pytest.approx(-1.0 / lag)


def test_the_summary_names_every_model_and_the_recommended_one(result):
    text = result.summary()
    assert "* first_order: fits" in text
    assert all(f"  {name}: fits" in text for name in ("arx_1_1_1", "oe_1_1_1"))
    assert "recommended: first_order: the only model" in text
    assert "deg/kPa  [" in text


def test_save_writes_the_result_and_every_curve(result, tmp_path):
    files = result.save(tmp_path / "new")
    assert [path.name for path in files] == ["identify.json", "curves.csv"]
    assert json.loads(files[0].read_text())["schema"] == "pamsim-identify/4"
    rows = files[1].read_text().splitlines()
    assert rows[0] == "trial,time_s,input_kpa,output_deg,model_deg"
    assert {row.split(",")[0] for row in rows[1:]} == {"telegraph_1", "telegraph_2"}
    (tmp_path / "file").write_text("")
    refuses("cannot write", result.save, tmp_path / "file")


def test_its_figure_shows_every_trial(result):
    figure = measured_and_model(result.to_dict(), result.curves())
    assert len(figure.axes) == 4  # two trials, each with its residual


def test_a_drift_is_estimated_and_printed_in_the_unit_of_the_column(tmp_path):
    draw = np.random.default_rng(5)
    n = 500
    given = np.repeat(draw.choice([-1.0, 1.0], n // 20), 20)
    pole, output = np.exp(-TS / 0.2), np.zeros(n)
    for k in range(1, n):
        output[k] = pole * output[k - 1] + (1.0 - pole) * 10.0 * given[k - 1]
    output = output + np.linspace(0.0, 6.0, n) + 0.2 * draw.normal(size=n)
    table = np.column_stack([TS * np.arange(n), given, output])
    np.savetxt(
        tmp_path / "log.csv", table, delimiter=",", header="time_s,valve,travel_mm", comments=""
    )
    found = identify(tmp_path / "log.csv")
    assert found.recommendation.best == "first_order_drift"
    (line,) = [s for s in found.summary().splitlines() if "drift of the output" in s]
    unit, value, _, trial = line.partition(": ")[0], *line.partition(": ")[2].split()
    assert unit.endswith("[mm]")
    assert float(value) == pytest.approx(6.0, abs=0.3)
    assert trial == "log"
    assert found.to_dict()["scan"]["structures"][0]["hannan_quinn_above_best"] > 0.0
