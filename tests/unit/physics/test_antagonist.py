"""Joint stiffness in parts, against turning the kernel's own muscles with their chambers shut."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pamsim.physics.antagonist import Stiffness, antagonist_torque, joint_stiffness
from pamsim.physics.braid import Braid
from pamsim.physics.chamber import Chamber
from pamsim.physics.force_laws.exponential import SixParameter
from pamsim.physics.force_laws.mckibben import IdealMcKibben
from pamsim.physics.muscle import Mounting, Muscle
from pamsim.physics.passive import PassiveSpring
from pamsim.physics.record import COMMON, parameters
from pamsim.physics.tension import Threshold
from pamsim.physics.valves import ValvePair
from tests.unit.physics.flat import (
    charged_air_state,
    gauge_pressure,
    muscle_stiffness,
    pressure_slope,
    static_force,
    tension,
)

IDEAL = Muscle(
    mounting=Mounting(length_at_zero=0.22),
    braid=Braid(nominal_length=0.25, diameter=0.02, fibre_angle=math.radians(28.6)),
    force=IdealMcKibben(),
    chamber=Chamber(polytropic_index=1.2, temperature=293.15, dead_volume=1e-5),
    valve=ValvePair(
        conductance_fill=1e-9,
        conductance_exhaust=1e-9,
        critical_ratio=0.3,
        supply_pressure=6e5,
    ),
)
# Published constants for DMSP-20-200 in SI, with rubber and a threshold beside them.
REAL = dataclasses.replace(
    IDEAL,
    mounting=Mounting(length_at_zero=0.25),
    force=SixParameter(
        a=-4.00180705e-5,
        b=292.4620246,
        c=-32.930845,
        d=-933.564098e-5,
        e=294.0538256e-5,
        f=-280.498151,
    ),
    braid=dataclasses.replace(IDEAL.braid, extensibility=2e-8),
    passive=PassiveSpring(stiffness=2e4, softening=80.0, slack_contraction=0.02, locking=18.0),
    threshold=Threshold(pressure=2e4),
)
MUSCLES = {"ideal": IDEAL, "real": REAL}
STATES = [(0.0, 3e5), (-0.01, 5e5), (0.004, 1.5e5)]


def row(muscle: Muscle) -> list[float]:
    return parameters(muscle)


def shut(par: list[float], length: float, pressure: float) -> list[float]:
    """States of a muscle on a rigid chain that is shut at a gauge pressure [Pa]."""
    return [*[0.0] * (COMMON - 1), charged_air_state(par, [], length, pressure)]


def shut_slope(par: list[float], length: float, pressure: float) -> float:
    """Slope of the tension over length with the air shut in, by Richardson's differences."""
    air = shut(par, length, pressure)

    def central(h: float) -> float:
        return (tension(par, air, length + h) - tension(par, air, length - h)) / (2.0 * h)

    return (4.0 * central(2e-5) - central(4e-5)) / 3.0


@pytest.mark.parametrize("name", MUSCLES)
@pytest.mark.parametrize(("length", "pressure"), STATES)
def test_both_parts_add_up_to_the_stiffness_of_a_shut_muscle(name, length, pressure):
    par = row(MUSCLES[name])
    found = muscle_stiffness(par, length, pressure)
    assert found.total == pytest.approx(shut_slope(par, length, pressure), rel=1e-7)
    assert found.compressibility > 0.0


@pytest.mark.parametrize(("length", "pressure"), STATES)
def test_geometric_part_is_the_slope_at_constant_pressure(length, pressure):
    par, h = row(REAL), 1e-5
    slope = static_force(par, length + h, pressure) - static_force(par, length - h, pressure)
    found = muscle_stiffness(par, length, pressure)
    assert found.geometric == pytest.approx(slope / (2.0 * h), rel=1e-5)


@pytest.mark.parametrize(("length", "pressure"), STATES)
def test_pressure_slope_is_that_of_the_air_state(length, pressure):
    par, h = row(IDEAL), 1e-6
    air = shut(par, length, pressure)
    slope = gauge_pressure(par, air, length + h) - gauge_pressure(par, air, length - h)
    assert pressure_slope(par, length, pressure) == pytest.approx(slope / (2.0 * h), rel=1e-7)


def test_a_slack_muscle_has_no_stiffness():
    assert static_force(row(REAL), -0.06, 0.0) < 0.0
    assert muscle_stiffness(row(REAL), -0.06, 0.0) == Stiffness(compressibility=0.0, geometric=0.0)


@pytest.mark.parametrize("name", MUSCLES)
def test_joint_stiffness_is_the_restoring_slope_of_the_torque(name):
    par, radius, angle, h = row(MUSCLES[name]), 0.0124, 0.3, 1e-3
    pressures = 4e5, 2.5e5
    ways = -radius * angle, radius * angle
    airs = [shut(par, way, p) for way, p in zip(ways, pressures, strict=True)]

    def torque(turned: float) -> float:
        now = -radius * turned, radius * turned
        felt = [gauge_pressure(par, air, way) for air, way in zip(airs, now, strict=True)]
        return antagonist_torque((par, par), radius, turned, felt)

    each = [muscle_stiffness(par, way, p) for way, p in zip(ways, pressures, strict=True)]
    slope = -(torque(angle + h) - torque(angle - h)) / (2.0 * h)
    assert joint_stiffness(each, (radius, -radius)).total == pytest.approx(slope, rel=1e-5)


def test_exchanging_the_muscles_turns_the_torque_and_keeps_the_stiffness():
    pair, radius = (row(IDEAL), row(IDEAL)), 0.0124
    for angle in np.linspace(-0.5, 0.5, 5).tolist():
        there = antagonist_torque(pair, radius, angle, (4e5, 1e5))
        back = antagonist_torque(pair, radius, -angle, (1e5, 4e5))
        assert there == pytest.approx(-back, rel=1e-12)
    assert antagonist_torque(pair, radius, 0.0, (3e5, 3e5)) == 0.0
    assert antagonist_torque(pair, radius, 0.0, (4e5, 3e5)) > 0.0
