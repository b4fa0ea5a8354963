"""What a rig's own numbers may explain, and what they may not."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.likely_mistakes import least_missed
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import load_rig

RIG = load_rig("mas20_arm")


def missing(**true):
    """Misses numbers of a rig by their logarithms; ``__`` stands for a point."""

    def missed(rig):
        found = [rig_parameter(rig, name.replace("__", ".")).value for name in true]
        return np.log(np.array(found) / np.array(list(true.values())))

    return missed


def test_a_scale_within_twice_and_valves_within_five_times_are_explained():
    width = rig_parameter(RIG, "valve.conductance_fill").value
    assert least_missed(RIG, missing(force__scale=1.7)) < 1e-3
    assert least_missed(RIG, missing(force__scale=0.6, valve__conductance_fill=4 * width)) < 1e-3


def test_what_lies_further_is_left():
    assert least_missed(RIG, missing(force__scale=6.0)) == pytest.approx(np.log(3.0) ** 2, rel=1e-3)
    assert least_missed(RIG, missing(body__rig__tilt=-0.1)) > 1.0  # is none of them


def test_the_mounting_of_each_muscle_may_be_off_by_itself():
    def missed(rig):
        off = [one.mounting.length_at_zero - 0.25 for one in rig.muscles.values()]
        return 1e3 * (np.array(off) - np.array([0.008, -0.01]))

    assert least_missed(RIG, missed) < 1e-3


def test_a_rig_that_breaks_down_explains_nothing():
    assert least_missed(RIG, lambda _: None) == np.inf

    def only_as_described(rig):
        return np.ones(1) if rig is RIG else None

    assert least_missed(RIG, only_as_described) == pytest.approx(1.0)
