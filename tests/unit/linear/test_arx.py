"""ARX least squares: recovery of planted models, equation (29), gain constraint, pole readings."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.linear.arx import (
    PoleStatus,
    UnderdeterminedError,
    fit_arx,
    time_constants_from_arx,
)
from pamsim.linear.discrete_structure import regression
from tests.unit.linear.planted import arx, refuses, simulated

T1, T2 = 0.090314, 0.57873  # Matiskova 2021, equation (31)
TS = 0.002


def zoh_second_order(t1: float, t2: float, gain: float, ts: float):
    """Exact zero-order hold of G2, from its partial fractions (t1 != t2)."""
    p1, p2 = np.exp(-ts / t1), np.exp(-ts / t2)
    c1, c2 = t1 / (t1 - t2), -t2 / (t1 - t2)  # y = K (c1 (1 - e1) + c2 (1 - e2))
    b1 = gain * (c1 * (1 - p1) + c2 * (1 - p2))
    b2 = -gain * (c1 * (1 - p1) * p2 + c2 * (1 - p2) * p1)
    return arx((-(p1 + p2), p1 * p2), (b1, b2), ts)


@pytest.mark.parametrize("static_gain", [None, 1.0])
def test_first_order_zero_order_hold_is_recovered_exactly(static_gain: float | None) -> None:
    pole = np.exp(-TS / 0.64595)
    u = np.random.default_rng(1).standard_normal(1500)
    y = simulated(arx((-pole,), (1.0 - pole,), TS), u)
    chain = time_constants_from_arx(fit_arx(y, u, TS, na=1, nb=1, static_gain=static_gain))
    assert chain.status is PoleStatus.LAGS
    assert chain.time_constants[0] == pytest.approx(0.64595, rel=1e-6)
    assert chain.gain == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(("static_gain", "gain"), [(None, 3.5), (1.0, 1.0), (3.5, 3.5)])
def test_second_order_zero_order_hold_is_recovered_exactly(
    static_gain: float | None, gain: float
) -> None:
    truth = zoh_second_order(T1, T2, gain, TS)
    u = np.random.default_rng(2).standard_normal(2500)
    model = fit_arx(simulated(truth, u), u, TS, na=2, nb=2, static_gain=static_gain)
    chain = time_constants_from_arx(model)
    assert chain.time_constants == pytest.approx((T1, T2), rel=1e-6)
    assert chain.gain == pytest.approx(gain, rel=1e-6)


@pytest.mark.parametrize(("na", "nb", "delay"), [(1, 1, 1), (2, 2, 1), (3, 2, 0), (2, 3, 4)])
def test_estimate_is_equation_29(na: int, nb: int, delay: int) -> None:
    rng = np.random.default_rng(3)
    u = rng.standard_normal(400)
    y = lfilter([0.0, 0.4, 0.2], [1.0, -0.9, 0.3], u) + 0.05 * rng.standard_normal(400)
    # Equation (29) term by term, written independently of `regression`.
    start = max(na, nb + delay - 1)
    matrix, vector = np.zeros((na + nb, na + nb)), np.zeros(na + nb)
    for t in range(start, 400):
        phi = np.array(
            [-y[t - i] for i in range(1, na + 1)] + [u[t - delay - i] for i in range(nb)]
        )
        matrix += np.outer(phi, phi)
        vector += phi * y[t]
    theta = np.linalg.inv(matrix) @ vector
    model = fit_arx(y, u, TS, na=na, nb=nb, delay=delay)
    np.testing.assert_allclose(model.coordinates, theta, atol=1e-8)
    assert model.n == 400 - start


def test_residual_variance_estimates_equation_error() -> None:
    rng = np.random.default_rng(4)
    u, noise = rng.standard_normal((2, 20000))
    y = lfilter([0.0, 0.5], [1.0, -0.8], u) + lfilter([1.0], [1.0, -0.8], 0.3 * noise)
    model = fit_arx(y, u, TS, na=1, nb=1)
    assert model.residual_variance == pytest.approx(0.09, rel=0.04)
    assert model.coordinates[0] == pytest.approx(-0.8, abs=0.01)  # equation error: no bias


@pytest.mark.parametrize("gain", [1.0, -3.0])
def test_held_gain_is_the_constrained_minimum(gain: float) -> None:
    rng = np.random.default_rng(5)
    u = rng.standard_normal(300)
    y = lfilter([0.0, 0.3], [1.0, -0.7], u) + 0.1 * rng.standard_normal(300)
    model = fit_arx(y, u, TS, na=1, nb=2, static_gain=gain)
    assert model.structure.static_gain(model.coordinates) == pytest.approx(gain)
    phi, target = regression(y, u, na=1, nb=2)
    gradient = phi.T @ (phi @ model.coordinates - target)
    # At the minimum the gradient is parallel to the constraint's normal.
    normal = np.array([-gain, 1.0, 1.0]) / np.sqrt(gain**2 + 2.0)
    np.testing.assert_allclose(gradient, normal * (gradient @ normal), atol=1e-9)
    assert np.linalg.norm(gradient) > 1e-3


@pytest.mark.parametrize(
    ("a", "status"),
    [
        ((-0.9,), PoleStatus.LAGS),
        ((0.4,), PoleStatus.NOT_POSITIVE),
        ((0.0,), PoleStatus.NOT_POSITIVE),
        ((-1.0,), PoleStatus.UNSTABLE),
        ((-1.3,), PoleStatus.UNSTABLE),
        ((-1.8, 0.9), PoleStatus.COMPLEX),
        ((-0.4, -0.2), PoleStatus.NOT_POSITIVE),
        ((-2.0, 1.2), PoleStatus.UNSTABLE),
    ],
)
def test_poles_that_are_no_lags_give_a_status_and_no_numbers(
    a: tuple[float, ...], status: PoleStatus
) -> None:
    chain = time_constants_from_arx(arx(a, (0.1,), TS))
    assert chain.status is status
    assert (len(chain.time_constants) == len(a)) == (status is PoleStatus.LAGS)
    assert (chain.gain is None) == (status is not PoleStatus.LAGS)
    assert "pole" in chain.sentence


def test_undetermined_and_bad_input_are_refused() -> None:
    rng = np.random.default_rng(7)
    u = rng.standard_normal(50)
    y = simulated(arx((-0.9,), (0.1,), TS), u)
    with pytest.raises(UnderdeterminedError, match=r"1 of 2 directions"):
        fit_arx(y, np.ones(50), TS, na=0, nb=2)
    with pytest.raises(UnderdeterminedError):  # first-order data, second-order model
        fit_arx(y, u, TS, na=2, nb=2)
    refuses("constant", fit_arx, np.ones(50), u, TS, na=1, nb=1)
    refuses("index 7", fit_arx, np.where(np.arange(50) == 7, np.nan, y), u, TS, na=1, nb=1)
    refuses("too short", fit_arx, y[:5], u[:5], TS, na=2, nb=2)
    refuses("sample time", fit_arx, y, u, 0.0, na=1, nb=1)
    refuses("one length", fit_arx, y, u[:-1], TS, na=1, nb=1)
    refuses("orders", fit_arx, y, u, TS, na=1, nb=0)
    refuses("static gain", fit_arx, y, u, TS, na=1, nb=1, static_gain=float("nan"))
    refuses("na=3", time_constants_from_arx, arx((0.1, 0.1, 0.1), (1.0,), TS))


def test_importing_arx_does_not_import_control() -> None:
    code = "import sys, pamsim.linear.arx; sys.exit('control' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
