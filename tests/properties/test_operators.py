"""What operators with memory must do for any input: the faults hide in the turning points."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.prandtl_ishlinskii import PrandtlIshlinskii
from pamsim.physics.hysteresis.preisach import Preisach
from tests.properties.strategies import between
from tests.unit.physics.hysteresis.operator_runs import GROUPS, TIMESTEP, area, label, path, run

DISCRETE = [g for g in GROUPS if OPERATORS[g.law].rate_independent and g.law != "bouc_wen"]
"""Rate-independent to rounding; Bouc-Wen is so only in the limit of small steps."""
CONGRUENT = [g for g in DISCRETE if g.law != "arctangent"]
"""Arctangent branches are scaled to their turning points, so their loops differ in shape."""

PASSIVE_FROM_REST = [
    g for g in GROUPS if g.law in ("maxwell_slip", "prandtl_ishlinskii", "fractional_maxwell")
]
"""Springs and dampers relaxed at 0; the others begin with memory, that is with stored energy."""

INPUTS = between(-0.17, 0.17)
TURNS = st.lists(INPUTS, min_size=1, max_size=8)

few = settings(max_examples=20, derandomize=True, deadline=None, database=None)


@pytest.mark.parametrize("group", DISCRETE, ids=label)
@few
@given(TURNS, st.integers(1, 9), between(1e-4, 1e-2))
def test_speed_and_sampling_do_not_matter(group, turns, points, timestep):
    """Any number of samples on the way to a turning point, at any timestep."""
    coarse = run(group, turns)[0]
    fine = run(group, path(turns, points), timestep=timestep)[0][points - 1 :: points]
    assert fine == pytest.approx(coarse, abs=1e-6)


@pytest.mark.parametrize("group", DISCRETE, ids=label)
@few
@given(TURNS, INPUTS, INPUTS, st.lists(between(0.0, 1.0), max_size=5), between(0.0, 1.0))
def test_inner_loops_are_wiped_out(group, turns, low, high, inside, last):
    """What happened between two extremes is forgotten when the input returns to the second."""
    assume(abs(high - low) > 1e-3)
    inner = [low + (high - low) * share for share in inside]
    after = low + (high - low) * last
    with_loops = run(group, [*turns, low, high, *inner, high, after])[0]
    without = run(group, [*turns, low, high, after])[0]
    assert with_loops[-2:] == pytest.approx(without[-2:], abs=1e-6)


@pytest.mark.parametrize("group", DISCRETE, ids=label)
@few
@given(TURNS, INPUTS, between(-0.1, 0.1))
def test_the_input_returns_to_its_turning_point(group, turns, turn, excursion):
    """Leaving a turning point back into the last branch and returning closes the loop there."""
    before = turns[-1]
    assume(abs(turn - before) > 1e-3)
    inside = turn + (before - turn) * min(1.0, abs(excursion) * 10.0)
    ws = run(group, [*turns, turn, inside, turn])[0]
    assert ws[-1] == pytest.approx(ws[-3], abs=1e-6)


@pytest.mark.parametrize("group", CONGRUENT, ids=label)
@few
@given(TURNS, TURNS, INPUTS, INPUTS, st.lists(between(0.0, 1.0), min_size=1, max_size=4))
def test_loops_between_the_same_inputs_are_congruent(group, one, other, low, high, shares):
    """Two histories leave loops between the same extremes that differ by a constant."""
    cycle = [low, high, low, *(low + (high - low) * s for s in sorted(shares)), high]
    first = run(group, [*one, *cycle])[0][len(one) + 1 :]
    second = run(group, [*other, *cycle])[0][len(other) + 1 :]
    offset = first[0] - second[0]
    assert [a - b for a, b in zip(first, second, strict=True)] == pytest.approx(
        [offset] * len(first), abs=1e-9
    )


@pytest.mark.parametrize("group", DISCRETE, ids=label)
@few
@given(st.lists(INPUTS, min_size=2, max_size=4))
def test_a_cycle_never_gives_energy(group, turns):
    """After a first round a periodic input runs along a loop of non-negative area."""
    points = 60
    xs = path([*turns, turns[0]] * 2, points)
    ws = run(group, xs)[0]
    size = points * len(turns)
    loop_x, loop_w = xs[-size - 1 :], ws[-size - 1 :]
    assert loop_x[0] == loop_x[-1]
    length = sum(abs(b - a) for a, b in itertools.pairwise(loop_x))
    # The trapezium rule may miss up to one sample at every step of a staircase.
    assert area(loop_x, loop_w) >= -1e-9 - 0.03 * length


@pytest.mark.parametrize("group", DISCRETE, ids=label)
def test_the_largest_cycle_costs_energy(group):
    """The loop is not merely empty, unless the operator has been set to have none."""
    xs = path([0.17, -0.17, 0.17], 300)
    ws = run(group, xs)[0]
    found = area(xs[299:], ws[299:])
    if isinstance(group, PrandtlIshlinskii) and group.linear_share == 1.0:
        assert found == pytest.approx(0.0, abs=1e-12)
    else:
        assert found > 0.02


@pytest.mark.parametrize("group", PASSIVE_FROM_REST, ids=label)
@few
@given(TURNS)
def test_nothing_can_be_taken_out_of_a_virgin_operator(group, turns):
    xs = path(turns, 30)
    ws = run(group, xs)[0]
    length = sum(abs(b - a) for a, b in itertools.pairwise([0.0, *xs]))
    assert area([0.0, *xs], [0.0, *ws]) >= -1e-3 * length


@pytest.mark.parametrize("group", [g for g in GROUPS if OPERATORS[g.law].odd], ids=label)
@few
@given(TURNS)
def test_mirrored_input_gives_mirrored_output(group, turns):
    if group.law in ("preisach", "pleated_factor"):
        # On a level itself "reached" and "not reached" are no mirror images.
        levels, width = group.state_count, 0.35
        assume(
            all(
                abs((x + 0.175) / width * levels - k - 0.5) > 1e-9
                for x in turns
                for k in range(levels)
            )
        )
    xs = path(turns, 60) if group.law == "bouc_wen" else turns
    there = run(group, xs)[0]
    mirrored = run(group, [-x for x in xs])[0]
    assert mirrored == pytest.approx([-w for w in there], abs=1e-9)


@pytest.mark.parametrize("group", DISCRETE, ids=label)
@few
@given(TURNS)
def test_output_stays_near_the_unit_range(group, turns):
    assert max(abs(w) for w in run(group, turns)[0]) <= 1.6


@pytest.mark.parametrize("group", GROUPS, ids=label)
@settings(max_examples=3, derandomize=True, deadline=None, database=None)
@given(st.lists(INPUTS, min_size=3, max_size=3))
def test_no_way_back_gives_more_than_is_held(group, turns):
    """w dx is at least what the energy held gains, on every step of every path."""
    operator = OPERATORS[group.law]
    xs = [0.0, *path(turns, 120)]
    memory, rates = [0.0] * group.state_count, [0.0] * group.state_count
    outputs: list[float] = []
    held: list[float] = []
    for x, after in zip(xs, [*xs[1:], xs[-1]], strict=True):
        outputs.append(operator.output(group, memory, x))
        held.append(operator.energy(group, memory, x))
        operator.rates(group, memory, rates, x, (after - x) / TIMESTEP, TIMESTEP)
        memory = [z + TIMESTEP * rate for z, rate in zip(memory, rates, strict=True)]
    way, step = np.diff(xs), np.diff(outputs)
    lost = 0.5 * (np.array(outputs[1:]) + outputs[:-1]) * way - np.diff(held)
    # The trapezium rule is wrong by half a jump where there are jumps, by the curvature elsewhere.
    jumps = 0.5 * np.abs(step * way) if isinstance(group, Preisach) else 0.0
    assert np.all(lost >= -2e-5 - jumps)
