"""Joint stiffness in parts, by turning shut muscles; a muscle's work over that of its air."""

import dataclasses

import pytest

from pamsim.papers.matiskova2021.equations import ideal_muscle, rig_muscle
from pamsim.physics.antagonist import Stiffness, antagonist_torque, joint_stiffness
from pamsim.physics.force_laws.published import PUBLISHED
from pamsim.physics.passive import PassiveSpring
from pamsim.physics.record import COMMON, pack, parameters
from pamsim.physics.tension import Threshold
from tests.unit.physics.flat import (
    charged_air_state,
    gauge_pressure,
    muscle_stiffness,
    pressure_slope,
    static_force,
    tension,
    work_ratio,
)

IDEAL = ideal_muscle()
# Published constants for DMSP-20-200 in SI, with rubber and a threshold beside them.
REAL = dataclasses.replace(
    IDEAL,
    mounting=dataclasses.replace(IDEAL.mounting, length_at_zero=0.25),
    force=PUBLISHED["DMSP-20-200"],
    braid=dataclasses.replace(IDEAL.braid, nominal_length=0.25, extensibility=2e-8),
    passive=PassiveSpring(stiffness=2e4, softening=80.0, slack_contraction=0.02, locking=18.0),
    threshold=Threshold(pressure=2e4),
)
MUSCLES = {"ideal": parameters(IDEAL), "real": parameters(REAL)}
STATES = [(0.0, 3e5), (-0.01, 5e5), (0.004, 1.5e5)]


def shut(m, length, pressure):
    """States of a muscle on a rigid chain that is shut at a gauge pressure [Pa]."""
    return [*[0.0] * (COMMON - 1), charged_air_state(m, [], length, pressure)]


def slope(function, at, h):
    """Richardson's central difference."""
    near, far = (function(at + k * h) - function(at - k * h) for k in (1.0, 2.0))
    return (8.0 * near - far) / (12.0 * h)


@pytest.mark.parametrize("name", MUSCLES)
def test_stiffness_is_the_slope_at_constant_pressure_and_what_the_shut_air_adds(name):
    m = MUSCLES[name]
    for length, pressure in STATES:
        found, air = muscle_stiffness(m, length, pressure), shut(m, length, pressure)
        turned = slope(lambda x, air=air: tension(m, air, x), length, 2e-5)
        assert found.total == pytest.approx(turned, rel=1e-7)
        assert found.compressibility > 0.0
        open_air = slope(lambda x, p=pressure: static_force(m, x, p), length, 1e-5)
        assert found.geometric == pytest.approx(open_air, rel=1e-5)
        rise = slope(lambda x, air=air: gauge_pressure(m, air, x), length, 1e-5)
        assert pressure_slope(m, length, pressure) == pytest.approx(rise, rel=1e-7)
    assert static_force(MUSCLES["real"], -0.06, 0.0) < 0.0
    slack = muscle_stiffness(MUSCLES["real"], -0.06, 0.0)
    assert slack == Stiffness(compressibility=0.0, geometric=0.0)


@pytest.mark.parametrize("name", MUSCLES)
def test_joint_stiffness_is_the_restoring_slope_of_the_torque(name):
    m, radius, angle, pressures = MUSCLES[name], 0.0124, 0.3, (4e5, 2.5e5)
    ways = -radius * angle, radius * angle
    airs = [shut(m, way, p) for way, p in zip(ways, pressures, strict=True)]

    def torque(turned):
        now = -radius * turned, radius * turned
        felt = [gauge_pressure(m, air, way) for air, way in zip(airs, now, strict=True)]
        return antagonist_torque((m, m), radius, turned, felt)

    each = [muscle_stiffness(m, way, p) for way, p in zip(ways, pressures, strict=True)]
    found = joint_stiffness(each, (radius, -radius)).total
    assert found == pytest.approx(-slope(torque, angle, 1e-3), rel=1e-5)


PRESSURE, CONTRACTION = 4.87e5, 0.0316


def ratio(muscle):
    return work_ratio(pack(muscle).tolist(), PRESSURE, CONTRACTION)


def changed(group, **values):
    muscle = rig_muscle()
    return dataclasses.replace(
        muscle, **{group: dataclasses.replace(getattr(muscle, group), **values)}
    )


def test_a_muscle_gives_the_work_of_its_air():
    """Also where its braid lengthens; and ends that lose force lose volume with it."""
    lengthened = changed("braid", extensibility=2e-8)
    short_ends = changed("end_shape", loss=0.5, onset=0.01)
    for muscle in (rig_muscle(), IDEAL, lengthened, short_ends):
        assert ratio(muscle) == pytest.approx(1.0, abs=1e-5)


def test_a_threshold_costs_its_pressure_over_the_stroke():
    """Its volume is right above the threshold; a cycle that goes below does not get it back."""
    stiff = changed("braid", extensibility=0.0)
    for threshold in (1.5e4, 5e4):
        lost = dataclasses.replace(stiff.threshold, pressure=threshold)
        found = ratio(dataclasses.replace(stiff, threshold=lost))
        assert found == pytest.approx(1.0 - threshold / PRESSURE, abs=1e-3)
