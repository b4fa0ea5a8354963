"""Arctangent branches of Alraouf 2025 and the rule for partial loops."""

import pytest
from scipy.integrate import quad

from pamsim.physics.hysteresis.arctangent import Arctangent, branch, half_width, kept_and_added
from pamsim.recordings.printed import arctangent_law, loop_equation
from tests.unit.physics.hysteresis.operator_runs import path, run

INCREASING, DECREASING = (
    tuple(each.value for each in loop_equation(side)) for side in ("up", "down")
)
SIDES = (INCREASING, DECREASING)
WHOLE = Arctangent(high_contraction=1.0)


def test_printed_branches_are_near_the_printed_table_and_are_the_default_shapes():
    """Alraouf 2025, table 2 at 0, 250 and 500 kPa, within little more than its sensor's 3 mm."""
    measured = ((30.053, 25.64, 24.2), (30.05, 25.7, 24.197))
    shapes = (
        (WHOLE.steepness_rising, WHOLE.middle_rising),
        (WHOLE.steepness_falling, WHOLE.middle_falling),
    )
    for printed, row, (steepness, middle) in zip(SIDES, measured, shapes, strict=True):
        for p, y in zip((0.0, 250.0, 500.0), row, strict=True):
            assert arctangent_law(p, *printed) == pytest.approx(y, abs=0.6)
        assert steepness == pytest.approx(-printed[1] * 500.0, rel=1e-4)
        assert middle == pytest.approx(-printed[2] / printed[1] / 500.0, rel=1e-3)
        ends = arctangent_law(0.0, *printed), arctangent_law(500.0, *printed)
        for t in (0.2, 0.5, 0.9):
            share = (arctangent_law(500.0 * t, *printed) - ends[0]) / (ends[1] - ends[0])
            assert branch(t, steepness, middle)[0] == pytest.approx(share, abs=2e-4)
    # They miss each other at both ends, which the operator mends.
    for p, gap in ((0.0, 0.0068), (500.0, 0.0588)):
        found = arctangent_law(p, *INCREASING) - arctangent_law(p, *DECREASING)
        assert found == pytest.approx(gap, abs=1e-4)


def test_major_loop_runs_along_both_branches_whose_integrals_are_stated():
    group = Arctangent(high_contraction=0.2)
    xs = path([0.2, 0.0], 20)
    ws = run(group, xs)[0]
    s, m = group.steepness_rising, group.middle_rising
    f, n = group.steepness_falling, group.middle_falling
    widest = 2.0 * half_width(group, 0.5 * (m + n))[0]
    for k, (x, w) in enumerate(zip(xs, ws, strict=True)):
        width = branch(x / 0.2, f, n)[0] - branch(x / 0.2, s, m)[0]
        assert w == pytest.approx((1.0 if k < 20 else -1.0) * width / widest, abs=1e-12)
    for t in (0.3, 1.0):
        found = quad(lambda at: half_width(group, at)[0], 0.0, t)[0]
        assert half_width(group, t)[1] == pytest.approx(found, rel=1e-10)


def test_an_inner_loop_is_a_small_image_of_the_major_one():
    """Its width at a share of its length is the major loop's there, times its length."""
    shares = [0.1, 0.3, 0.6, 0.8]
    major = run(WHOLE, [*shares, 1.0, *reversed(shares)])[0]
    for low, high in ((0.3, 0.9), (0.1, 0.4), (0.0, 1.0)):
        inner = [low + (high - low) * share for share in shares]
        ws = run(WHOLE, [high, *reversed(inner), low, *inner])[0]
        for k in range(4):
            width, whole = ws[6 + k] - ws[4 - k], major[k] - major[8 - k]
            assert width == pytest.approx((high - low) * whole, abs=1e-12)


def test_memory_holds_a_bounded_number_of_turning_points():
    """Shrinking reversals fill it; further ones run back along their branch and add nothing."""
    group = Arctangent(turning_points=3, high_contraction=1.0)
    turns = [0.9, 0.1, 0.8, 0.2, 0.7, 0.3]
    assert run(group, turns)[1] == pytest.approx([0.3, 0.9, 0.1, 0.8])
    there = run(group, [*turns[:4], 0.4, 0.5])[0]
    back = run(group, [*turns[:4], 0.5, 0.4, 0.5])[0]
    assert (back[-2], back[-1]) == pytest.approx((there[-2], there[-1]))
    # Outgrowing the innermost turning point frees its room.
    assert run(group, [*turns, 0.85])[1] == pytest.approx([0.85, 0.9, 0.1, 0.0])
    assert run(group, [*turns, 0.05])[1] == pytest.approx([0.05, 0.9, 0.0, 0.0])


def test_a_slow_reversal_is_seen_and_rounding_errors_of_the_memory_are_no_turning_points():
    creep = [0.5 - 2e-10 * k for k in range(1, 40)]
    _, act = run(Arctangent(turning_points=4, high_contraction=1.0), [0.5, *creep])
    assert act[1] == pytest.approx(0.5, abs=2e-9)
    assert kept_and_added(2, [0.5, 0.8, 1e-16], 0.5) == (1, 0)
    for error in (-1e-12, 0.0, 1e-12):
        assert kept_and_added(3, [0.5, 0.8, 0.3, 0.0], 0.8 + error) == (0, 0)
        assert kept_and_added(3, [0.5, 0.8, 0.3, 0.7], 0.3 + error) == (1, 0)
        assert kept_and_added(3, [0.5, 0.8, 0.3, 0.0], 0.5 + error) == (2, 0)
