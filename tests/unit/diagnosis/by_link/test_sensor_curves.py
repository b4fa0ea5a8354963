"""A learned error of a sensor: over which positions, of which rigs, what it adds to readings."""

from types import SimpleNamespace

import numpy as np
import pytest

import pamsim
from pamsim.diagnosis.by_link.learned_curve import Kind
from pamsim.diagnosis.by_link.sensor_curves import sensor_place
from pamsim.recordings.sensors import read_at_rest
from tests.unit.diagnosis.by_link.known_errors import KnownErrors

TIME = np.linspace(0.0, 5.0, 200)
SWUNG = 0.3 * np.sin(TIME)


def place(rig):
    measured = {rig.names.joint_channel(joint): SWUNG for joint in rig.joints}
    return sensor_place(rig, [SimpleNamespace(time=TIME, measured=measured)])


def test_its_curve_runs_over_what_was_read_and_is_what_the_sensor_adds():
    rig = pamsim.load_rig("mas20_arm")
    shaft = place(rig)
    assert [kind for kind in Kind if shaft.controls(kind)] == [Kind.READING]
    assert shaft.ends([Kind.POSITION]) == {}
    values = {name: 1e-3 * k**1.5 for k, name in enumerate(shaft.controls(Kind.READING))}
    learned = rig.with_parameters({**shaft.ends([Kind.READING]), **values})
    (curve,) = shaft.curves([Kind.READING, Kind.RATE], values, KnownErrors())
    assert curve.acts_at == "shaft"
    assert [curve.at[0], curve.at[-1]] == pytest.approx([SWUNG.min(), SWUNG.max()], rel=1e-3)
    assert curve.value == pytest.approx(read_at_rest(curve.at, learned.sensor, "angle") - curve.at)
    assert curve.reach[0] == pytest.approx(1.0)
    assert 0.6 < curve.reach[30] < 0.8  # between control values their errors average
    assert place(learned) is None  # what was learned before stays


def test_sensors_of_several_joints_share_no_curve():
    assert place(pamsim.load_rig("two_joint_arm")) is None
    rig = pamsim.load_rig("mas20_arm")
    assert sensor_place(rig, [SimpleNamespace(time=TIME, measured={})]) is None
