"""Records that cannot be identified from are refused by name; how well a run fits a record."""

import numpy as np
import pytest

from pamsim.identification.records import SignalRecord, checked_records, fit_percent
from tests.unit.core.refusals import all_refused, refused

T = 0.01 * np.arange(50)
U = np.sign(np.sin(T * 40.0))
Y = np.cos(T)
FLAT = np.full(50, 3.0)


def made(name="arm_3", **changes):
    return SignalRecord(**{"name": name, "time": T, "inputs": U, "output": Y, **changes})


def test_bad_records_are_refused_by_name():
    late = made(time=T + 3.0)
    assert (late.sample_time, late.duration) == pytest.approx((0.01, 0.49))
    bad = {
        "lengths": ({"output": Y[:-1]}, "50 samples but response has 49"),
        "nan": ({"inputs": np.append(U[:-1], np.nan)}, "not finite"),
        "no input": ({"inputs": FLAT}, "input is constant"),
        "no inputs": ({"inputs": np.column_stack([FLAT, FLAT])}, "input is constant"),
        "no response": ({"output": FLAT}, "response is constant"),
        "tiny response": ({"output": Y * 1e-300}, "give it in another unit"),
        "huge response": ({"output": Y * 1e300}, "give it in another unit"),
        "tiny input": ({"inputs": U * 1e-320}, "input reaches 9.99989e-321"),
        "clock": ({"time": T**2}, "not uniform"),
        "backwards": ({"time": T[::-1]}, "does not increase"),
        "hold": ({"holds": ("cubic",)}, "hold 'cubic'"),
        "holds": ({"holds": ("zoh", "zoh")}, "2 entries for 1 inputs"),
        "short": ({"time": T[:8], "inputs": U[:8], "output": Y[:8]}, "too short"),
    }
    all_refused(bad, lambda changes: made(**changes), "arm_3")


def test_records_of_one_identification_fit_together():
    a, b = (made(name, units_input=(unit,)) for name, unit in (("a", "Pa"), ("b", "kPa")))
    both = made("c", inputs=np.column_stack([U, FLAT]), units_input=("Pa",), holds=("foh",))
    assert (both.units_input, both.holds) == (("Pa", "Pa"), ("foh", "foh"))
    bad = {
        "none": ([], "at least one"),
        "twice": ([a, a], "twice"),
        "units": ([a, b], "convert"),
        "inputs": ([a, both], "has 2 inputs but a 1"),
    }
    all_refused(bad, checked_records)
    assert checked_records([a]) == (a,)
    np.testing.assert_array_equal(a.input, U)
    with refused("has 2 inputs where one is expected"):
        _ = both.input


def test_fit_percent_is_100_less_the_share_of_the_deviation_in_any_unit():
    y = np.random.default_rng(11).standard_normal(200) + 5.0
    for share, percent in ((1.0, 100.0), (0.5, 50.0), (0.0, 0.0), (-2.0, -200.0)):
        run = y.mean() + share * (y - y.mean())
        assert fit_percent(y, run) == pytest.approx(percent, abs=1e-12)
        assert fit_percent(1e3 * y - 7.0, 1e3 * run - 7.0) == pytest.approx(percent, abs=1e-9)
    for exploded in (np.where(y > 5.0, np.inf, y), np.full(200, 1e300)):
        assert fit_percent(y, exploded) == float("-inf")
    bad = {
        "constant": (np.ones(5), np.ones(5), "constant"),
        "lengths": (y, y[:-1], "one length"),
        "nan": (np.append(y, np.nan), np.append(y, 0.0), "not finite"),
        "nothing": ([], [], "one length"),
    }
    all_refused(bad, fit_percent)
