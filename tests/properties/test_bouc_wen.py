"""Bouc-Wen hysteresis under random inputs: the faults hide in the turning points."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pamsim.physics.hysteresis.bouc_wen import bouc_wen_rate
from tests.properties.strategies import between

Shape = tuple[float, float, float]

SHAPES = st.tuples(between(1e-3, 0.5), between(0.5, 3.0), between(1.0, 6.0))
"""Yield travel D, sigma, sharpness n."""
WIDE_SHAPES = st.tuples(between(1e-3, 0.5), between(0.5, 10.0), between(1.0, 20.0))
"""The whole range that the parameters allow."""
LEVELS = between(-1.0, 1.0)
TURNS = st.lists(between(-3.0, 3.0), min_size=1, max_size=8)
"""Turning points of the input, in units of D."""


def follow(
    start: float, turns: Sequence[float], shape: Shape, speeds: Sequence[float] | None = None
) -> tuple[list[float], list[float]]:
    """Input and z along straight lines from 0 through turning points [D], by Runge-Kutta.

    The number of steps of a line depends on its length only, so that two speeds are comparable.
    """
    travel = shape[0]
    xs, zs, x, z = [0.0], [start], 0.0, start
    for index, turn in enumerate(turns):
        target = turn * travel
        steps = max(1, math.ceil(abs(target - x) / (0.03 * travel)))
        speed = 1.0 if speeds is None else speeds[index]
        dt = abs(target - x) / steps / speed
        v = math.copysign(speed, target - x)
        line = x
        for k in range(1, steps + 1):
            k1 = bouc_wen_rate(z, v, *shape)
            k2 = bouc_wen_rate(z + 0.5 * dt * k1, v, *shape)
            k3 = bouc_wen_rate(z + 0.5 * dt * k2, v, *shape)
            k4 = bouc_wen_rate(z + dt * k3, v, *shape)
            z += dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            x = target if k == steps else line + (target - line) * k / steps
            xs.append(x)
            zs.append(z)
    return xs, zs


def area(xs: Sequence[float], zs: Sequence[float]) -> float:
    """Integral of z dx by the trapezium rule."""
    return math.fsum(0.5 * (zs[i] + zs[i + 1]) * (xs[i + 1] - xs[i]) for i in range(len(xs) - 1))


@given(WIDE_SHAPES, LEVELS, st.lists(LEVELS, min_size=1, max_size=200))
def test_small_steps_keep_z_inside_one(shape, z, steps):
    """Explicit Euler as the engine takes it: no step beyond D/n and D/sigma leaves [-1, 1]."""
    travel, sigma, sharpness = shape
    largest = travel * min(1.0 / sharpness, 1.0 / sigma)
    for step in steps:
        z += bouc_wen_rate(z, step * largest, *shape)
        assert abs(z) <= 1.0 + 1e-12


@given(WIDE_SHAPES, LEVELS, between(-1e3, 1e3), between(1e-3, 1e3))
def test_rate_scales_with_speed(shape, z, velocity, factor):
    fast = bouc_wen_rate(z, factor * velocity, *shape)
    slow = bouc_wen_rate(z, velocity, *shape)
    assert fast == pytest.approx(factor * slow, rel=1e-12, abs=1e-300)


@given(SHAPES, LEVELS, TURNS, st.lists(between(1e-3, 1e3), min_size=8, max_size=8))
def test_z_depends_on_the_path_and_not_on_its_speed(shape, z, turns, speeds):
    steady = follow(z, turns, shape)[1]
    hurried = follow(z, turns, shape, speeds)[1]
    assert hurried == pytest.approx(steady, abs=1e-10)


@given(WIDE_SHAPES, LEVELS, between(-10.0, 10.0))
def test_no_state_gives_back_more_than_it_stored(shape, z, velocity):
    """Passive with the storage D z^2 / 2: z dx >= D z dz at every state, hence on every path."""
    given_in = z * velocity
    stored = shape[0] * z * bouc_wen_rate(z, velocity, *shape)
    assert given_in - stored >= -1e-12 * abs(velocity)


@given(SHAPES, LEVELS, TURNS)
def test_work_on_any_path_covers_what_is_stored(shape, start, turns):
    xs, zs = follow(start, turns, shape)
    stored = 0.5 * shape[0] * (zs[-1] ** 2 - start**2)
    length = sum(abs(b - a) for a, b in itertools.pairwise(xs))
    assert area(xs, zs) - stored >= -1e-3 * length - 1e-14


@given(SHAPES, LEVELS, between(1.0, 3.0))
def test_steady_loop_closes_and_dissipates(shape, start, amplitude):
    """Whatever the start, cycles settle on one loop; it runs so that work is lost."""
    xs, zs = follow(start, [amplitude, -amplitude] * 6 + [amplitude], shape)
    first, middle, last = [i for i in range(len(xs)) if abs(xs[i]) == amplitude * shape[0]][-3:]
    assert zs[first] == pytest.approx(zs[last], abs=1e-4)
    assert zs[middle] == pytest.approx(-zs[last], abs=1e-4)  # the loop is odd about its middle
    assert area(xs[first : last + 1], zs[first : last + 1]) > 0.01 * shape[0]


@given(WIDE_SHAPES, LEVELS, between(-1e3, 1e3))
def test_rate_is_odd(shape, z, velocity):
    assert bouc_wen_rate(-z, -velocity, *shape) == -bouc_wen_rate(z, velocity, *shape)


@given(SHAPES, LEVELS, TURNS)
def test_mirrored_input_gives_the_mirrored_path(shape, z, turns):
    there = follow(z, turns, shape)[1]
    mirrored = follow(-z, [-turn for turn in turns], shape)[1]
    assert mirrored == [-value for value in there]


@given(WIDE_SHAPES, LEVELS)
def test_nothing_moves_at_rest(shape, z):
    assert bouc_wen_rate(z, 0.0, *shape) == 0.0
