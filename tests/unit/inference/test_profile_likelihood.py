"""Profiles: closed form where the simulator is linear, open sides where the data are silent."""

import json

import numpy as np
import pytest

from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError
from pamsim.inference.fit_simulator import fit_simulator
from pamsim.inference.profile_likelihood import profile
from tests.unit.inference.closed_form_rigs import (
    DECAY,
    TIME,
    Rig,
    coloured,
    decay_rig,
    free,
    line_rig,
)


def test_the_profile_of_a_linear_simulator_is_its_parabola():
    rng = np.random.default_rng(5)
    rows = rng.standard_normal((30, 3))
    measured = rows @ [1.0, -2.0, 0.5] + 0.1 * rng.standard_normal(30)
    three = tuple(free(n, 0.4, -10.0, 10.0) for n in "abc")
    rig = line_rig(rows, measured, noise_sd=0.1)
    fit = fit_simulator(rig, three)
    b = profile(rig, three, fit, "b")
    variance = 0.1**2 * np.linalg.inv(rows.T @ rows)[1, 1]
    parabola = (np.array(b.values) - fit.values[1]) ** 2 / variance
    assert b.rise == pytest.approx(parabola, rel=1e-5, abs=1e-6)
    assert (b.low, b.high) == pytest.approx(fit.parameters[1].interval95, rel=1e-5)
    assert "closed on both sides" in b.sentence
    assert b.values == tuple(sorted(b.values))
    json.dumps(to_dict(b), allow_nan=False)


def test_coloured_noise_widens_the_profile_as_it_widens_the_interval():
    rng = np.random.default_rng(2)
    rig = decay_rig([0.05 * coloured(rng, TIME.size, 0.9) for _ in range(3)])
    fit = fit_simulator(rig, DECAY)
    rate = profile(rig, DECAY, fit, "rate")
    assert rate.threshold > 3.0 * 3.84
    assert (rate.low, rate.high) == pytest.approx(fit.parameters[1].interval95, rel=0.03)


def test_a_flat_direction_closes_only_where_a_partner_ends():
    def curve(v):
        return v[0] * v[1] * np.exp(-TIME)

    noise = 0.01 * np.random.default_rng(0).standard_normal(TIME.size)
    rig = Rig([("t", "p", "angle", curve, curve([2.0, 3.0]) + noise)])
    pair = (free("a", 2.0, scale="log"), free("b", 2.0, scale="log"))
    fit = fit_simulator(rig, pair)
    a = profile(rig, pair, fit, "a")
    assert a.high is None
    assert a.low == pytest.approx(0.6, rel=0.01)  # there b is at its 10
    assert "a is at least 0.5" in a.sentence
    assert max(r for v, r in zip(a.values, a.rise, strict=True) if v > 0.61) < 0.01
    wide = (pair[0], free("b", 2.0, 1e-3, 1e3, scale="log"))
    open_ = profile(rig, wide, fit_simulator(rig, wide), "a")
    assert (open_.low, open_.high) == (None, None)
    assert "closes on neither side" in open_.sentence


def test_a_curved_simulator_has_a_lopsided_profile():
    def curve(v):
        return np.exp(-v[0] * TIME)

    noise = 0.3 * np.random.default_rng(3).standard_normal(TIME.size)
    one = (free("rate", 2.0),)
    rig = Rig([("t", "p", "angle", curve, curve([3.0]) + noise)], noise_sd=0.3)
    fit = fit_simulator(rig, one)
    found = profile(rig, one, fit, "rate")
    grid = np.linspace(1.0, 9.0, 4001)
    measured = rig.trials[0][4]
    cost = np.array([np.sum((curve([r]) - measured) ** 2) / 0.09 for r in grid])
    inside = grid[cost - np.min(cost) <= found.threshold]
    assert (found.low, found.high) == pytest.approx((inside[0], inside[-1]), abs=0.01)
    assert found.high - fit.values[0] > 1.1 * (fit.values[0] - found.low)


def test_a_region_that_diverges_ends_the_profile_and_no_other_name_has_one():
    rig = decay_rig(0.02 * np.random.default_rng(1).standard_normal((3, TIME.size)))
    fit = fit_simulator(rig, DECAY)
    rate = fit.parameters[1]
    edge = rate.value + 0.5 * rate.standard_error
    rig.diverges = lambda v: v[1] > edge
    found = profile(rig, DECAY, fit, "rate")
    assert found.high == pytest.approx(edge, abs=0.05 * rate.standard_error)
    assert None in found.rise
    with pytest.raises(InputError, match="did you mean 'rate'"):
        profile(rig, DECAY, fit, "rat")
