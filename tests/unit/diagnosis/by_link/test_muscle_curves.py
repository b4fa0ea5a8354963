"""Learned tensions: between which contractions, in which links, and as sums of control values."""

import numpy as np
import pytest

import pamsim
from pamsim.comparison.links import MUSCLE
from pamsim.diagnosis.by_link.learned_curve import MUSCLES, Kind
from pamsim.diagnosis.by_link.muscle_curves import muscle_place
from pamsim.engine.equilibrium import moment_arms
from pamsim.physics.learned_tension import learned_area, learned_pull
from pamsim.recordings.trial import Trial
from tests.unit.diagnosis.by_link.known_errors import KnownErrors

TIME = np.linspace(0.0, 5.0, 200)
SWING = 0.3 * np.sin(2.0 * np.pi * TIME / 5.0)


def recorded(**channels):
    return Trial(
        name="swing",
        protocol="swing",
        drive="valve",
        load=0.0,
        time=TIME,
        command=np.zeros((TIME.size, 2)),
        measured=channels,
    )


def test_the_range_is_that_of_all_muscles_against_their_free_lengths():
    rig = pamsim.load_rig("mas20_arm").with_parameters({"braid.extensibility": 2e-8})
    still = muscle_place(rig, [recorded(angle=SWING)])
    arms = moment_arms(rig, rig.model.qpos0)[:, 0]
    nominal = rig.muscles["muscle_1"].braided.nominal_length
    # Where both muscles are mounted in the same way, what shortens one muscle lengthens the other.
    assert still.high - still.low == pytest.approx(np.ptp(arms) * 0.3 / nominal, rel=0.01)
    filled = muscle_place(
        rig, [recorded(angle=SWING, pressure_1=0.0 * TIME + 3e5, pressure_2=0.0 * TIME + 3e5)]
    )
    longer = 1.0 + 2e-8 * 3e5
    assert filled.low == pytest.approx(1.0 - (1.0 - still.low) / longer)
    assert filled.high == pytest.approx(1.0 - (1.0 - still.high) / longer)
    assert muscle_place(rig, [recorded(pressure_1=0.0 * TIME)]) is None
    learned = rig.with_parameters({"learned_tension.high": 0.05})
    assert muscle_place(learned, [recorded(angle=SWING)]) is None


def test_tensions_are_curves_of_the_muscles_alone():
    place = muscle_place(pamsim.load_rig("mas20_arm"), [recorded(angle=SWING)])
    own = [kind for kind in Kind if kind.parts == (MUSCLE,)]
    assert [kind for kind in Kind if place.controls(kind)] == own
    assert place.ends([Kind.POSITION]) == {}
    assert set(place.ends([Kind.PRESSED])) == {"learned_tension.low", "learned_tension.high"}


def test_curves_are_those_of_the_rig_with_their_control_values():
    rig = pamsim.load_rig("mas20_arm")
    place = muscle_place(rig, [recorded(angle=SWING)])
    kinds = [Kind.PRESSED, Kind.UNPRESSED]
    areas = {name: 1e-5 * k**1.5 for k, name in enumerate(place.controls(kinds[0]))}
    pulls = {name: 5.0 - k for k, name in enumerate(place.controls(kinds[1]))}
    values = {**areas, **pulls}
    learned = rig.with_parameters({**place.ends(kinds), **values}).muscles["muscle_2"]
    pressed, unpressed = place.curves(kinds, values, KnownErrors())
    assert pressed.acts_at == unpressed.acts_at == MUSCLES
    own = learned.learned_tension
    assert pressed.value == pytest.approx([learned_area(own, x) for x in pressed.at.tolist()])
    assert unpressed.value == pytest.approx([learned_pull(own, x) for x in unpressed.at.tolist()])
    assert (pressed.at[0], pressed.at[-1]) == (place.low, place.high)
    assert unpressed.reach[0] == pytest.approx(1.0)
