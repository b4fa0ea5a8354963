"""What a split gives, what the limits take, and the motion wanted now."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pamsim.controllers.controller import PressureSplit, present_reference
from pamsim.core.errors import InputError
from tests.unit.controllers.closed_loop import observe

differences = st.floats(-2e6, 2e6)
commons = st.floats(0.0, 6e5)


@given(commons, differences)
def test_inside_the_limits_mean_and_difference_are_kept(common, difference):
    split = PressureSplit(common=common, supply=6e5)
    first, second = split.pressures(difference)
    assert 0.0 <= min(first, second) <= max(first, second) <= 6e5
    if abs(difference) / 2.0 <= min(common, 6e5 - common):
        assert not split.beyond(difference)
        assert first + second == pytest.approx(2.0 * common)
        assert split.given(difference) == pytest.approx(difference, abs=1e-9)


@given(commons, differences, differences)
def test_what_is_given_rises_with_what_is_wanted_and_never_exceeds_it(common, one, two):
    split = PressureSplit(common=common, supply=6e5)
    assert (split.given(one) - split.given(two)) * (one - two) >= 0.0
    assert abs(split.given(one)) <= abs(one) + 1e-9
    if abs(split.given(one)) < abs(one) - 1e-6:
        assert split.beyond(one)


def test_a_common_pressure_that_cannot_be_had_is_refused():
    for common in (-1.0, 6.1e5, float("nan")):
        with pytest.raises(InputError, match="common pressure"):
            PressureSplit(common=common, supply=6e5)


def test_under_constant_acceleration_the_present_reference_is_exact():
    def motion(t):
        return 0.2 + 0.7 * t - 1.5 * t * t, 0.7 - 3.0 * t, -3.0

    for period in (0.01, 0.3):
        later = observe(wanted=motion(0.4 + period)).joint
        assert present_reference(later, period) == pytest.approx(motion(0.4)[:2])
