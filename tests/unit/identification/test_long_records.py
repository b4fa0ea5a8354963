"""Searches that begin with a part of a long record end where those of the whole end."""

import numpy as np
import pytest

from pamsim.identification import records
from pamsim.identification.records import SignalRecord, growing_parts
from pamsim.identification.triangular import triangular_factor
from tests.unit.identification.planted import best_of, fit_continuous, fit_oe, record


@pytest.fixture
def short_parts(monkeypatch):
    monkeypatch.setattr(records, "_ROWS", 300)


def sizes(records):
    return [[each.output.size for each in part] for part in growing_parts(records)]


def test_parts_grow_to_the_whole(short_parts):
    one, many = [record(1, n=2000)], [record(seed, n=200) for seed in range(10)]
    assert sizes(one) == [[300], [1200], [2000]]
    assert sizes(many) == [[200], [200] * 6, [200] * 10]
    assert [part[-1].name for part in growing_parts(many)] == ["trial 0", "trial 9", "trial 9"]
    assert list(growing_parts(one))[-1] is one
    assert sizes([record(1, n=250)]) == [[250]]


def test_a_part_in_which_a_signal_hardly_moves_is_left_out(short_parts):
    late = np.zeros(2000)
    late[1500:] = np.repeat([1.0, -1.0], 250)
    early = 0.01 * np.random.default_rng(0).standard_normal(2000)
    time = 0.02 * np.arange(2000)
    for output in (late + early, early):  # input that rests, output that hardly moves
        given = late if output is not early else np.repeat([0.0, 1.0, 0.0, -1.0], 500)
        found = [SignalRecord("late", time, given, output + late)]
        assert sizes(found) == [[2000]]


@pytest.mark.parametrize("constants", [(0.1, 0.3), (0.1, 4.0)])
def test_fits_of_a_long_record_are_those_of_the_whole(monkeypatch, constants):
    # The slower lag takes longer than the first part.
    found = [record(3, n=4000, constants=constants, noise=0.05, hold=60)]
    whole = fit_continuous(found, order=2), fit_oe(found, nb=2, nf=2, nk=1)
    monkeypatch.setattr(records, "_ROWS", 300)
    by_parts = fit_continuous(found, order=2), fit_oe(found, nb=2, nf=2, nk=1)
    for one, other in zip(whole, by_parts, strict=True):
        # A difference that rounding errors of the filter spoil leaves a coefficient open to 1e-4.
        np.testing.assert_allclose(other.coordinates, one.coordinates, rtol=1e-5)
        assert other.estimates[0].interval95 == pytest.approx(one.estimates[0].interval95, rel=1e-5)


def test_what_a_part_has_shown_is_not_lost_in_a_local_minimum_of_the_next(monkeypatch):
    monkeypatch.setattr(records, "_ROWS", 800)
    lagging = {"constants": (0.04, 0.08, 4.3), "numerator": [-0.53, 1.0], "interval": 0.01}
    found = [record(0, n=4000, noise=0.002, hold=190, **lagging)]
    fit = fit_continuous(found, order=3, zeros=1)
    assert fit.time_constants == pytest.approx(lagging["constants"], rel=0.05)


@pytest.mark.parametrize("slow", [0.5, 6.0])
def test_a_scan_chooses_by_all_samples(short_parts, slow):
    found = [record(4, n=4000, constants=(0.1, slow), noise=0.01, hold=100)]
    best = best_of(found)
    assert (best.structure.order, best.structure.zeros, best.structure.integrators) == (2, 0, 0)
    constants = np.sort(np.real(best.structure.constants(best.x)))
    np.testing.assert_allclose(constants, [0.1, slow], rtol=0.05)
    assert best.cost == pytest.approx(0.01**2 * 4000, rel=0.1)


def test_a_drift_that_a_part_does_not_show_is_found_in_the_whole(short_parts):
    still = record(5, n=2500, noise=0.05)
    drift = np.where(still.time > 25.0, 0.02 * (still.time - 25.0), 0.0)
    moved = SignalRecord("drift", still.time, still.inputs, still.output + drift)
    assert best_of([moved]).structure.drift
    assert not best_of([still]).structure.drift


def test_a_triangular_factor_by_pieces_is_that_of_the_whole():
    rng = np.random.default_rng(6)
    for samples in (3, 1023, 2048, 5000, 1_050_000):
        columns = rng.normal(size=(samples, 3)) + rng.normal(size=(samples, 1))  # correlated
        triangle = triangular_factor(columns)
        assert triangle.shape == (3, 3)
        assert np.array_equal(triangle, np.triu(triangle))
        np.testing.assert_allclose(triangle.T @ triangle, columns.T @ columns, rtol=1e-9)
