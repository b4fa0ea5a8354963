"""What a calibration does not determine is flagged: dead, flat, traded off, not pinned."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.inference.estimate import Flag
from pamsim.inference.fit_simulator import fit_simulator
from pamsim.inference.free_parameter import Prior
from pamsim.inference.simulator_fit import FitStatus
from tests.unit.inference.closed_form_rigs import TIME, Rig, free, line_rig

NOISE = 0.01 * np.random.default_rng(0).standard_normal(TIME.size)


def rig(curve, truth):
    return Rig([("t", "p", "angle", curve, curve(np.asarray(truth)) + NOISE)])


def flags(fit):
    return {p.name: set(p.flags) for p in fit.parameters}


def product(v):
    return v[0] * v[1] * np.exp(-v[2] * TIME)


def test_a_product_is_determined_though_its_factors_are_not():
    three = (free("a", 2.0, scale="log"), free("b", 2.0, scale="log"), free("rate", 2.0))
    fit = fit_simulator(rig(product, [2.0, 3.0, 1.0]), three)
    assert fit.status is FitStatus.NOT_IDENTIFIABLE
    assert fit.determined == ("a * b",)
    assert "do not determine a, b, only a * b" in fit.sentence
    flat = {Flag.FLAT_DIRECTION}
    assert flags(fit) == {"a": flat, "b": flat, "rate": set()}
    assert fit.parameters[0].partners == ("b",)
    assert fit.parameters[0].interval95 is fit.parameters[1].interval95 is None
    assert np.all(np.isnan(fit.covariance[0]))
    assert fit.values[0] * fit.values[1] == pytest.approx(6.0, rel=0.01)
    low, high = fit.parameters[2].interval95
    assert low < 1.0 < high
    assert high - low < 0.02


@pytest.mark.parametrize(
    ("curve", "scale", "text"),
    [
        (lambda v: v[0] ** 2 / v[1] * np.exp(-TIME), "log", "a / b^0.5"),
        (lambda v: (v[0] + 2.0 * v[1]) * np.exp(-TIME), "linear", "a + 2 b"),
        (lambda v: (v[0] - v[1]) * np.exp(-TIME), "linear", "a - b"),
    ],
)
def test_the_determined_combination_is_written_as_it_enters(curve, scale, text):
    pair = (free("a", 4.0, scale=scale), free("b", 2.0, scale=scale))
    fit = fit_simulator(rig(curve, [5.0, 2.0]), pair)
    assert fit.determined == (text,)


def test_two_combinations_of_three_parameters_are_both_written():
    def curve(v):
        return (v[0] + v[1]) * np.exp(-TIME) + (v[1] - v[2]) * np.exp(-4.0 * TIME)

    fit = fit_simulator(rig(curve, [3.0, 2.0, 1.0]), tuple(free(n, 2.0) for n in "abc"))
    assert set(fit.determined) == {"a + c", "b - c"}


def test_a_prior_holds_what_the_data_leave_open():
    known = Prior(mean=3.0, standard_deviation=0.1, source="data sheet")
    three = (free("a", 2.0), free("b", 2.0, prior=known), free("rate", 2.0))
    fit = fit_simulator(rig(product, [2.0, 3.0, 1.0]), three)
    assert fit.status is FitStatus.CONVERGED
    assert fit.values == pytest.approx([2.0, 3.0, 1.0], rel=0.01)
    assert fit.parameters[1].standard_error == pytest.approx(0.1, rel=1e-3)
    # a = 6 / b: its relative error is that of the prior.
    assert fit.parameters[0].standard_error / 2.0 == pytest.approx(0.1 / 3.0, rel=0.02)
    assert "its prior holds it" in fit.parameters[0].sentence
    assert fit.parameters[1].prior.share == pytest.approx(1.0, abs=0.01)


def test_a_prior_wider_than_the_range_holds_nothing():
    known = Prior(mean=3.0, standard_deviation=50.0, source="guess")
    three = (free("a", 2.0), free("b", 2.0, prior=known), free("rate", 2.0))
    fit = fit_simulator(rig(product, [2.0, 3.0, 1.0]), three)
    assert fit.status is FitStatus.NOT_IDENTIFIABLE


def test_a_dead_parameter_is_called_dead_and_spares_the_others():
    pair = (free("gain"), free("ghost"))
    fit = fit_simulator(rig(lambda v: v[0] * np.exp(-TIME), [2.0, 0.0]), pair)
    assert fit.status is FitStatus.NOT_IDENTIFIABLE
    assert flags(fit) == {"gain": set(), "ghost": {Flag.DEAD}}
    assert fit.parameters[1].interval95 is None
    assert fit.parameters[1].sentence == "the data do not depend on ghost"
    assert fit.parameters[0].interval95 is not None
    assert fit.determined == ()
    nothing = fit_simulator(rig(lambda v: np.exp(-TIME), [0.0]), (free("ghost"),))
    assert nothing.status is FitStatus.NOT_IDENTIFIABLE


def test_a_dead_parameter_with_a_prior_keeps_its_prior():
    known = Prior(mean=3.0, standard_deviation=0.2, source="data sheet")
    pair = (free("gain"), free("ghost", prior=known))
    fit = fit_simulator(rig(lambda v: v[0] * np.exp(-TIME), [2.0, 0.0]), pair)
    ghost = fit.parameters[1]
    assert fit.status is FitStatus.CONVERGED
    assert (ghost.value, ghost.standard_error) == pytest.approx((3.0, 0.2))
    assert ghost.flags == (Flag.DEAD,)


def test_a_trade_off_names_its_partner_and_keeps_its_interval():
    far = 100.0 + TIME  # slope and offset of a line far from the origin
    pair = (free("slope", 0.4, -5.0, 5.0), free("offset", 0.0, -500.0, 500.0))
    fit = fit_simulator(rig(lambda v: v[0] * far + v[1], [0.5, 3.0]), pair)
    assert Flag.TRADE_OFF in flags(fit)["slope"]
    assert fit.parameters[0].partners == ("offset",)
    assert fit.parameters[0].interval95 is not None
    assert abs(fit.correlation[0, 1]) > 0.95
    assert fit.status is FitStatus.CONVERGED


def test_an_error_larger_than_the_range_is_said():
    rows = np.column_stack([np.ones(10), np.linspace(-0.01, 0.01, 10)])
    measured = rows @ [1.0, 1.0] + 0.3 * np.cos(40.0 * np.arange(10))
    fit = fit_simulator(
        line_rig(rows, measured, noise_sd=None), (free("c"), free("k", 1.0, 0.5, 1.5))
    )
    assert fit.values[1] == pytest.approx(fit.values[1])
    k = fit.parameters[1]
    assert (Flag.NOT_PINNED in k.flags) or (Flag.AT_BOUND in k.flags)


def test_flags_do_not_depend_on_units():
    def scaled(v):
        return product([v[0] * 1e-6, v[1] * 1e6, v[2]])

    three = (free("a", 2e6, 1e5, 1e7), free("b", 2e-6, 1e-7, 1e-5), free("rate", 2.0))
    fit = fit_simulator(rig(scaled, [2e6, 3e-6, 1.0]), three)
    assert fit.status is FitStatus.NOT_IDENTIFIABLE
    assert flags(fit)["rate"] == set()
