"""Parts of trials: apart, independent of what a log shares."""

from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.comparison.links import JOINT, MUSCLE, VALVES, Link
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.limits import Limits
from pamsim.diagnosis.by_link.units import MOST, Units, parts_of_trials
from pamsim.inference.blocks import Block, correlation_length
from pamsim.inference.coloured_noise import ArNoise

SLOW = ArNoise((-0.9,), 1.0 - 0.9**2)


def simulator(trials, rows, noise=SLOW):
    """Two links, two channels in the first."""
    links = (Link((VALVES,)), Link((MUSCLE, JOINT)))
    blocks, link_of, at = [], [], 0
    for name in trials:
        for link, channel in ((0, "pressure_1"), (0, "pressure_2"), (1, "angle")):
            blocks.append(Block(unit=name, channel=channel, rows=slice(at, at + rows), noise=noise))
            link_of.append(link)
            at += rows
    groups = [SimpleNamespace(name=n, trials=[SimpleNamespace(name=n)]) for n in trials]
    return SimpleNamespace(
        links=links, blocks=tuple(blocks), link_of=tuple(link_of), repeats=groups, size=at
    )


def parts(chain, held_out=(), *, gap=10):
    none = np.empty((chain.size, 0))
    return parts_of_trials(chain, held_out, gap=gap, varying=none)


def rows_of(side):
    return np.concatenate([np.arange(b.rows.start, b.rows.stop) for b in side.blocks])


@pytest.mark.parametrize(("trials", "rows"), [(("a",), 2000), (("a", "b", "c"), 500)])
def test_fitted_rows_and_judged_parts_are_apart(trials, rows):
    chain = simulator(trials, rows)
    gap = correlation_length(SLOW, rows)
    units = parts(chain, gap=gap)
    judged, fitted = units.judged.blocks, rows_of(units.fitted)
    for block in judged:
        own = [b for b in chain.blocks if b.rows.start <= block.rows.start < b.rows.stop]
        inside = fitted[(fitted >= own[0].rows.start) & (fitted < own[0].rows.stop)]
        near = np.minimum(abs(inside - block.rows.start), abs(inside - block.rows.stop + 1))
        assert near.size == 0 or near.min() > gap
        others = [b for b in judged if b is not block]
        assert all(
            b.rows.start - block.rows.stop >= gap or block.rows.start - b.rows.stop >= gap
            for b in others
            if own[0].rows.start <= b.rows.start < own[0].rows.stop
        )
    assert 5 <= len(units.judged.units) <= MOST / 2
    # All channels of a part are one unit.
    assert len(judged) == 3 * len(units.judged.units)
    assert 0.3 < rows_of(units.judged).size / (rows_of(units.judged).size + fitted.size) < 0.7


def test_of_a_trial_that_is_held_out_all_parts_are_judged_and_other_trials_are_fitted_whole():
    chain = simulator(("a", "b"), 1000)
    units = parts(chain, ["b"])
    assert {units.trial(name) for name in units.judged.units} == {"b"}
    assert units.fitted.units == ("a",)
    assert rows_of(units.fitted).tolist() == list(range(3000))
    assert units.judged.groups == {"b"}
    assert units.fitted.groups == {"a"}


def test_a_log_too_short_for_its_noise_is_refused():
    with pytest.raises(InputError, match="four times as long"):
        parts(simulator(("a",), 300), gap=40)


@pytest.mark.parametrize("judged", ["half", "all of one trial"])
def test_rows_are_independent_whatever_a_log_shares(judged):
    chain = simulator(("a", "b"), 60, ArNoise((), 1.0))
    varying = np.random.default_rng(0).normal(size=(chain.size, 3))
    held_out = () if judged == "half" else ["b"]
    units = parts_of_trials(chain, held_out, gap=4, varying=varying, limits=Limits(alpha=0.2))
    # Independent noise, and variations that the rows of a link in a log share.
    covariance = np.eye(chain.size)
    for name in ("a", "b"):
        for link in (0, 1):
            own = np.zeros(chain.size)
            for block, number in zip(chain.blocks, chain.link_of, strict=True):
                own[block.rows] = block.unit == name and number == link
            covariance += (varying * own[:, np.newaxis]) @ (varying * own[:, np.newaxis]).T
    basis = np.eye(chain.size)
    for side in (units.fitted, units.judged):
        rows = np.stack([side.whiten(one) for one in basis], axis=1)
        white = rows @ covariance @ rows.T
        np.testing.assert_allclose(white, np.eye(len(white)), atol=1e-9)


def test_without_variation_rows_are_those_of_their_blocks():
    chain = simulator(("a",), 1000)
    plain, residual = parts(chain), np.random.default_rng(1).normal(size=chain.size)
    pairs = [(b, 0) for b in plain.judged.blocks]
    alone = Units(chain, pairs, [], trial_of=dict.fromkeys(plain.judged.units, "a"))
    np.testing.assert_allclose(alone.fitted.whiten(residual), plain.judged.whiten(residual))
