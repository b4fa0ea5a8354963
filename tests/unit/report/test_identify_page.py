"""The identification page: a figure for every kind of result, text escaped, numbers as given."""

from __future__ import annotations

import copy
from dataclasses import replace

import pytest

from pamsim.identification.choose import AICC, LIKELIHOOD
from pamsim.report.identify_page import (
    bode,
    drawn_trials,
    local_map,
    measured_and_model,
    model_title,
    page_of,
    pole_texts,
    scan,
    steps_and_poles,
)
from pamsim.report.numbers import fixed, significant
from tests.unit.identification.planted import identified_lag


def local(*levels):
    return {
        "models": [
            {
                "pressure_kpa": level, "load_kg": load, "direction": direction,
                "status": "converged", "parameters": {"K": gain, "T": {**gain, "interval95": None}},
            }
            for level in levels
            for gain in [{"unit": "deg/kPa", "value": 1e-4 * level, "interval95": [0.0, None]}]
            for load in (0.0, 1.2)
            for direction in (-1, 0, 1)
        ],
        "dependences": [{"sentence": "K: falls by 20 % over the map's <pressure>"}],
    }  # fmt: skip


@pytest.fixture
def result():
    """Of a lag; an oscillating model and one without a continuous pole stand beside it."""
    written = copy.deepcopy(identified_lag().to_dict())
    lag, arx, _ = written["models"]
    swinging = {**lag, "name": "second_order_any_poles", "sentence": "converged <inside>"}
    swinging["poles_rad_per_s"] = [[-1.0, 3.0], [-1.0, -3.0]]
    arx["poles_rad_per_s"] = [None, [0.5, 0.0]]
    return {
        **written,
        "models": [lag, swinging, arx],
        "data": "data/<folder>",
        "skipped": {"oe_2_2_1": "too few samples"},
        "local": local(200.0, 300.0),
    }


@pytest.fixture
def curves():
    return identified_lag().curves()


@pytest.fixture
def page(curves, tmp_path, quick):
    """Writes the page of a result; its source, and the names of its files."""

    def write(result):
        for file in tmp_path.glob("*"):
            file.unlink()
        source = page_of(result, curves, tmp_path).read_text(encoding="utf-8")
        return source, {path.name for path in tmp_path.iterdir()}

    return write


def test_page_holds_every_number_once_and_escapes_text(result, page):
    source, files = page(result)
    gain, lag = (significant(p["value"], 4) for p in result["models"][0]["parameters"].values())
    assert files == {"index.html", "fit.png", "step.png", "bode.png", "local.png"}
    for name in ("fit", "step", "bode", "local"):
        assert f'<figure id="{name}">' in source
    for words in (
        "data/&lt;folder&gt;",
        "&lt;inside&gt;",
        f"<td>{fixed(result['models'][0]['fit_percent_held_out'], 2)}</td>",
        "too few samples",
        f"K = {gain} deg/kPa, T = {lag} s; fits 98.9 %",
        "curves.csv",
        "held out<br>",
    ):
        assert words in source, words
    assert "<pressure>" not in source
    assert "b1 =" not in source
    for one in result["trials"]:
        one["role"] = "fitted"
    assert "held out<br>" not in page(result)[0]


def test_a_result_without_recommendation_or_map_has_its_page(result, page):
    plain = {**result, "recommended": None, "best": None, "local": None}
    source, files = page({**plain, "reason": "no model can be trusted"})
    assert "No model is recommended: no model can be trusted." in source
    assert "local.png" not in files


def structure(poles, zeros=0, held_out=None, *, integrators=0, drift=False, judged_by=""):
    above = 4.0 - poles
    return {
        "poles": poles,
        "zeros": zeros,
        "integrators": integrators,
        "dead_time": False,
        "shown": (poles, zeros) == (1, 0),
        "fit_percent": 90.0,
        "fit_percent_held_out": held_out,
        "drift": drift,
        "coefficients": 1 + poles + zeros + integrators + drift,
        "aicc_above_best": above if judged_by == AICC else None,
        "hannan_quinn_above_best": above if judged_by == LIKELIHOOD else None,
    }


def test_the_best_of_a_plant_that_is_not_linear_is_shown_with_what_is_missing(result, page):
    bent = {**result, "recommended": None, "missing": "the plant is not linear"}
    bent["scan"] = {
        "judged_by": "the last third of each trial",
        "structures": [structure(1, 0, 80.0), structure(2, 1, 81.0, integrators=1)],
    }
    source, files = page(bent)
    assert "Best linear model: first order, K = 0.0" in source
    assert "Not recommended: the plant is not linear." in source
    assert "2 structures, judged by the last third of each trial" in source
    assert "scan.png" in files


def test_every_structure_of_a_scan_is_drawn_once(result, page):
    for judged_by, label in ((AICC, "AICc"), (LIKELIHOOD, "criterion")):
        every = [
            structure(poles, integrators=poles - 1 - drift, drift=drift, judged_by=judged_by)
            for poles, drift in ((1, False), (2, False), (3, False), (2, True))
        ]
        result["scan"] = {"judged_by": judged_by, "structures": every}
        source, _ = page(result)
        assert f"judged by {judged_by}. Chosen: the simplest" in source
        assert "worse than the best by 2 at most" in source
        (ax,) = scan(result).axes
        assert ax.get_ylabel() == f"{label} above the best"
        shown = ax.lines[-1]
        assert (list(shown.get_xdata()), list(shown.get_ydata())) == ([2], [3.0])
        drawn = [x for line in ax.lines[:-1] for x in line.get_xdata()]
        assert sorted(drawn) == [2, 4, 4, 6]
        names = [line.get_label() for line in ax.lines]
        assert names == ["no integrator", "one integrator", "two integrators", "shown model"]


def test_words_and_numbers():
    for name, title in {
        "arx_2_2_1": "ARX 2,2,1",
        "second_order_dead_time": "second order with dead time",
        "order_3_zeros_0_1_any_poles_dead_time_of_2_drift": (
            "order 3, zeros 0, 1, any poles with dead time of input 2, output drifts"
        ),
        "first_order_drift": "first order, output drifts",
        "order_6_zeros_5_any_poles": "order 6, 5 zeros, any poles",
        "order_4_zeros_1": "order 4, 1 zero",
    }.items():
        assert model_title(name) == title
    assert pole_texts([None, [0.5, 0.0]]) == ["none", "0.500"]
    assert pole_texts([[-1.0, 3.0], [-1.0, -3.0]]) == ["−1.00 ± 3.00j"]
    assert pole_texts([[-2.0, 0.0], [-2.0, 0.0]]) == ["−2.00", "−2.00"]


def test_held_out_trials_are_drawn_first_and_a_single_trial_is_stacked(result, curves):
    assert [one.name for one in drawn_trials(curves.trials)] == ["telegraph_2", "telegraph_1"]
    assert 1 < len(drawn_trials(curves.trials[:1] * 9)) < 9
    assert len(measured_and_model(result, curves).axes) == 4
    single = measured_and_model(result, replace(curves, trials=curves.trials[:1]))
    assert len(single.axes) == 2


def test_every_pole_has_its_marker_and_axes_have_units(result, curves):
    left, right = steps_and_poles(result, curves).axes
    assert left.get_ylabel() == "response [deg/kPa]"
    assert sum(len(line.get_xdata()) for line in right.lines) == 4
    upper, lower = bode(result, curves).axes
    assert (upper.get_ylabel(), lower.get_xlabel()) == ("magnitude [deg/kPa]", "frequency [Hz]")


def test_the_map_is_over_pressure_or_point_by_point(result):
    assert "[kPa]" in local_map(result).axes[-1].get_xlabel()
    flat = local_map({**result, "local": local(300.0)})
    assert "all at 300 kPa" in flat.axes[-1].get_xlabel()
