"""Integrators, direct paths and free starts; instrumental variables; a scan that stays nested."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete, dlsim, tf2ss

from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.records import SignalRecord
from pamsim.identification.starts import instrumental_variable_starts, pole_coordinates
from pamsim.identification.status import FitStatus
from pamsim.identification.structure_scan import scan_structures
from tests.unit.identification.planted import (
    arx,
    best_of,
    cut_out,
    fit_continuous,
    lags,
    sampled,
    steps,
)

TS = 0.05
N = 400
THREE = np.convolve([0.05, 0.1, 1.0], [0.6, 1.0])


def test_an_integrating_plant_and_the_input_at_which_it_rests_are_recovered():
    # Stable by itself: lag and integrator, so that only the true input bias keeps it from running.
    record = cut_out([1.5], [0.3, 1.0, 0.0], 3, noise=0.0, bias=0.25)
    fit = fit_continuous([record], order=1, start="free", integrators=1)
    assert fit.status is FitStatus.CONVERGED
    assert [e.unit for e in fit.estimates] == ["m/V/s", "s", "V"]
    assert [e.value for e in fit.estimates] == pytest.approx([1.5, 0.3, 0.25], rel=1e-4)
    assert fit.poles[0] == 0.0
    given = steps(np.random.default_rng(10), N, 12)
    output = sampled([1.5], [0.3, 1.0, 0.0], given, TS) + 0.02 * TS * np.arange(N)
    record = SignalRecord("one integrator", TS * np.arange(N), given, output)
    once = fit_continuous([record], order=1, start="free", integrators=1)
    twice = fit_continuous([record], order=1, zeros=1, start="free", integrators=2)
    assert (once.status, twice.status) == (FitStatus.CONVERGED, FitStatus.DEGENERATE)
    assert "a zero slower than the longest record" in twice.sentence


def test_a_direct_path_is_recovered_from_a_free_start():
    below = np.convolve([1.0 / 16.0, 2.0 * 0.1 / 4.0, 1.0], [0.8, 1.0])
    above = [0.02, 0.1, 0.5, 2.0]
    given = steps(np.random.default_rng(4), N, 12)
    a, b, c, d, _ = cont2discrete(tf2ss(above, below), TS)
    _, output, _ = dlsim((a, b, c, d, TS), given, x0=[3.0, -1.0, 0.5])
    record = SignalRecord("moving", TS * np.arange(N), given, output[:, 0] + 0.7)
    fit = fit_continuous([record], order=3, zeros=3, real_lags=False, start="free")
    assert fit.numerator == pytest.approx(above, rel=1e-3, abs=1e-4)
    assert fit.fit_percent > 99.99


def test_instrumental_variables_find_the_poles_without_a_grid():
    below = np.convolve([1.0 / 36.0, 2.0 * 0.2 / 6.0, 1.0], [0.1, 1.0])
    record = cut_out([0.2, 1.0], below, 5, noise=0.02)
    structure = ContinuousStructure(3, 2, False, False, "free")
    problem = structure.problem([record])

    def cost(x):
        return float(np.sum(problem.linear_part(x).residual ** 2))

    least = cost(pole_coordinates(-1.0 / np.roots(below)))
    starts = instrumental_variable_starts(structure, [record])
    assert min(map(cost, starts)) < 1.05 * least


@settings(max_examples=15, deadline=None)
@given(
    sizes=st.lists(st.floats(0.01, 10.0), min_size=1, max_size=3),
    damping=st.floats(0.05, 0.95),
    real=st.lists(st.floats(0.01, 10.0), max_size=3),
)
def test_pole_coordinates_keep_the_polynomial(sizes, damping, real):
    pairs = [size * np.exp(sign * 1j * np.arccos(damping)) for size in sizes for sign in (1, -1)]
    constants = np.array([*pairs, *real][:6])
    structure = ContinuousStructure(constants.size, real_lags=False)
    below = np.array([1.0])
    for constant in constants:
        below = np.convolve(below, [constant, 1.0])
    again = structure.denominator(pole_coordinates(constants))
    np.testing.assert_allclose(again, np.real(below), rtol=1e-8)


def test_the_slowest_mode_is_that_of_the_slowest_pole():
    pair, real, decay = np.log([2.0, 0.1]), np.log([0.2, 3.0]), np.exp(-0.5 / 4.0)
    for structure, coordinates, seconds in (
        (ContinuousStructure(0), np.array([1.0]), 0.0),
        (ContinuousStructure(2), real, 3.0),
        (ContinuousStructure(2, real_lags=False), pair, 1.0 / (2.0 * 0.1)),
        (ContinuousStructure(2, integrators=1), real, np.inf),
        (*arx([-decay], [1.0], 0.5), 4.0),
    ):
        assert structure.slowest(coordinates) == pytest.approx(seconds)


def test_a_scan_finds_the_structure_and_stays_nested():
    fits = scan_structures([cut_out([1.0], THREE, 6, noise=0.01)], start="free")
    best = min(fits, key=lambda fit: fit.criterion).structure
    assert (best.order, best.drift) == (3, False)
    cost = {}
    for fit in fits:
        s = fit.structure
        if not (s.integrators or s.dead_time):
            cost[s.order, s.zeros] = fit.cost
    assert cost[3, 0] < 0.1 * min(c for (n, _), c in cost.items() if n < 3)
    for (order, zeros), value in cost.items():
        for (fewer, less), simple in cost.items():
            if fewer <= order and less <= zeros and order - fewer <= zeros - less:
                assert value < 1.02 * simple, ((order, zeros), (fewer, less))


def test_an_integrator_is_found_behind_a_dead_time():
    # Without the dead time a lag explains more than an integrator, and the zero hides both.
    draw = np.random.default_rng(8)
    given = steps(draw, N + 100, 8)
    given = given - np.mean(given)
    given[80:100] = given[100]  # a model has no input from before its record
    output = sampled([-1.8, 1.0], [0.9, 1.0, 0.0], given, TS, delay=12 * TS)
    output = output + 0.02 * np.std(output) * draw.normal(size=output.size)
    record = SignalRecord("late", TS * np.arange(N), given[100:], output[100:])
    best = best_of([record]).structure
    assert (best.order, best.integrators, best.zeros, best.dead_time) == (1, 1, 1, True)


def test_a_drift_is_in_the_scan_where_the_record_shows_it_and_did_not_begin_at_rest():
    record = cut_out([1.0], lags(0.6), 9, noise=0.02, drift=1.0)
    best = best_of([record])
    assert (best.structure.order, best.structure.drift) == (1, True)
    assert not any(fit.structure.drift for fit in scan_structures([record], start="rest"))


def test_no_structure_wins_by_an_output_that_leads_its_input():
    given = np.repeat(np.random.default_rng(11).uniform(-1.0, 1.0, 40), 10)
    given[:10] = 0.0
    late = sampled([2.0], lags(0.3), np.append(given, given[-1]), TS)
    # Each row's output is read after its input acted.
    output = late[1:] + 0.01 * np.random.default_rng(12).normal(size=N)
    fits = scan_structures([SignalRecord("early", TS * np.arange(N), given, output)], start="rest")
    assert all(np.all(fit.structure.delays(fit.coordinates) >= 0.0) for fit in fits)
    best = min(fits, key=lambda fit: fit.criterion)
    assert (best.structure.order, best.structure.zeros, best.structure.dead_time) == (1, 1, False)
    assert best.theta[0] == pytest.approx(2.0, rel=0.01)


def test_a_plant_without_memory_is_a_gain():
    draw = np.random.default_rng(13)
    given = steps(draw, N, 12)
    output = 2.0 * given + 0.01 * draw.normal(size=N)
    record = SignalRecord("gain", TS * np.arange(N), given, output)
    best = best_of([record], start="rest")
    assert best.structure.sentence == "a gain"
    assert best.theta == pytest.approx([2.0], rel=0.01)
