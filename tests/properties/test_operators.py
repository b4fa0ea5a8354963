"""What operators with memory must do for any input: the faults hide in the turning points."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.prandtl_ishlinskii import PrandtlIshlinskii
from pamsim.physics.hysteresis.preisach import Preisach
from tests.properties.strategies import SHARES, between
from tests.unit.physics.hysteresis.operator_runs import GROUPS, TIMESTEP, area, label, path, run

DISCRETE = [g for g in GROUPS if OPERATORS[g.law].rate_independent and g.law != "bouc_wen"]
"""Rate-independent to rounding; Bouc-Wen is so only in the limit of small steps."""
CONGRUENT = [g for g in DISCRETE if g.law != "arctangent"]
"""Arctangent branches are scaled to their turning points, so their loops differ in shape."""

INPUTS = between(-0.17, 0.17)
TURNS = st.lists(INPUTS, min_size=1, max_size=8)


@settings(max_examples=12)
@given(TURNS, st.integers(1, 9), between(1e-4, 1e-2))
def test_speed_and_sampling_do_not_matter_and_output_stays_near_the_unit_range(
    turns, points, timestep
):
    """Any number of samples on the way to a turning point, at any timestep."""
    for group in DISCRETE:
        coarse = run(group, turns)[0]
        fine = run(group, path(turns, points), timestep=timestep)[0][points - 1 :: points]
        assert fine == pytest.approx(coarse, abs=1e-6), label(group)
        assert max(map(abs, coarse)) <= 1.6, label(group)


@settings(max_examples=15)
@given(TURNS, INPUTS, INPUTS, st.lists(SHARES, max_size=5), SHARES)
def test_inner_loops_are_wiped_out(turns, low, high, inside, last):
    """What happened between two extremes is forgotten when the input returns to the second."""
    assume(abs(high - low) > 1e-3)
    inner = [low + (high - low) * share for share in inside]
    after = low + (high - low) * last
    for group in DISCRETE:
        with_loops = run(group, [*turns, low, high, *inner, high, after])[0]
        without = run(group, [*turns, low, high, after])[0]
        assert with_loops[-2:] == pytest.approx(without[-2:], abs=1e-6), label(group)


@settings(max_examples=15)
@given(TURNS, TURNS, INPUTS, INPUTS, st.lists(SHARES, min_size=1, max_size=4))
def test_loops_between_the_same_inputs_are_congruent(one, other, low, high, shares):
    """Two histories leave loops between the same extremes that differ by a constant."""
    cycle = [low, high, low, *(low + (high - low) * s for s in sorted(shares)), high]
    for group in CONGRUENT:
        first = run(group, [*one, *cycle])[0][len(one) + 1 :]
        second = run(group, [*other, *cycle])[0][len(other) + 1 :]
        apart = [a - b for a, b in zip(first, second, strict=True)]
        assert apart == pytest.approx([apart[0]] * len(apart), abs=1e-9), label(group)


def test_the_largest_cycle_costs_energy():
    """The loop is not merely empty, unless the operator has been set to have none."""
    xs = path([0.17, -0.17, 0.17], 300)
    for group in DISCRETE:
        found = area(xs[299:], run(group, xs)[0][299:])
        if isinstance(group, PrandtlIshlinskii) and group.linear_share == 1.0:
            assert found == pytest.approx(0.0, abs=1e-12)
        else:
            assert found > 0.02, label(group)


@settings(max_examples=12)
@given(TURNS)
def test_mirrored_input_gives_mirrored_output(turns):
    for group in (g for g in GROUPS if OPERATORS[g.law].odd):
        if group.law in ("preisach", "pleated_factor"):
            # On a level itself "reached" and "not reached" are no mirror images.
            at = [(x + 0.175) / 0.35 * group.state_count - 0.5 for x in turns]
            assume(all(abs(level - round(level)) > 1e-9 for level in at))
        xs = path(turns, 60) if group.law == "bouc_wen" else turns
        there, mirrored = run(group, xs)[0], run(group, [-x for x in xs])[0]
        assert mirrored == pytest.approx([-w for w in there], abs=1e-9), label(group)


@settings(max_examples=3)
@given(st.lists(INPUTS, min_size=3, max_size=3))
def test_no_way_back_gives_more_than_is_held(turns):
    """w dx is at least what the energy held gains, on every step of every path.

    So a virgin operator, whose springs hold nothing, gives nothing.
    """
    xs = [0.0, *path(turns, 120)]
    for group in GROUPS:
        operator = OPERATORS[group.law]
        memory, rates = [0.0] * group.state_count, [0.0] * group.state_count
        outputs, held = [], []
        for x, after in zip(xs, [*xs[1:], xs[-1]], strict=True):
            outputs.append(operator.output(group, memory, x))
            held.append(operator.energy(group, memory, x))
            operator.rates(group, memory, rates, x, (after - x) / TIMESTEP, TIMESTEP)
            memory = [z + TIMESTEP * rate for z, rate in zip(memory, rates, strict=True)]
        if group.law in ("maxwell_slip", "prandtl_ishlinskii", "fractional_maxwell"):
            assert min(held) == held[0] == 0.0, label(group)
        way, step = np.diff(xs), np.diff(outputs)
        lost = 0.5 * (np.array(outputs[1:]) + outputs[:-1]) * way - np.diff(held)
        # The trapezium rule is wrong by half a jump where there are jumps, by curvature elsewhere.
        jumps = 0.5 * np.abs(step * way) if isinstance(group, Preisach) else 0.0
        assert np.all(lost >= -2e-5 - jumps), label(group)
