"""What a calibration does not determine is flagged: dead, flat, traded off, not pinned."""

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


def test_determined_combinations_are_written_as_they_enter():
    def ratio(v):
        return v[0] ** 2 / v[1] * np.exp(-TIME)

    def two_sums(v):
        return (v[0] + v[1]) * np.exp(-TIME) + (v[1] - v[2]) * np.exp(-4.0 * TIME)

    for curve, truth, scale, texts in (
        (ratio, [5.0, 2.0], "log", {"a / b^0.5"}),
        (lambda v: (v[0] + 2.0 * v[1]) * np.exp(-TIME), [5.0, 2.0], "linear", {"a + 2 b"}),
        (lambda v: (v[0] - v[1]) * np.exp(-TIME), [5.0, 2.0], "linear", {"a - b"}),
        (two_sums, [3.0, 2.0, 1.0], "linear", {"a + c", "b - c"}),
    ):
        parameters = [free(n, 3.0, scale=scale) for n in "abc"[: len(truth)]]
        assert set(fit_simulator(rig(curve, truth), parameters).determined) == texts


def test_a_prior_holds_what_the_data_leave_open_unless_it_is_wider_than_the_range():
    def fitted(deviation):
        known = Prior(mean=3.0, standard_deviation=deviation, source="data sheet")
        three = (free("a", 2.0), free("b", 2.0, prior=known), free("rate", 2.0))
        return fit_simulator(rig(product, [2.0, 3.0, 1.0]), three)

    fit = fitted(0.1)
    a, b, _ = fit.parameters
    assert fit.status is FitStatus.CONVERGED
    assert fit.values == pytest.approx([2.0, 3.0, 1.0], rel=0.01)
    assert b.standard_error == pytest.approx(0.1, rel=1e-3)
    # a = 6 / b: its relative error is that of the prior.
    assert a.standard_error / 2.0 == pytest.approx(0.1 / 3.0, rel=0.02)
    assert "its prior holds it" in a.sentence
    assert b.prior.share == pytest.approx(1.0, abs=0.01)
    assert fitted(50.0).status is FitStatus.NOT_IDENTIFIABLE


def test_a_dead_parameter_is_called_dead_spares_the_others_and_keeps_its_prior():
    def curve(v):
        return v[0] * np.exp(-TIME)

    fit = fit_simulator(rig(curve, [2.0, 0.0]), (free("gain"), free("ghost")))
    assert fit.status is FitStatus.NOT_IDENTIFIABLE
    assert flags(fit) == {"gain": set(), "ghost": {Flag.DEAD}}
    gain, ghost = fit.parameters
    assert gain.interval95 is not None
    assert ghost.interval95 is None
    assert ghost.sentence == "the data do not depend on ghost"
    assert fit.determined == ()
    nothing = fit_simulator(rig(lambda v: np.exp(-TIME), [0.0]), (free("ghost"),))
    assert nothing.status is FitStatus.NOT_IDENTIFIABLE
    known = Prior(mean=3.0, standard_deviation=0.2, source="data sheet")
    fit = fit_simulator(rig(curve, [2.0, 0.0]), (free("gain"), free("ghost", prior=known)))
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


def test_an_error_larger_than_the_range_is_a_flag():
    rows = np.column_stack([np.ones(10), np.linspace(-0.01, 0.01, 10)])
    measured = rows @ [1.0, 1.0] + 0.3 * np.cos(40.0 * np.arange(10))
    pair = (free("c"), free("k", 1.0, 0.5, 1.5))
    k = fit_simulator(line_rig(rows, measured, noise_sd=None), pair).parameters[1]
    assert (Flag.NOT_PINNED in k.flags) or (Flag.AT_BOUND in k.flags)


def test_flags_do_not_depend_on_units():
    def scaled(v):
        return product([v[0] * 1e-6, v[1] * 1e6, v[2]])

    three = (free("a", 2e6, 1e5, 1e7), free("b", 2e-6, 1e-7, 1e-5), free("rate", 2.0))
    fit = fit_simulator(rig(scaled, [2e6, 3e-6, 1.0]), three)
    assert fit.status is FitStatus.NOT_IDENTIFIABLE
    assert flags(fit)["rate"] == set()


def test_a_number_that_the_data_do_not_depend_on_stays_as_it_was():
    line = rig(lambda v: v[0] * np.exp(-TIME) + 0.0 * v[1], [2.0, 0.0])
    fit = fit_simulator(line, (free("a"), free("idle", 0.0, 0.0, 5.0)))
    assert flags(fit) == {"a": set(), "idle": {Flag.DEAD}}
    assert fit.values[1] == 0.0
