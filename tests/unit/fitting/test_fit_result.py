"""fit as a function: arguments in, one object out; scores by hand, held out without leakage."""

import json
import math
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError
from pamsim.fitting.fit import fit
from pamsim.fitting.force_map import _rank
from pamsim.fitting.scores import grouped, leave_one_group_out, scores
from pamsim.physics.force_laws.exponential import six_parameter_force
from pamsim.physics.force_laws.published import PUBLISHED
from tests.unit.core.refusals import refused

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


def test_the_result_holds_estimates_and_errors_at_held_out_points(table, tmp_path):
    result = fit(table, model="six_parameter", hold_out="pressure", held={"scale": 1.0})
    (law,) = result.fits
    assert law.fit.values == pytest.approx([1.0, *CONSTANTS], rel=1e-3)
    assert law.fit.coefficients[0].held
    assert law.held_out.groups.size == 5
    assert law.held_out.rmse < 1e-3
    written = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    (one,) = written["fits"]
    assert written["schema"] == "pamsim-fit/2"
    assert (one["scores"]["points"], len(one["held_out"]["residual"])) == (25, 25)
    assert {"coefficients", "converged", "evaluations", "points"} <= set(one)
    text = result.summary()
    assert text.startswith("six_parameter: ")
    assert "held out in turn, 5 pressures" in text
    assert "25 points, 6 coefficients" in text
    files = result.save(tmp_path / "new")
    assert [path.name for path in files] == ["fit.json", "params.toml"]
    section = tomllib.loads(files[1].read_text(encoding="utf-8"))["muscle"]["force"]
    assert section["law"] == "six_parameter"
    scale = {"value": 1.0, "unit": "1", "source": "assumed", "note": "held in the fit"}
    assert section["scale"] == scale
    (tmp_path / "file").write_text("")
    with refused("cannot write"):
        result.save(tmp_path / "file")


def test_geometry_is_assumed_only_of_what_the_law_uses(tmp_path):
    path = tmp_path / "map.csv"
    rows = [
        f"{p},{length},{-8e-4 * 1e3 * p + 0.6 * (length - 100)}"
        for p in (20, 50, 100)
        for length in (100, 110, 120)
    ]
    path.write_text("\n".join(["p_kpa,length_mm,force_n", *rows]), encoding="utf-8")
    # A bellows has no braid, so nothing is assumed of one.
    bellows = fit(path, model="effective_area", nominal_length=0.1, hold_out="none")
    assert bellows.notes == ()
    assert bellows.fits[0].fit.values == pytest.approx([1.0, 8e-4, 600.0])
    rows = [f"{p},{kappa},{2.0 * p * (1 - kappa)}" for p in (100, 200) for kappa in (0.0, 0.1)]
    path.write_text("\n".join(["p_kpa,contraction,force_n", *rows]), encoding="utf-8")
    (note,) = fit(path, model="ideal_mckibben", fibre_angle=0.5, hold_out="none").notes
    assert note.startswith("nominal length, diameter assumed")
    assert note.endswith("give your own as `nominal_length`, `diameter`")


def test_scores_computed_by_hand():
    errors = scores([1.0, 2.0, 3.0, 6.0], [2.0, 2.0, 2.0, 8.0], free=1)
    # residuals 1, 0, -1, 2: SSE 6; mean 3, SST 4 + 1 + 0 + 9 = 14
    assert (errors.mse, errors.mae, errors.points, errors.free) == (1.5, 1.0, 4, 1)
    assert errors.rmse == pytest.approx(math.sqrt(1.5))
    assert errors.r2 == pytest.approx(1.0 - 6.0 / 14.0)
    assert errors.aic == pytest.approx(4.0 * math.log(1.5) + 4.0)
    assert errors.aicc == pytest.approx(errors.aic + 2.0 * 2.0 * 3.0 / 1.0)
    # Where a score means nothing there is none.
    perfect = scores([1.0, 2.0], [1.0, 2.0], free=1)
    assert (perfect.aic, perfect.aicc, perfect.rmse) == (None, None, 0.0)
    constant = scores([2.0, 2.0, 2.0], [1.0, 2.0, 3.0], free=1)
    assert (constant.r2, constant.aicc) == (None, None)  # n = k + 2
    assert constant.aic is not None
    for measured, predicted in (([], []), ([1.0], [1.0, 2.0]), ([np.nan], [1.0])):
        with pytest.raises(InputError):
            scores(measured, predicted, 0)


def test_held_out_errors_computed_by_hand():
    y = np.array([1.0, 3.0, 10.0, 20.0])
    errors = leave_one_group_out(
        y, [0.1, 0.1, 0.2, 0.2], lambda train, test: np.full(test.size, y[train].mean()), by="x"
    )
    # group 1 predicted 15: errors 14, 12; group 2 predicted 2: errors -8, -18
    assert errors.residual.tolist() == [14.0, 12.0, -8.0, -18.0]
    assert errors.group_rmse == pytest.approx([math.sqrt(170.0), math.sqrt(194.0)])
    assert errors.rmse == pytest.approx(math.sqrt((340.0 + 388.0) / 4.0))
    assert errors.worst == pytest.approx(math.sqrt(194.0))


def test_no_group_is_both_fitted_and_predicted_and_one_that_cannot_be_is_not_zero():
    label = np.array([3.0, 1.0, 2.0, 1.0, 3.0, 2.0])
    used = []

    def predict(train, test):
        used.append(sorted([*train, *test]))
        assert set(label[train]).isdisjoint(label[test])
        if 1 in test:
            raise InputError("too few")
        return np.zeros(test.size)

    errors = leave_one_group_out(np.full(6, 2.0), label, predict, by="x")
    assert used == [[0, 1, 2, 3, 4, 5]] * 3
    assert math.isnan(errors.rmse)
    assert math.isnan(errors.worst)
    written = to_dict(errors)
    assert (written["group_rmse"], written["rmse"]) == ([None, 2.0, 2.0], None)

    def diverge(_, test):
        return np.full(test.size, 1e200)

    assert leave_one_group_out([1.0, 1.0], [0.0, 1.0], diverge, by="x").rmse == math.inf
    with refused("leaves nothing to fit"):
        leave_one_group_out([1.0, 2.0], [1.0, 1.0], diverge, by="pressure")


def test_set_values_make_a_group_each_and_scattered_ones_make_bins():
    assert grouped([0.1, 0.2, 0.1]).tolist() == [0.1, 0.2, 0.1]
    scattered = np.random.default_rng(0).uniform(size=100)
    bins = grouped(scattered, most=10)
    assert np.unique(bins).size == 10
    assert np.all(np.diff(bins[np.argsort(scattered)]) >= 0.0)  # bins of neighbours
    assert np.unique(grouped(np.repeat(np.arange(20.0), 3))).size == 20


def test_readings_that_scatter_about_levels_make_a_group_of_each_level():
    draw = np.random.default_rng(1)
    level = np.repeat([0.0, 1e5, 1.5e5, 4e5, 6e5], 9)
    for size in (20.0, 200.0, 2e3):  # [Pa] of a regulator
        readings = level + draw.normal(0.0, size, level.size)
        for shown in (readings, np.round(readings, -1)):
            order = draw.permutation(level.size)
            found = grouped(shown[order])
            assert np.unique(found).size == 5
            means = [np.mean(shown[order][level[order] == p]) for p in level[order]]
            assert found == pytest.approx(np.array(means))
    sweep = np.append(0.0, np.linspace(1e5, 6e5, 60) + draw.normal(0.0, 1e3, 60))
    assert np.unique(grouped(sweep)).size == 12  # a first row apart makes no levels of a sweep


def test_without_held_out_points_a_perfect_law_comes_first_and_one_with_too_many_numbers_last():
    y = np.arange(8.0)
    miss = np.array([1.0, -1.0] * 4)
    cases = {"perfect": (y, 2), "poor": (y + 3.0 * miss, 1), "good": (y + miss, 2)}
    cases["as many"] = (y + 0.1 * miss, 6)
    fits = {name: SimpleNamespace(scores=scores(y, *case)) for name, case in cases.items()}
    ranked = sorted(fits, key=lambda name: _rank(SimpleNamespace(held_out=None, fit=fits[name])))
    assert ranked == ["perfect", "good", "poor", "as many"]


def test_a_branch_is_not_held_where_no_pressure_moves_it(tmp_path):
    path = tmp_path / "loop.csv"
    rows = [f"{p},{18.0 + 0.5 * math.atan(2.4 - 0.008 * p)!r}" for p in range(0, 601, 50)]
    path.write_text("\n".join(["p_kpa,length_cm", *rows]), encoding="utf-8")
    with refused("`held` k1 = 0"):
        fit(path, model="arctangent", held={"k1": 0.0})


def test_a_loop_whose_lengths_are_all_above_the_nominal_one_has_no_contraction(tmp_path):
    path = tmp_path / "loop.csv"
    length = 28.0 - np.arctan(0.01 * (np.arange(0.0, 501.0, 50.0) - 200.0))
    rows = [f"{50 * k},{each!r}" for k, each in enumerate(length.tolist())]
    path.write_text("\n".join(["p_kpa,length_cm", *rows]))
    with pytest.raises(InputError, match="`nominal_length` = 250 mm: no length of the table"):
        fit(path, model="arctangent", nominal_length=0.25, hold_out="none")
