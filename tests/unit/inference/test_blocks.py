"""Residual blocks whiten their noise, share units over channels, and are purged."""

from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg

from pamsim.core.errors import InputError
from pamsim.inference.blocks import (
    Block,
    correlation_length,
    cut,
    fitted_runs,
    most_parts,
    noise_from_repeats,
    unit_names,
    whitened,
)
from pamsim.inference.coloured_noise import ArNoise
from tests.unit.inference.closed_form_rigs import coloured

SLOW = ArNoise((-0.8, 0.3, -0.2, 0.1, 0.05), 2.0)
FIRST_ORDER = ArNoise((-0.9,), 1.0 - 0.9**2)


def block(size, noise=SLOW, start=0, unit="t", channel="angle", source="log"):
    rows = slice(start, start + size)
    return Block(unit=unit, channel=channel, rows=rows, noise=noise, source=source)


def test_the_sum_of_whitened_squares_is_the_likelihood_of_the_covariance():
    for size in (1, 3, 5, 60):  # also fewer rows than the noise has orders
        values = np.random.default_rng(size).standard_normal(size)
        covariance = scipy.linalg.toeplitz(SLOW.autocovariance(size))
        expected = values @ np.linalg.solve(covariance, values)
        assert np.sum(block(size).white(values) ** 2) == pytest.approx(expected), size


def test_blocks_are_whitened_one_by_one_and_all_columns_the_same():
    rng = np.random.default_rng(1)
    blocks = [block(40), block(3, start=40), block(30, FIRST_ORDER, start=43, unit="b")]
    jacobian, size = rng.standard_normal((73, 3)), rng.standard_normal(3)
    rows = whitened(blocks, jacobian)
    assert rows == pytest.approx(np.concatenate([b.white(jacobian[b.rows]) for b in blocks]))
    assert rows @ size == pytest.approx(whitened(blocks, jacobian @ size))
    assert unit_names(blocks) == ("t", "b")


def test_repeats_show_the_noise_whatever_the_model_misses():
    rng = np.random.default_rng(6)
    missed = 30.0 * np.sin(np.arange(800) / 50.0)
    protocols = [missed + np.stack([coloured(rng, 800, 0.9) for _ in range(3)]) for _ in range(4)]
    noise = noise_from_repeats([*protocols, missed[np.newaxis]])
    assert noise.standard_deviation == pytest.approx(1.0, abs=0.1)
    assert noise.autocovariance(6)[5] == pytest.approx(0.9**5, abs=0.1)
    with pytest.raises(InputError, match="repeated"):
        noise_from_repeats([missed[np.newaxis]])


def test_the_correlation_length_is_where_the_correlation_is_lost_in_its_error():
    assert correlation_length(ArNoise((), 3.0), 1000) == 0
    assert correlation_length(FIRST_ORDER, 10_000) == int(np.log(0.01) / np.log(0.9))
    slower = ArNoise((-0.99,), 1.0)
    assert correlation_length(slower, 10_000) == int(np.log(0.01) / np.log(0.99))


def test_parts_are_separated_by_the_gap_and_at_least_as_long():
    for size, gap in ((100, 0), (101, 7), (1000, 43), (10, 9)):
        whole = block(size, start=50)
        for parts in {1, most_parts(size, gap) // 2 or 1, most_parts(size, gap)}:
            pieces = cut(whole, parts, gap)
            assert len({p.unit for p in pieces}) == parts
            assert pieces[0].rows.start == 50
            assert pieces[-1].rows.stop == 50 + size
            between = [b.rows.start - a.rows.stop for a, b in pairwise(pieces)]
            assert between == [gap] * (parts - 1)
            assert parts == 1 or min(p.size for p in pieces) >= gap
        with pytest.raises(InputError, match="at most"):
            cut(whole, most_parts(size, gap) + 1, gap)


def test_fitted_rows_stay_a_gap_away_from_held_out_parts():
    whole = block(100, start=1000)
    parts = cut(whole, 5, 4)
    held_out = [parts[1], parts[4]]
    fitted = {r for run in fitted_runs(whole, held_out, 4) for r in range(*run.rows.indices(2000))}
    held = {r for part in held_out for r in range(*part.rows.indices(2000))}
    away = {r for r in range(1000, 1100) if min(abs(r - h) for h in held) > 4}
    assert fitted == away
    assert [run.unit for run in fitted_runs(whole, held_out, 4)] == ["t fitted 1", "t fitted 2"]
    assert fitted_runs(whole, [whole], 4) == ()
    (everything,) = fitted_runs(whole, [], 4)
    assert everything.rows == whole.rows


def test_useless_blocks_are_refused():
    with pytest.raises(InputError, match="no rows"):
        block(0)
    with pytest.raises(InputError, match="not positive"):
        block(3, ArNoise((), 0.0))
