"""ARX and output error: planted models, the paper's equation (29), bias, held gain, poles."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.fit import fit
from pamsim.identification.records import SignalRecord
from pamsim.identification.status import FitStatus
from tests.unit.identification.planted import fit_arx, fit_oe, record, refuses, steps

TS = 0.02
FIRST = 3.0  # input at which a record begins


def discrete(seed, a, b, nk, *, noise=0.0, through_a=False, offset=1.5, n=500):
    """``y = B/A u + offset`` and white noise, on the output or through 1/A."""
    rng = np.random.default_rng(seed)
    u = steps(rng, n, 10)
    white = noise * rng.standard_normal(n)
    y = lfilter([0.0] * nk + list(b), [1.0, *a], u)
    y = y + (lfilter([1.0], [1.0, *a], white) if through_a else white) + offset
    return SignalRecord(f"d{seed}", TS * np.arange(n), u + FIRST, y, ("Pa",), "rad")


@pytest.mark.parametrize(
    ("a", "b", "nk"),
    [
        ((-0.9,), (0.3,), 1),
        ((-1.6, 0.63), (0.02, 0.05), 3),
        ((-1.5, 0.8), (0.1, -0.04, 0.02), 0),
        ((-2.55, 2.2, -0.64), (0.01, 0.02), 2),
    ],
)
def test_planted_models_of_any_order_are_recovered(a, b, nk):
    given = [discrete(1, a, b, nk), discrete(2, a, b, nk, offset=-9.0)]
    for model in (
        fit_arx(given, na=len(a), nb=len(b), nk=nk),
        fit_oe(given, nb=len(b), nf=len(a), nk=nk),
    ):
        assert model.status is FitStatus.CONVERGED
        assert model.denominator == pytest.approx([1.0, *a], abs=1e-6)
        assert model.numerator == pytest.approx(b, abs=1e-6)
        assert model.fit_percent == pytest.approx(100.0, abs=1e-3)
        assert model.dead_time == pytest.approx(nk * TS)
        assert [t.offset for t in model.trials] == pytest.approx([1.5, -9.0], abs=1e-4)
        gain = sum(b) / (1.0 + sum(a))
        assert model.level == pytest.approx(-3.75 - gain * FIRST, rel=1e-3)
        w, z = np.array([0.1, 2.0, 60.0]), np.exp(1j * TS * np.array([0.1, 2.0, 60.0]))
        expected = np.polyval(b, z) / np.polyval([1.0, *a], z) * z ** (len(a) - len(b) + 1.0 - nk)
        found = model.structure.frequency_response(model.coordinates, w)
        np.testing.assert_allclose(found, expected, rtol=1e-3)


@pytest.mark.parametrize(("a", "b", "nk"), [((-0.9,), (0.3,), 4), ((-1.6, 0.63), (0.02, 0.05), 1)])
def test_a_trial_that_begins_in_motion_is_met_from_a_free_state_and_not_from_rest(a, b, nk):
    given = []
    for one in (discrete(1, a, b, nk), discrete(2, a, b, nk)):
        cut = int(np.flatnonzero(np.diff(one.input))[4]) + 2  # soon after a step
        given.append(one.part(slice(cut, None)))
    free, rest = (
        fit(given, DiscreteStructure("oe", len(a), len(b), nk, TS, start))
        for start in ("free", "rest")
    )
    assert free.denominator == pytest.approx([1.0, *a], abs=1e-6)
    assert free.numerator == pytest.approx(b, abs=1e-6)
    assert free.fit_percent == pytest.approx(100.0, abs=1e-3)
    assert rest.fit_percent < 98.0
    assert free.level == pytest.approx(1.5 - sum(b) / (1.0 + sum(a)) * FIRST, abs=1e-4)
    # As many coefficients more as samples that what went before acts in.
    states = max(len(a), nk + len(b) - 1)
    assert free.structure.counted(2) - rest.structure.counted(2) == 2 * states
    arx = fit(given, DiscreteStructure("arx", len(a), len(b), nk, TS, "free"))
    assert arx.fit_percent == pytest.approx(100.0, abs=1e-3)


def test_offsets_are_those_of_a_column_of_ones_for_each_trial():
    options = {"noise": 0.01, "through_a": True}
    given = [
        discrete(3, (-1.6, 0.63), (0.02, 0.05), 1, **options),
        discrete(4, (-1.6, 0.63), (0.02, 0.05), 1, offset=-9.0, **options),
    ]
    blocks = [stacked(r.output, r.input, na=2, nb=2) for r in given]
    ones = np.kron(np.eye(2), np.ones((blocks[0][1].size, 1)))
    design = np.hstack([np.concatenate([phi for phi, _ in blocks]), ones])
    theta, square, *_ = np.linalg.lstsq(design, np.concatenate([y for _, y in blocks]))
    model = fit_arx(given, na=2, nb=2, nk=1)
    assert model.coordinates == pytest.approx(theta[:4], rel=1e-8)
    freedom = design.shape[0] - design.shape[1]
    covariance = float(square[0]) / freedom * np.linalg.inv(design.T @ design)
    assert model.covariance == pytest.approx(covariance[:4, :4], rel=1e-6)


def test_sensor_noise_biases_arx_and_not_output_error():
    given = [record(s, constants=(0.1, 0.5), noise=0.1, n=1000) for s in range(2)]
    arx = fit_arx(given, na=2, nb=2, nk=1)
    oe = fit_oe(given, nb=2, nf=2, nk=1)
    slowest = -TS / np.log(max(abs(z) for z in oe.poles))
    assert slowest == pytest.approx(0.5, rel=0.05)
    assert oe.fit_percent > arx.fit_percent + 5.0
    assert arx.fit_percent_one_step > arx.fit_percent + 5.0
    assert "prefer output error" in arx.sentence


def test_poles_have_their_continuous_equivalents():
    fit = fit_oe([record(4, constants=(0.1, 0.5))], nb=2, nf=2, nk=1)
    assert [s.real for s in fit.continuous_poles if s] == pytest.approx([-2.0, -10.0], rel=1e-4)
    times = {e.name: e.value for e in fit.estimates if e.name.startswith("T")}
    assert times == pytest.approx({"T1": 0.1, "T2": 0.5}, rel=1e-4)
    lonely = fit_arx([discrete(5, (0.5,), (1.0,), 1)], na=1, nb=1, nk=1)
    assert lonely.continuous_poles == (None,)
    assert "no continuous equivalent" in lonely.sentence
    for poles, size in (((0.9, 0.5), 0.9), ((1.2, 0.5), 0.5), ((0.5, 0.0), 0.5)):
        structure = DiscreteStructure("arx", na=2, nb=1, nk=1, sample_time=0.01)
        decay = structure.slowest(np.append(np.poly(poles)[1:], 1.0))  # of the stable ones
        assert decay == pytest.approx(-0.01 / np.log(size), rel=1e-9)


@pytest.mark.parametrize("kind", ["arx", "oe", "oe coloured"])
def test_intervals_cover(kind):
    planted = {"K": 3.0, "T": -TS / np.log(0.9), "a1": -0.9, "b1": 0.3}
    runs, hits = 25, dict.fromkeys(planted, 0)
    for seed in range(runs):
        options = {"noise": 0.2, "n": 300, "through_a": kind != "oe"}
        given = [discrete(100 + seed, (-0.9,), (0.3,), 1, **options)]
        fit_one = fit_arx if kind == "arx" else fit_oe
        fit = fit_one(given, nb=1, nk=1, **{"na" if kind == "arx" else "nf": 1})
        for item in fit.estimates:
            low, high = item.interval95
            hits[item.name] += low < planted[item.name] < high
    # Binomial(25, 0.95): 99.9 % of seeds give at least 20 hits.
    assert min(hits.values()) >= 20, hits


def derived(structure, coordinates):
    """Gain, a, b and logarithms of the rising time constants, by the roots."""
    a, b = structure.denominator(coordinates), structure.numerator(coordinates)
    times = np.sort(-TS / np.log(np.real(np.roots(a))))
    return np.concatenate([[np.sum(b) / np.sum(a)], a[1:], b, np.log(times)])


@pytest.mark.parametrize("kind", ["arx", "oe"])
def test_intervals_of_two_poles_are_those_of_their_derivatives(kind):
    options = {"noise": 0.01, "through_a": kind == "arx", "n": 1000}
    given = [discrete(11, (-1.6, 0.63), (0.02, 0.05), 1, **options)]
    model = (fit_arx if kind == "arx" else fit_oe)(
        given, nb=2, nk=1, **{"na" if kind == "arx" else "nf": 2}
    )
    x = model.coordinates
    sensitivities = np.column_stack(
        [
            (derived(model.structure, x + step) - derived(model.structure, x - step)) / 2e-7
            for step in 1e-7 * np.eye(4)
        ]
    )
    halves = model.quantile * np.sqrt(np.diag(sensitivities @ model.covariance @ sensitivities.T))
    names = ["K", "a1", "a2", "b1", "b2", "T1", "T2"]
    for name, value, half in zip(names, derived(model.structure, x), halves, strict=True):
        interval = model[name].interval95
        ends = np.log(interval) if name[0] == "T" else interval
        assert ends == pytest.approx([value - half, value + half], rel=1e-3), name


def undisturbed(output, given, interval=TS):
    return [SignalRecord("x", interval * np.arange(given.size), given, output)]


def stacked(y, u, *, na, nb, delay=1):
    """Regression vectors and outputs, term by term."""
    start = max(na, nb + delay - 1)
    rows = [
        [-y[t - i] for i in range(1, na + 1)] + [u[t - delay - i] for i in range(nb)]
        for t in range(start, y.size)
    ]
    return np.array(rows), y[start:]


@pytest.mark.parametrize(("na", "nb", "delay"), [(1, 1, 1), (2, 2, 1), (3, 2, 0), (2, 3, 4)])
def test_estimate_is_equation_29(na, nb, delay):
    rng = np.random.default_rng(3)
    u = rng.standard_normal(400)
    y = lfilter([0.0, 0.4, 0.2], [1.0, -0.9, 0.3], u) + 0.05 * rng.standard_normal(400)
    phi, target = stacked(y, u, na=na, nb=nb, delay=delay)
    expected = np.linalg.inv(phi.T @ phi) @ (phi.T @ target)
    model = fit_arx(undisturbed(y, u), na=na, nb=nb, nk=delay, held={"offset": 0.0})
    np.testing.assert_allclose(model.coordinates, expected, atol=1e-8)


def test_the_noise_of_arx_is_its_equation_error():
    rng = np.random.default_rng(4)
    u, noise = rng.standard_normal((2, 20000))
    y = lfilter([0.0, 0.5], [1.0, -0.8], u) + lfilter([1.0], [1.0, -0.8], 0.3 * noise)
    model = fit_arx(undisturbed(y, u), na=1, nb=1, nk=1)
    assert model.noise.variance == pytest.approx(0.09, rel=0.04)
    assert model.coordinates[0] == pytest.approx(-0.8, abs=0.01)  # equation error: no bias


def test_held_gain_is_the_constrained_minimum():
    rng = np.random.default_rng(5)
    u = rng.standard_normal(300)
    y = lfilter([0.0, 0.3], [1.0, -0.7], u) + 0.1 * rng.standard_normal(300)
    for gain in (1.0, -3.0):
        held = {"K": gain, "offset": 0.0}
        model = fit_arx(undisturbed(y, u), na=1, nb=2, nk=1, held=held)
        assert model.gain == pytest.approx(gain)
        phi, target = stacked(y, u, na=1, nb=2)
        gradient = phi.T @ (phi @ model.coordinates - target)
        # At the minimum the gradient is parallel to the constraint's normal.
        normal = np.array([-gain, 1.0, 1.0]) / np.sqrt(gain**2 + 2.0)
        np.testing.assert_allclose(gradient, normal * (gradient @ normal), atol=1e-9)
        assert np.linalg.norm(gradient) > 1e-3


def test_undetermined_and_bad_input_are_refused():
    held = np.append(np.zeros(5), np.ones(95))
    flat = SignalRecord("flat", TS * np.arange(100), held, lfilter([0.0, 0.1], [1.0, -0.9], held))
    for given, orders in (
        (flat, {"na": 2, "nb": 4}),
        (discrete(7, (-0.9,), (0.1,), 1, n=50, offset=0.0), {"na": 2, "nb": 2}),  # of one pole
    ):
        fit = fit_arx([given], nk=1, **orders)
        assert fit.status is FitStatus.DEGENERATE
        assert "give an input that changes more often, or lower the order" in fit.sentence
    both = [record(6), record(7, interval=0.01)]
    refuses("too short", fit_arx, [record(6)], na=300, nb=2, nk=1)
    refuses("nb >= 1", fit_arx, [record(6)], na=1, nb=0, nk=1)
    refuses("nk >= 0", fit_arx, [record(6)], na=1, nb=1, nk=-1)
    refuses("na >= 0", fit_arx, [record(6)], na=-1, nb=1, nk=1)
    refuses("nf >= 1", fit_oe, [record(6)], nb=1, nf=0, nk=1)
    refuses("sampled every", fit_oe, both, nb=1, nf=1, nk=1)
    refuses("sampled every", fit_oe(both[:1], nb=1, nf=1, nk=1).simulate, both[1])
    refuses("K = nan is not finite", fit_arx, [record(6)], na=1, nb=1, nk=1, held={"K": np.nan})
    refuses("'T' cannot be held", fit_arx, [record(6)], na=1, nb=1, nk=1, held={"T": 1.0})


def test_fits_do_not_import_control():
    code = "import sys, pamsim.identification.fit; sys.exit('control' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
