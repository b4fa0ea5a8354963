"""Learned curves as torques: whose tendon stands for a joint, and what a constant belongs to."""

from types import SimpleNamespace

import numpy as np
import pytest

import pamsim
from pamsim.diagnosis.by_link.joint_curves import joint_places
from pamsim.diagnosis.by_link.learned_curve import Kind
from pamsim.physics.learned import learned_force
from tests.unit.diagnosis.by_link.known_errors import KnownErrors

TIME = np.linspace(0.0, 5.0, 200)


def places(rig):
    swung = {rig.names.joint_channel(joint): 0.3 * np.sin(TIME) for joint in rig.joints}
    return joint_places(rig, [SimpleNamespace(time=TIME, measured=swung)])


def test_a_joint_is_stood_for_by_a_tendon_that_runs_over_it_alone():
    (shaft,) = places(pamsim.load_rig("mas20_arm"))
    assert (shaft.joint, shaft.muscle) == ("shaft", "muscle_1")
    assert shaft.length == pytest.approx(shaft.middle * shaft.at)
    assert shaft.rates == pytest.approx((-0.3, 0.3), rel=0.02)
    ends = shaft.ends(Kind)
    # A curve that was learned before stays; the other muscle's tendon may have one.
    (other,) = places(pamsim.load_rig("mas20_arm").with_parameters(ends))
    assert other.muscle == "muscle_2"
    assert ends["muscle_1:learned.low"] == pytest.approx(-ends["muscle_1:learned.high"], rel=1e-3)
    assert ends["muscle_1:learned.high"] == pytest.approx(0.3 * abs(shaft.middle), rel=0.01)


def test_of_two_curves_the_one_over_speed_is_zero_at_rest_and_their_sum_is_the_force():
    rig = pamsim.load_rig("mas20_arm")
    (shaft,) = places(rig)
    forces = {f"muscle_1:learned.force_{k}": 3.0 * k**1.5 for k in range(1, 25)}
    drags = {f"muscle_1:learned.drag_{k}": 5.0 - k for k in range(1, 9)}
    group = rig.with_parameters({**shaft.ends(Kind), **forces, **drags}).muscles["muscle_1"].learned
    curves = shaft.curves([Kind.POSITION, Kind.RATE], {**forces, **drags}, KnownErrors())
    over_position, over_speed = curves
    at_rest = np.interp(0.0, over_speed.at, over_speed.value)
    assert at_rest == pytest.approx(0.0, abs=1e-3 * np.abs(over_speed.value).max())
    there = np.array([learned_force(group, length, 0.0) for length in shaft.length])
    assert over_position.value == pytest.approx(-shaft.arm * there)
    moving = [learned_force(group, 0.0, shaft.middle * speed) for speed in over_speed.at]
    still = learned_force(group, 0.0, 0.0)
    assert over_speed.value == pytest.approx(-shaft.middle * (np.array(moving) - still))
    (single,) = shaft.curves([Kind.POSITION], forces, KnownErrors())
    assert np.ptp(over_position.value - single.value) == pytest.approx(0.0, abs=1e-12)
    # Between control forces that of one newton is spread over four of them, at an end it is alone.
    assert single.reach[0] == pytest.approx(abs(shaft.arm[0]))
    assert 0.6 * single.reach[0] < single.reach[30] < 0.8 * single.reach[0]
