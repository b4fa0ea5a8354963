"""Learned curves: where, over which range, and as sums of control values that are the rig's."""

import dataclasses

import numpy as np
import pytest

import pamsim
from pamsim.comparison.links import MUSCLE, VALVES
from pamsim.diagnosis.by_link.curve_places import (
    ALL_VALVES,
    MUSCLES,
    JointPlace,
    Kind,
)
from pamsim.diagnosis.by_link.visited_places import (
    joint_places,
    muscle_place,
    places_of,
    sensor_place,
    valve_place,
)
from pamsim.engine.equilibrium import moment_arms
from pamsim.physics.chain import chain_ratio
from pamsim.physics.learned import learned_force
from pamsim.physics.learned_tension import learned_area, learned_pull
from pamsim.physics.valves import flow_share
from pamsim.recordings.sensors import read_at_rest
from pamsim.recordings.trial import Trial

TIME = np.linspace(0.0, 5.0, 200)
SWUNG = 0.3 * np.sin(TIME)
SWING = 0.3 * np.sin(2.0 * np.pi * TIME / 5.0)
OPENED = np.column_stack([-0.7 * np.sin(TIME), np.full(TIME.size, 0.2)])


class KnownErrors:
    """Errors of which every control value has 1, independent of the others."""

    def reach(self, weights):
        """Half width of a sum of control values, (n,)."""
        return np.sqrt(np.sum([column**2 for column in weights.values()], axis=0))


def recorded(drive="valve", command=OPENED, **channels):
    return Trial(
        name=drive,
        protocol=drive,
        drive=drive,
        load=0.0,
        time=TIME,
        command=command,
        measured=channels,
    )


def swung(rig):
    """A trial in which all joints swing."""
    return [recorded(**{rig.names.joint_channel(joint): SWUNG for joint in rig.joints})]


def shafts(rig):
    """Places of the joints themselves."""
    return [one for one in joint_places(rig, swung(rig)) if isinstance(one, JointPlace)]


def tendons(rig):
    """Places of the tendons over the joints."""
    return [one for one in joint_places(rig, swung(rig)) if not isinstance(one, JointPlace)]


def own_kinds(place):
    return [kind for kind in Kind if place.controls(kind)]


@pytest.fixture(scope="module")
def arm():
    return pamsim.load_rig("mas20_arm")


def test_a_joint_is_stood_for_by_a_tendon_that_runs_over_it_alone(arm):
    (shaft,) = shafts(arm)
    assert (shaft.joint, shaft.muscle) == ("shaft", "muscle_1")
    assert shaft.length == pytest.approx(shaft.middle * shaft.at)
    assert shaft.rates == pytest.approx((-0.3, 0.3), rel=0.02)
    ends = shaft.ends(Kind)
    # A curve that was learned before stays; the other muscle's tendon may have one.
    (other,) = shafts(arm.with_parameters(ends))
    assert other.muscle == "muscle_2"
    assert ends["muscle_1:learned.low"] == pytest.approx(-ends["muscle_1:learned.high"], rel=1e-3)
    assert ends["muscle_1:learned.high"] == pytest.approx(0.3 * abs(shaft.middle), rel=0.01)


def test_of_two_curves_the_one_over_speed_is_zero_at_rest_and_their_sum_is_the_force(arm):
    (shaft,) = shafts(arm)
    forces = {f"muscle_1:learned.force_{k}": 3.0 * k**1.5 for k in range(1, 25)}
    drags = {f"muscle_1:learned.drag_{k}": 5.0 - k for k in range(1, 9)}
    group = arm.with_parameters({**shaft.ends(Kind), **forces, **drags}).muscles["muscle_1"].learned
    curves = shaft.curves([Kind.POSITION, Kind.RATE], {**forces, **drags}, KnownErrors())
    over_position, over_speed = curves
    at_rest = np.interp(0.0, over_speed.at, over_speed.value)
    assert at_rest == pytest.approx(0.0, abs=1e-3 * np.abs(over_speed.value).max())
    there = np.array([learned_force(group, length, 0.0) for length in shaft.length])
    assert over_position.value == pytest.approx(-shaft.arm * there)
    moving = [learned_force(group, 0.0, shaft.middle * speed) for speed in over_speed.at]
    still = learned_force(group, 0.0, 0.0)
    assert over_speed.value == pytest.approx(-shaft.middle * (np.array(moving) - still))
    # With the drag at rest in the other curve the force is the same, and the drag alone is 0 there.
    again = {**forces, **drags} | shaft.without_drag_at_rest({**forces, **drags})
    other = arm.with_parameters({**shaft.ends(Kind), **again}).muscles["muscle_1"].learned
    for length, speed in ((0.0, 0.0), (0.002, 0.003), (-0.003, -0.002)):
        same = learned_force(group, length, speed)
        assert learned_force(other, length, speed) == pytest.approx(same)
    alone = dataclasses.replace(other, high=other.low)
    assert learned_force(alone, 0.0, 0.0) == pytest.approx(0.0, abs=1e-9)
    (single,) = shaft.curves([Kind.POSITION], forces, KnownErrors())
    assert np.ptp(over_position.value - single.value) == pytest.approx(0.0, abs=1e-12)
    # Between control forces that of one newton is spread over four of them, at an end it is alone.
    assert single.reach[0] == pytest.approx(abs(shaft.arm[0]))
    assert 0.6 * single.reach[0] < single.reach[30] < 0.8 * single.reach[0]


def test_a_learned_friction_is_a_torque_against_the_motion_of_the_joint(arm):
    (shaft,) = shafts(arm)
    rubs = {f"muscle_1:learned.rub_{k}": 3.0 * k**1.5 for k in range(1, 9)}
    ends = shaft.ends([Kind.FRICTION])
    group = arm.with_parameters({**ends, **rubs}).muscles["muscle_1"].learned
    assert group.rub_speed == pytest.approx(0.05 * 0.3 * abs(shaft.middle), rel=0.02)
    (curve,) = shaft.curves([Kind.FRICTION], rubs, KnownErrors())
    full = np.array([learned_force(group, length, 9.0) for length in shaft.length])
    assert curve.value == pytest.approx(np.abs(shaft.arm) * full)
    assert curve.value.min() > 0.0
    assert curve.acts_at == curve.joint == "shaft"


def test_a_change_of_the_arm_is_a_share_of_it_for_each_tendon_over_the_position_of_its_joint(arm):
    both = tendons(arm)
    assert [one.acts_at for one in both] == ["muscle_1", "muscle_2"]
    for one in both:
        assert own_kinds(one) == [Kind.ARM]
        assert one.ends([Kind.POSITION]) == {}
        values = {name: 0.01 * k for k, name in enumerate(one.controls(Kind.ARM))}
        there = arm.with_parameters({**one.ends([Kind.ARM]), **values})
        (curve,) = one.curves([Kind.ARM, Kind.RATE], values, KnownErrors())
        chain = there.muscles[one.acts_at].chain
        ratios = [chain_ratio(chain, x) for x in one.along.tolist()]
        assert curve.value == pytest.approx(np.array(ratios) - 1.0)
        assert (curve.joint, curve.at[0]) == ("shaft", pytest.approx(SWUNG.min(), rel=1e-3))
        assert np.ptp(curve.value) == pytest.approx(0.07)
        assert one.acts_at not in [left.acts_at for left in tendons(there)]


@pytest.mark.parametrize("name", ["mas20_arm", "two_joint_arm", "muscle_bench", "equimus_leg"])
def test_every_end_and_control_value_is_a_parameter_of_the_rig(name):
    """Pushing actuators have no chain, and so no arm that can be learned."""
    rig = pamsim.load_rig(name)
    reach = {"angle": 1.0, "position": 0.05}  # a slide of 0.3 m is longer than the muscle
    moved = {rig.names.joint_channel(j): reach[kind] * SWUNG for j, kind in rig.joints.items()}
    for place in places_of(rig, [recorded(**moved)]):
        with_ends = rig.with_parameters(place.ends(Kind))
        controls = [control for kind in Kind for control in place.controls(kind)]
        assert controls
        with_ends.with_parameters(dict.fromkeys(controls, 1e-4))


def test_the_range_is_that_of_all_muscles_against_their_free_lengths(arm):
    rig = arm.with_parameters({"braid.extensibility": 2e-8})
    still = muscle_place(rig, [recorded(angle=SWING)])
    arms = moment_arms(rig, rig.model.qpos0)[:, 0]
    nominal = rig.muscles["muscle_1"].braided.nominal_length
    # Where both muscles are mounted in the same way, what shortens one muscle lengthens the other.
    assert np.ptp(still.at) == pytest.approx(np.ptp(arms) * 0.3 / nominal, rel=0.01)
    filled = muscle_place(
        rig, [recorded(angle=SWING, pressure_1=0.0 * TIME + 3e5, pressure_2=0.0 * TIME + 3e5)]
    )
    longer = 1.0 + 2e-8 * 3e5
    assert filled.at[0] == pytest.approx(1.0 - (1.0 - still.at[0]) / longer)
    assert filled.at[-1] == pytest.approx(1.0 - (1.0 - still.at[-1]) / longer)
    assert muscle_place(rig, [recorded(pressure_1=0.0 * TIME)]) is None
    learned = rig.with_parameters({"learned_tension.high": 0.05})
    assert muscle_place(learned, [recorded(angle=SWING)]) is None


def test_tensions_are_curves_of_the_muscles_alone_with_their_control_values(arm):
    place = muscle_place(arm, [recorded(angle=SWING)])
    assert own_kinds(place) == [kind for kind in Kind if kind.parts == (MUSCLE,)]
    assert place.ends([Kind.POSITION]) == {}
    assert set(place.ends([Kind.PRESSED])) == {"learned_tension.low", "learned_tension.high"}
    kinds = [Kind.PRESSED, Kind.UNPRESSED]
    areas = {name: 1e-5 * k**1.5 for k, name in enumerate(place.controls(kinds[0]))}
    pulls = {name: 5.0 - k for k, name in enumerate(place.controls(kinds[1]))}
    values = {**areas, **pulls}
    learned = arm.with_parameters({**place.ends(kinds), **values}).muscles["muscle_2"]
    pressed, unpressed = place.curves(kinds, values, KnownErrors())
    assert pressed.acts_at == unpressed.acts_at == MUSCLES
    own = learned.learned_tension
    assert pressed.value == pytest.approx([learned_area(own, x) for x in pressed.at.tolist()])
    assert unpressed.value == pytest.approx([learned_pull(own, x) for x in unpressed.at.tolist()])
    assert pressed.at == pytest.approx(place.at)
    assert unpressed.reach[0] == pytest.approx(1.0)


def test_an_error_of_a_sensor_runs_over_what_was_read_and_is_what_the_sensor_adds(arm):
    shaft = sensor_place(arm, swung(arm))
    assert own_kinds(shaft) == [Kind.READING]
    assert shaft.ends([Kind.POSITION]) == {}
    values = {name: 1e-3 * k**1.5 for k, name in enumerate(shaft.controls(Kind.READING))}
    learned = arm.with_parameters({**shaft.ends([Kind.READING]), **values})
    (curve,) = shaft.curves([Kind.READING, Kind.RATE], values, KnownErrors())
    assert curve.acts_at == "shaft"
    assert [curve.at[0], curve.at[-1]] == pytest.approx([SWUNG.min(), SWUNG.max()], rel=1e-3)
    assert curve.value == pytest.approx(read_at_rest(curve.at, learned.sensor, "angle") - curve.at)
    assert curve.reach[0] == pytest.approx(1.0)
    assert 0.6 < curve.reach[30] < 0.8  # between control values their errors average
    # What was learned before stays; sensors of several joints share no curve.
    joints = pamsim.load_rig("two_joint_arm")
    for rig, trials in ((learned, swung(arm)), (joints, swung(joints)), (arm, [recorded()])):
        assert sensor_place(rig, trials) is None


def test_a_change_of_the_flow_runs_over_the_openings_commanded_or_all_of_a_regulator(arm):
    opened = valve_place(arm, [recorded("valve")])
    assert (opened.at[0], opened.at[-1]) == pytest.approx((-0.7, 0.7), abs=1e-3)
    beyond = valve_place(arm, [recorded("valve", 9.0 * OPENED)])
    assert (beyond.at[0], beyond.at[-1]) == (-1.0, 1.0)
    regulated = valve_place(arm, [recorded("valve"), recorded("pressure_set", 1e5 + OPENED)])
    assert (regulated.at[0], regulated.at[-1]) == (-1.0, 1.0)
    for shut in ("pulse", "measured"):
        assert valve_place(arm, [recorded(shut)]) is None
    assert valve_place(arm, [recorded("valve"), recorded("pulse")]) is None


def test_it_is_a_share_of_the_flow_of_all_valves(arm):
    valves = valve_place(arm, [recorded("valve")])
    assert own_kinds(valves) == [Kind.FLOW]
    assert Kind.FLOW.parts == (VALVES,)
    values = {name: 0.1 * k for k, name in enumerate(valves.controls(Kind.FLOW))}
    learned = arm.with_parameters({**valves.ends([Kind.FLOW]), **values})
    (curve,) = valves.curves([Kind.FLOW], values, KnownErrors())
    assert curve.acts_at == ALL_VALVES
    shares = [flow_share(learned.muscles["muscle_2"].valve, one) for one in curve.at.tolist()]
    assert curve.at * (1.0 + curve.value) == pytest.approx(shares)
    assert valve_place(learned, [recorded("valve")]) is None  # what was learned before stays
