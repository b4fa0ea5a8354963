"""fit as a function: arguments in, one object out, with text, dict, files and a figure."""

from __future__ import annotations

import json
import tomllib

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.fitting.fit import fit
from pamsim.physics.force_laws.exponential import six_parameter_force
from pamsim.physics.force_laws.published import PUBLISHED
from pamsim.report.fit_figure import fit_figure

LAW = PUBLISHED["DMSP-20-200"]
CONSTANTS = (LAW.a, LAW.b, LAW.c, LAW.d, LAW.e, LAW.f)


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    path = tmp_path_factory.mktemp("map") / "map.csv"
    rows = [
        f"{p},{kappa},{six_parameter_force(1e3 * p, kappa, *CONSTANTS)!r}"
        for p in (100, 200, 300, 400, 500)
        for kappa in (0.0, 0.02, 0.05, 0.1, 0.15)
    ]
    path.write_text("\n".join(["p_kpa,contraction,force_n", *rows]), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def result(table):
    return fit(table, model="six_parameter", hold_out="pressure", held={"scale": 1.0})


def test_the_result_holds_estimates_and_errors_at_held_out_points(result):
    (law,) = result.fits
    assert law.fit.values == pytest.approx([1.0, *CONSTANTS], rel=1e-3)
    assert law.fit.coefficients[0].held
    assert law.held_out.groups.size == 5
    assert law.held_out.rmse < 1e-3
    written = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert written["schema"] == "pamsim-fit/2"
    assert written["fits"][0]["scores"]["points"] == 25
    assert len(written["fits"][0]["held_out"]["residual"]) == 25
    assert {"coefficients", "converged", "evaluations", "points"} <= set(written["fits"][0])
    text = result.summary()
    assert text.startswith("six_parameter: ")
    assert "held out in turn, 5 pressures" in text
    assert "25 points, 6 coefficients" in text


def test_save_writes_the_result_and_a_section_of_a_rig(result, tmp_path):
    files = result.save(tmp_path / "new")
    assert [path.name for path in files] == ["fit.json", "params.toml"]
    section = tomllib.loads(files[1].read_text(encoding="utf-8"))["muscle"]["force"]
    assert section["law"] == "six_parameter"
    assert section["scale"] == {
        "value": 1.0, "unit": "1", "source": "assumed", "note": "held in the fit",
    }  # fmt: skip
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write"):
        result.save(tmp_path / "file")


def test_its_figure_shows_curves_and_held_out_residuals(result):
    top, bottom = fit_figure(result.to_dict()).axes
    assert (top.get_ylabel(), bottom.get_ylabel()) == ("force [N]", "fitted − measured [N]")
    assert len(top.lines) == 10  # points and curve of each contraction
    hollow = bottom.lines[1].get_ydata()
    np.testing.assert_allclose(hollow, 0.0, atol=1e-3)


def test_wrong_arguments_are_named(table):
    for wrong, match in (
        ({}, "give either `model` or `compare`"),
        ({"model": "six_parameter", "hold_out": "lengths"}, "`hold_out` 'lengths' is not known"),
        ({"model": "six_parameter", "held": {"c": 5.0}}, "`held` c = 5 is outside"),
    ):
        with pytest.raises(InputError, match=match):
            fit(table, **wrong)
