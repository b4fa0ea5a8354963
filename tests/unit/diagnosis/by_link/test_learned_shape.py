"""Learned curves as torques: whose tendon stands for a joint, and what a constant belongs to."""

from types import SimpleNamespace

import numpy as np
import pytest

import pamsim
from pamsim.diagnosis.by_link.learned_shape import POSITION, RATE, _curves, _places
from pamsim.physics.learned import learned_force

TIME = np.linspace(0.0, 5.0, 200)


def places(rig):
    swung = {rig.names.joint_channel(joint): 0.3 * np.sin(TIME) for joint in rig.joints}
    return _places(rig, [SimpleNamespace(time=TIME, measured=swung)])


def test_a_joint_is_stood_for_by_a_tendon_that_runs_over_it_alone():
    (shaft,) = places(pamsim.load_rig("mas20_arm"))
    assert (shaft.joint, shaft.muscle) == ("shaft", "muscle_1")
    assert shaft.length == pytest.approx(shaft.middle * shaft.at)
    assert shaft.rates == pytest.approx((-0.3, 0.3), rel=0.02)
    ends = shaft.ends()
    assert ends["muscle_1:learned.low"] == pytest.approx(-ends["muscle_1:learned.high"], rel=1e-3)
    assert ends["muscle_1:learned.high"] == pytest.approx(0.3 * abs(shaft.middle), rel=0.01)


def test_of_two_curves_the_one_over_speed_is_zero_at_rest_and_their_sum_is_the_force():
    rig = pamsim.load_rig("mas20_arm")
    (shaft,) = places(rig)
    forces = {f"muscle_1:learned.force_{k}": 3.0 * k for k in range(1, 17)}
    drags = {f"muscle_1:learned.drag_{k}": 5.0 - k for k in range(1, 9)}
    learned = rig.with_parameters({**shaft.ends(), **forces, **drags})
    over_position, over_speed = _curves(learned, shaft, [POSITION, RATE])
    at_rest = np.interp(0.0, over_speed.at, over_speed.torque)
    assert at_rest == pytest.approx(0.0, abs=1e-3 * np.abs(over_speed.torque).max())
    group = learned.muscles["muscle_1"].learned
    there = [learned_force(group, length, 0.0) for length in shaft.length]
    assert over_position.torque == pytest.approx(-shaft.arm * np.array(there))
    alone = rig.with_parameters({**shaft.ends(), **forces})
    (single,) = _curves(alone, shaft, [POSITION])
    assert np.ptp(over_position.torque - single.torque) == pytest.approx(0.0, abs=1e-12)
