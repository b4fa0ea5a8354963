"""Muscles to try the actuator on: every force law with every hysteresis option."""

from __future__ import annotations

from typing import Any

from pamsim.actuator.kernel import charged_air_state
from pamsim.actuator.layout import pack, state_size
from pamsim.actuator.muscle import FORCE_LAWS, HYSTERESIS_LAWS, Mounting, Muscle
from pamsim.hysteresis.bouc_wen import BoucWen
from pamsim.muscles.braid import Braid
from pamsim.muscles.exponential import SixParameter
from pamsim.muscles.mckibben import IdealMcKibben
from pamsim.muscles.passive import HardeningPassive
from pamsim.muscles.tension import Threshold
from pamsim.pneumatics.chamber import Chamber
from pamsim.pneumatics.valves import ValvePair

FORCES = {
    "ideal_mckibben": IdealMcKibben(scale=0.9),
    "six_parameter": SixParameter(
        scale=1.1, a=-4e-5, b=292.0, c=-32.9, d=-9.3e-3, e=2.94e-3, f=-280.0
    ),
}
HYSTERESES = {
    "none": None,
    "bouc_wen": BoucWen(
        force=5.0, force_per_pressure=4e-5, yield_contraction=0.005, sigma=0.7, sharpness=2.0
    ),
}
KINDS = [(law, loop) for law in FORCES for loop in HYSTERESES]
"""Names of every combination; `test_layout` checks that no law is left out."""


def make(law: str = "ideal_mckibben", loop: str = "none", **changes: Any) -> Muscle:
    """A muscle in which every effect is on and every number differs from its default."""
    groups: dict[str, Any] = {
        "mounting": Mounting(length_at_zero=0.05),
        "braid": Braid(nominal_length=0.25, diameter=0.02, fibre_angle=0.5),
        "force": FORCES[law],
        "passive": HardeningPassive(stiffness=900.0, hardening=9.0, slack_contraction=0.02),
        "threshold": Threshold(pressure=2e4),
        "hysteresis": HYSTERESES[loop],
        "chamber": Chamber(
            polytropic_index=1.2, temperature=300.0, dead_volume=1e-5, atmosphere=9.8e4, floor=2e3
        ),
        "valve": ValvePair(
            conductance_fill=6e-9,
            conductance_exhaust=9e-9,
            critical_ratio=0.3,
            laminar_ratio=0.995,
            supply_pressure=6e5,
            pulse_period=0.03,
            regulator_band=2e4,
            regulator_dead_band=1e3,
        ),
        "command": "valve",
    }
    return Muscle(**(groups | changes))


def charged(muscle: Muscle, tendon: float, pressure: float, z: float = 0.3) -> list[float]:
    """States of a muscle filled to a gauge pressure [Pa] at a tendon length [m]."""
    air = float(charged_air_state(pack(muscle), tendon, pressure))
    return [z] * (state_size(muscle) - 1) + [air]


def names_covered() -> bool:
    """Whether the tables above hold one muscle per law that the kernel knows."""
    forces = {type(law) for law in FORCES.values()}
    operators = {type(law) if law else None for law in HYSTERESES.values()}
    return forces == set(FORCE_LAWS) and operators == set(HYSTERESIS_LAWS)
