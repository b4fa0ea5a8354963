"""Plays, Maxwell slip, and Prandtl-Ishlinskii operators with their exact inverses."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pamsim.core.errors import InputError
from pamsim.physics.hysteresis.maxwell_slip import MaxwellSlip, play
from pamsim.physics.hysteresis.prandtl_ishlinskii import (
    PlaySum,
    PrandtlIshlinskii,
    scale_and_weight,
)
from tests.unit.physics.hysteresis.operator_runs import path, run

POSITIVE = st.floats(0.05, 2.0, allow_subnormal=False)


@st.composite
def play_sums(draw) -> PlaySum:
    count = draw(st.integers(1, 8))
    gaps = draw(st.lists(POSITIVE, min_size=count, max_size=count))
    # Slopes rather than weights are drawn: positive slopes are what makes an inverse exist.
    slopes = draw(st.lists(POSITIVE, min_size=count + 1, max_size=count + 1))
    return PlaySum(
        linear=slopes[0],
        thresholds=tuple(itertools.accumulate(gaps)),
        weights=tuple(b - a for a, b in itertools.pairwise(slopes)),
    )


def test_play_by_hand():
    held, outputs = 0.0, []
    for x in (0.5, 1.5, 3.0, 2.0, 1.0, 0.5, 4.0):
        held = play(x, held, 1.0)
        outputs.append(held)
    assert outputs == [0.0, 0.5, 2.0, 2.0, 2.0, 1.5, 3.0]


@given(play_sums(), st.lists(st.floats(-3.0, 3.0, allow_subnormal=False), max_size=25))
def test_operator_and_inverse_undo_each_other_in_either_order(operator, inputs):
    inverse = operator.inverse()
    for first, second in ((operator, inverse), (inverse, operator)):
        memory, undo = first.virgin(), second.virgin()
        for x in inputs:
            memory, y = first.step(memory, x)
            undo, back = second.step(undo, y)
            assert back == pytest.approx(x, abs=1e-12 * max(10.0, inverse.linear))


def test_what_has_no_inverse_is_refused():
    for linear, thresholds, weights in (
        (0.0, (1.0,), (1.0,)),
        (1.0, (1.0,), (-1.0,)),
        (1.0, (1.0, 1.0), (0.1, 0.1)),
        (1.0, (0.0, 1.0), (0.1, 0.1)),
        (1.0, (1.0,), (0.1, 0.1)),
    ):
        with pytest.raises(InputError):
            PlaySum(linear=linear, thresholds=thresholds, weights=weights)


@pytest.mark.parametrize("decay", [0.5, 1.0, 3.0])
def test_engine_operator_is_the_inverse_of_its_compliance(decay):
    """Handed back to the compliance, the output gives the contraction that it came from."""
    group = PrandtlIshlinskii(elements=5, span=0.2, decay=decay, linear_share=0.4)
    first = scale_and_weight(group)[1]
    compliance = PlaySum(
        linear=group.linear_share,
        thresholds=tuple((k + 0.5) / 5 for k in range(5)),
        weights=tuple(first * decay**k for k in range(5)),
    )
    xs = path([0.2, -0.1, 0.15, 0.05, 0.3, -0.3], 7)
    memory, back = compliance.virgin(), []
    for w in run(group, xs)[0]:
        memory, y = compliance.step(memory, w)
        back.append(y)
    at_one = compliance.step(compliance.virgin(), 1.0)[1]
    assert back == pytest.approx([x * at_one / 0.2 for x in xs], abs=1e-12)
    assert run(group, [0.2])[0] == pytest.approx([1.0], abs=1e-12)


def test_maxwell_slip_initial_curve_and_saturation():
    """Before an element slips it is a spring; once all slip the output is 1."""
    group = MaxwellSlip(elements=4, full_slip=0.08, decay=0.5)
    shares = [1.0, 0.5, 0.25, 0.125]
    for x in (0.01, 0.03, 0.05, 0.08, 0.2):
        parts = (s * min(1.0, x / (0.02 * (k + 1))) for k, s in enumerate(shares))
        assert run(group, [x])[0] == pytest.approx([sum(parts) / sum(shares)])
    assert run(group, [0.2, -0.2])[0] == pytest.approx([1.0, -1.0])


@given(st.floats(0.01, 0.2), st.floats(0.0, 1.0))
def test_maxwell_slip_obeys_masing(amplitude, share):
    """A branch after a reversal is the initial curve, twice as large in both directions."""
    group = MaxwellSlip(elements=5, full_slip=0.1, decay=0.8)
    travel = 2.0 * amplitude * share
    top, branch = run(group, [amplitude, amplitude - travel])[0]
    (initial,) = run(group, [0.5 * travel])[0] if travel > 0.0 else [0.0]
    assert top - branch == pytest.approx(2.0 * initial, abs=1e-12)
