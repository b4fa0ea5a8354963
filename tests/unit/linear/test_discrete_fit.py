"""ARX and output error of any orders: planted models, bias, several trials, intervals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.linear.arx import UnderdeterminedError
from pamsim.linear.discrete_fit import fit_arx_records, fit_oe
from pamsim.linear.discrete_structure import DiscreteStructure, regression
from pamsim.linear.identified_model import FitStatus
from pamsim.linear.signal_record import SignalRecord
from tests.unit.linear.planted import record, refuses, steps

TS = 0.02


def discrete(seed, a, b, nk, *, noise=0.0, through_a=False, offset=1.5, n=500):
    """``y = B/A u + offset`` and white noise, on the output or through 1/A."""
    rng = np.random.default_rng(seed)
    u = steps(rng, n, 10)
    white = noise * rng.standard_normal(n)
    y = lfilter([0.0] * nk + list(b), [1.0, *a], u)
    y = y + (lfilter([1.0], [1.0, *a], white) if through_a else white) + offset
    return SignalRecord(f"d{seed}", TS * np.arange(n), u, y, ("Pa",), "rad")


@pytest.mark.parametrize("fit", ["arx", "oe"])
@pytest.mark.parametrize(
    ("a", "b", "nk"),
    [
        ((-0.9,), (0.3,), 1),
        ((-1.6, 0.63), (0.02, 0.05), 3),
        ((-1.5, 0.8), (0.1, -0.04, 0.02), 0),
        ((-2.55, 2.2, -0.64), (0.01, 0.02), 2),
    ],
)
def test_planted_models_of_any_order_are_recovered(fit, a, b, nk) -> None:
    given = [discrete(1, a, b, nk), discrete(2, a, b, nk, offset=-9.0)]
    if fit == "arx":
        model = fit_arx_records(given, na=len(a), nb=len(b), nk=nk)
    else:
        model = fit_oe(given, nb=len(b), nf=len(a), nk=nk)
    assert model.status is FitStatus.CONVERGED
    assert model.coordinates == pytest.approx([*a, *b], abs=1e-6)
    assert model.denominator == pytest.approx([1.0, *a], abs=1e-6)
    assert model.numerator == pytest.approx(b, abs=1e-6)
    assert model.fit_percent == pytest.approx(100.0, abs=1e-3)
    assert [t.offset for t in model.trials] == pytest.approx([1.5, -9.0], abs=1e-4)


def test_offsets_are_those_of_a_column_of_ones_for_each_trial() -> None:
    options = {"noise": 0.01, "through_a": True}
    given = [
        discrete(3, (-1.6, 0.63), (0.02, 0.05), 1, **options),
        discrete(4, (-1.6, 0.63), (0.02, 0.05), 1, offset=-9.0, **options),
    ]
    blocks = [regression(r.output, r.input, na=2, nb=2) for r in given]
    ones = np.kron(np.eye(2), np.ones((blocks[0][1].size, 1)))
    design = np.hstack([np.concatenate([phi for phi, _ in blocks]), ones])
    theta, square, *_ = np.linalg.lstsq(design, np.concatenate([y for _, y in blocks]))
    model = fit_arx_records(given, na=2, nb=2, nk=1)
    assert model.coordinates == pytest.approx(theta[:4], rel=1e-8)
    freedom = design.shape[0] - design.shape[1]
    covariance = float(square[0]) / freedom * np.linalg.inv(design.T @ design)
    assert model.covariance == pytest.approx(covariance[:4, :4], rel=1e-6)


def test_sensor_noise_biases_arx_and_not_output_error() -> None:
    given = [record(s, constants=(0.1, 0.5), noise=0.1, n=1000) for s in range(2)]
    arx = fit_arx_records(given, na=2, nb=2, nk=1)
    oe = fit_oe(given, nb=2, nf=2, nk=1)
    slowest = -TS / np.log(max(abs(z) for z in oe.poles))
    assert slowest == pytest.approx(0.5, rel=0.05)
    assert oe.fit_percent > arx.fit_percent + 5.0
    assert arx.fit_percent_one_step > arx.fit_percent + 5.0
    assert "prefer output error" in arx.sentence


def test_poles_have_their_continuous_equivalents() -> None:
    fit = fit_oe([record(4, constants=(0.1, 0.5))], nb=2, nf=2, nk=1)
    assert [s.real for s in fit.continuous_poles if s] == pytest.approx([-2.0, -10.0], rel=1e-4)
    times = {e.name: e.value for e in fit.estimates if e.name.startswith("T")}
    assert times == pytest.approx({"T1": 0.1, "T2": 0.5}, rel=1e-4)
    lonely = fit_arx_records([discrete(5, (0.5,), (1.0,), 1)], na=1, nb=1, nk=1)
    assert lonely.continuous_poles == (None,)
    assert "no continuous equivalent" in lonely.sentence


@pytest.mark.parametrize("kind", ["arx", "oe", "oe coloured"])
def test_intervals_cover(kind: str) -> None:
    truth = {"K": 3.0, "T": -TS / np.log(0.9), "a1": -0.9, "b1": 0.3}
    runs, hits = 30, dict.fromkeys(truth, 0)
    for seed in range(runs):
        options = {"noise": 0.2, "n": 300, "through_a": kind != "oe"}
        given = discrete(100 + seed, (-0.9,), (0.3,), 1, **options)
        if kind == "arx":
            fit = fit_arx_records([given], na=1, nb=1, nk=1)
        else:
            fit = fit_oe([given], nb=1, nf=1, nk=1)
        for item in fit.estimates:
            low, high = item.interval95
            hits[item.name] += low < truth[item.name] < high
    # Binomial(30, 0.95): 99.9 % of seeds give at least 24 hits.
    assert min(hits.values()) >= 24, hits


def test_unexcited_directions_and_mixed_rates_are_refused() -> None:
    u = np.append(np.zeros(5), np.ones(95))
    flat = SignalRecord("flat", TS * np.arange(100), u, lfilter([0.0, 0.1], [1.0, -0.9], u))
    with pytest.raises(UnderdeterminedError, match="not excited"):
        fit_arx_records([flat], na=2, nb=4, nk=1)
    refuses("sampled every", fit_oe, [record(6), record(7, interval=0.01)], nb=1, nf=1, nk=1)
    refuses("nf=0", fit_oe, [record(6)], nb=1, nf=0, nk=1)


@pytest.mark.parametrize(
    ("poles", "size"),
    [((0.9, 0.5), 0.9), ((1.2, 0.5), 0.5), ((0.5, 0.0), 0.5)],
)
def test_the_slowest_decay_is_that_of_the_largest_stable_pole(
    poles: tuple[float, float], size: float
) -> None:
    structure = DiscreteStructure("arx", na=2, nb=1, nk=1, sample_time=0.01)
    coordinates = np.append(np.poly(poles)[1:], 1.0)
    assert structure.slowest(coordinates) == pytest.approx(-0.01 / np.log(size), rel=1e-9)
