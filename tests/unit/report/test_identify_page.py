"""The identification page: a figure for every kind of result, text escaped, numbers as given."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.report.identify_bode import bode
from pamsim.report.identify_figures import measured_and_model, shown_trials, step_and_poles
from pamsim.report.identify_local_figure import local_map
from pamsim.report.identify_page import write_identification
from pamsim.report.identify_view import model_title, model_views, verdict


def parameters(gain=0.05, constant=0.5):
    return {
        "K_deg_per_kpa": {
            "name": "K", "unit": "deg/kPa", "value": gain, "interval95": [0.9 * gain, 1.1 * gain],
        },
        "T_s": {"name": "T", "unit": "s", "value": constant, "interval95": None},
        "b1_deg_per_kpa": {"name": "b1", "unit": "deg/kPa", "value": 1.0, "interval95": None},
    }  # fmt: skip


def model(name, kind, poles, names):
    score = [{"name": name, "fit_percent": 90.0, "rms_deg": 0.1} for name in names]
    shared = {
        "name": name,
        "kind": kind,
        "status": "converged",
        "sentence": "converged <inside> the bounds",
        "parameters": parameters(),
        "fit_percent": 91.234,
        "independence": {"sentence": "past inputs explain nothing more"},
        "trials": score[:1],
        "poles_rad_per_s": poles,
    }
    if kind != "continuous":
        return shared
    held = {"fit_percent_held_out": 89.0, "held_out": score[1:], "aicc_above_best": 0.0}
    return {**shared, **held}


def local(levels):
    return {
        "models": [
            {
                "pressure_kpa": level,
                "load_kg": load,
                "direction": direction,
                "status": "converged",
                "parameters": parameters(0.05 + 1e-4 * level),
            }
            for level in levels
            for load in (0.0, 1.2)
            for direction in (-1, 0, 1)
        ],
        "dependences": [{"sentence": "K: falls by 20 % over the map's <pressure>"}],
    }


@pytest.fixture
def result():
    names = ("step_1", "step_2")
    return {
        "schema": "pamsim-identify/1",
        "data": "data/<folder>",
        "rig": "mas20_arm",
        "input": {"expression": "p1_kpa", "unit": "kPa"},
        "output": {"expression": "angle_deg", "unit": "deg"},
        "trials": [
            {"name": name, "role": role, "load_kg": 1.0, "samples": 50, "duration_s": 1.0}
            for name, role in zip(names, ("fitted", "held_out"), strict=True)
        ],
        "models": [
            model("first_order", "continuous", [[-2.0, 0.0]], names),
            model("second_order_any_poles", "continuous", [[-1.0, 3.0], [-1.0, -3.0]], names),
            model("arx_2_2_1", "arx", [None, [0.5, 0.0]], names),
        ],
        "skipped": {"oe_1_1_1": "too few samples"},
        "recommended": "first_order",
        "shown": "first_order",
        "reason": "smallest AICc",
        "effective_samples": 40.0,
        "local": local((200.0, 300.0)),
        "notes": ["force_1 was not measured"],
        "versions": {"pamsim": "0.1.0"},
        "seconds": 1.0,
    }


@pytest.fixture
def curves():
    time, k = np.linspace(0.0, 1.0, 50), np.linspace(0.1, 10.0, 40)
    band = np.stack([0.9 / k, 1.1 / k])
    return {
        "trials": [
            {"name": name, "held_out": held, "time": time, "input": time, "output": time,
             "model": time**2}
            for name, held in (("step_1", False), ("step_2", True))
        ],
        "step_time": k, "step": 1.0 / k, "step_band": band,
        "frequency": k, "magnitude": 1.0 / k, "magnitude_band": band,
        "phase": -90.0 * k / 10.0, "phase_band": None, "nyquist": 31.4,
    }  # fmt: skip


def test_page_holds_every_number_once_and_escapes_text(result, curves, tmp_path):
    files = write_identification(result, curves, tmp_path / "new" / "folder")
    page = files[0].read_text(encoding="utf-8")
    assert {path.name for path in files} == {
        "index.html", "fit.png", "step.png", "bode.png", "local.png", "curves.csv",
    }  # fmt: skip
    for path in files:
        assert path.stat().st_size > 0
        assert path.name == "index.html" or path.name in page
    assert "data/&lt;folder&gt;" in page
    assert "&lt;inside&gt;" in page
    assert "<pressure>" not in page
    assert "89.00" in page
    assert "b1" not in page
    assert "too few samples" in page
    rows = (tmp_path / "new" / "folder" / "curves.csv").read_text().splitlines()
    assert rows[0] == "trial,time_s,input_kpa,output_deg,model_deg"
    assert len(rows) == 101


def test_a_result_without_recommendation_or_map_has_its_page(result, curves, tmp_path):
    plain = {**result, "recommended": None, "reason": "no model can be trusted", "local": None}
    page = write_identification(plain, curves, tmp_path)[0].read_text(encoding="utf-8")
    assert "No model is recommended: no model can be trusted." in page
    assert not (tmp_path / "local.png").exists()


def test_another_schema_and_a_bad_place_are_refused(result, curves, tmp_path):
    with pytest.raises(InputError, match="reads 'pamsim-identify/1'"):
        write_identification({**result, "schema": "x"}, curves, tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file; name a folder"):
        write_identification(result, curves, tmp_path / "file")


def test_words_and_numbers(result):
    assert model_title("arx_2_2_1") == "ARX 2,2,1"
    assert model_title("second_order_dead_time") == "second order with dead time"
    assert "K = 0.05000 deg/kPa, T = 0.5000 s" in verdict(result)
    first, pair, arx = model_views(result)
    assert first.recommended
    assert [p.name for p in first.parameters] == ["K", "T"]
    assert arx.poles == ["none", "0.500"]
    assert pair.poles == ["−1.00 ± 3.00j"]


def test_held_out_column_is_there_only_with_held_out_trials(result, curves, tmp_path, monkeypatch):
    monkeypatch.setattr("pamsim.report.page.save_png", lambda figure, path: (691, 400))
    held = write_identification(result, curves, tmp_path)[0].read_text(encoding="utf-8")
    assert "held out<br>" in held
    result["trials"][1]["role"] = "fitted"
    none = write_identification(result, curves, tmp_path)[0].read_text(encoding="utf-8")
    assert "held out<br>" not in none


def test_held_out_trials_are_drawn_first_and_a_single_trial_is_stacked(result, curves):
    assert [trial["name"] for trial in shown_trials(curves["trials"])] == ["step_2", "step_1"]
    many = [{**curves["trials"][0], "name": str(i)} for i in range(9)]
    assert 1 < len(shown_trials(many)) < 9
    both = measured_and_model(result, curves)
    assert len(both.axes) == 4
    one = measured_and_model(result, {**curves, "trials": curves["trials"][:1]})
    assert len(one.axes) == 2
    left = one.axes[1].lines[0].get_ydata()
    np.testing.assert_allclose(left, curves["trials"][0]["model"] - curves["trials"][0]["output"])


def test_every_pole_has_its_mark_and_axes_have_units(result, curves):
    left, right = step_and_poles(result, curves).axes
    assert left.get_ylabel() == "response [deg/kPa]"
    assert sum(len(line.get_xdata()) for line in right.lines) == 4
    upper, lower = bode(result, curves).axes
    assert (upper.get_ylabel(), lower.get_xlabel()) == ("magnitude [deg/kPa]", "frequency [Hz]")
    assert upper.lines[0].get_xdata()[0] == pytest.approx(0.1 / (2.0 * np.pi))


def test_the_map_is_over_pressure_or_point_by_point(result):
    axes = local_map(result).axes
    assert "[kPa]" in axes[-1].get_xlabel()
    flat = copy.deepcopy(result)
    flat["local"] = local((300.0,))
    assert "all at 300 kPa" in local_map(flat).axes[-1].get_xlabel()
