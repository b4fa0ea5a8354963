"""Muscles to try the actuator on: every force law and every hysteresis operator of the catalogs."""

from __future__ import annotations

import dataclasses
from typing import Any

from pamsim.core.parameters import ParameterGroup
from pamsim.physics.braid import Braid
from pamsim.physics.chain import Chain
from pamsim.physics.chamber import Chamber
from pamsim.physics.force_laws.effective_area import EffectiveArea, Stroke
from pamsim.physics.force_laws.exponential import (
    InvertibleExponential,
    SinglePressureExponential,
    SixParameter,
)
from pamsim.physics.force_laws.mckibben import CorrectedMcKibben, ElasticEnergy, IdealMcKibben
from pamsim.physics.force_laws.mooney_rivlin import MooneyRivlin
from pamsim.physics.force_laws.pleated import Pleated, PleatedShape
from pamsim.physics.friction import Friction
from pamsim.physics.hysteresis.group import Hysteresis
from pamsim.physics.hysteresis.maxwell_slip import BLOCKS
from pamsim.physics.hysteresis.preisach import Preisach
from pamsim.physics.muscle import Mounting, Muscle
from pamsim.physics.passive import Creep, PassiveSpring
from pamsim.physics.record import COMMON, pack, state_size
from pamsim.physics.tension import EndShape, Threshold
from pamsim.physics.valves import ValvePair
from tests.unit.physics.flat import charged_air_state, length_at_muscle
from tests.unit.physics.hysteresis.operator_runs import GROUPS

FORCES: dict[str, ParameterGroup] = {
    type(law).law: law
    for law in (
        IdealMcKibben(scale=0.9),
        SixParameter(scale=1.1, a=-4e-5, b=292.0, c=-32.9, d=-9.3e-3, e=2.94e-3, f=-280.0),
        CorrectedMcKibben(scale=1.1, a_eps=15.53, b_eps=-1.2386, a_kappa=0.3788, b_kappa=-1.1877),
        SinglePressureExponential(scale=1.1, a=280.0, b=-32.9, d=-2800.0, e=600.0),
        InvertibleExponential(
            scale=1.1, a=7.9e-5, b=419.9, c=-50.9, e=-8.9e-3, f=159.0, g=2.7e-3, h=-327.5
        ),
        ElasticEnergy(scale=1.1, working_pressure=3e5, working_contraction=0.1),
        Pleated(scale=1.1, f0=0.023, f1=1.03, f2=-4.6, f3=6.7, f4=-5.1),
        PleatedShape(scale=1.1, slenderness=6.0),
        MooneyRivlin(scale=1.5, c1=-150.0, c2=360.0, slack_contraction=0.002, active_share=0.95),
    )
}
WIDTHS = {"force": 5.0, "force_per_pressure": 4e-5, "force_share": 0.03}
COARSE = {"levels": 9.0}
"""Of the grids, one that plain Python gets through soon."""
LOOPS: dict[str, Hysteresis] = {
    group.law: dataclasses.replace(
        group, chord=8.0, **WIDTHS, **(COARSE if isinstance(group, Preisach) else {})
    )
    for group in GROUPS
}
KINDS = [
    ("ideal_mckibben", "none"),
    ("six_parameter", "bouc_wen"),
    *((law, "none") for law in FORCES if law != "ideal_mckibben"),
    *(("ideal_mckibben", loop) for loop in LOOPS),
]
"""Every law alone and every operator on the ideal law; `test_record` sees that none is left out."""


def make(law: str = "ideal_mckibben", loop: str = "none", **changes: Any) -> Muscle:
    """A muscle in which every effect is on and every number differs from its default.

    But for parallel hysteresis, first stroke and softening, which have tests of their own.
    """
    groups: dict[str, Any] = {
        "mounting": Mounting(length_at_zero=0.05),
        "braid": Braid(
            nominal_length=0.25,
            diameter=0.02,
            fibre_angle=0.5,
            extensibility=0.0 if law.startswith("pleated") else 2e-8,
        ),
        "force": FORCES[law],
        "passive": PassiveSpring(
            stiffness=900.0, softening=9.0, slack_contraction=0.02, locking=18.0
        ),
        "threshold": Threshold(pressure=2e4),
        "hysteresis": LOOPS.get(loop),
        "chamber": Chamber(
            polytropic_index=1.2,
            temperature=300.0,
            dead_volume=1e-5,
            atmosphere=9.8e4,
            floor=2e3,
            leak_conductance=2e-11,
            laminar_leak_conductance=7e-12,
            cross_leak_conductance=4e-12,
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
            dead_zone=0.04,
            dead_zone_asymmetry=0.3,
            least_set_point=5e3,
            supply_resistance=3e7,
            supply_volume=2e-4,
            supply_line=2.0,
            line_lag=0.03,
            delay=0.02,
        ),
        "end_shape": EndShape(loss=0.3, onset=0.02),
        "creep": Creep(
            stiffness=700.0, relaxation_time=0.6, stiffness_2=400.0, relaxation_time_2=3.0
        ),
        "chain": Chain(compliance=2e-6, relaxation_time=8e-3, backlash=4e-4),
        "friction": Friction(
            stribeck_force=9.0,
            stribeck_velocity=3e-3,
            coulomb_force=4.0,
            breakaway_force=2.0,
            dwell_force=1.5,
            dwell_time=0.7,
            dwell_travel=8e-5,
            tension_share=0.01,
            presliding=3e-5,
            bristle_time=1e-3,
        ),
        "command": "valve",
    }
    return Muscle(**(groups | changes))


def bellows(scale: float = 1.1, **changes: Any) -> Muscle:
    """An actuator of the one law whose force may push."""
    own = make()
    groups: dict[str, Any] = {
        "mounting": Mounting(length_at_zero=0.08),
        "stroke": Stroke(nominal_length=0.1, damping=12.0),
        "force": EffectiveArea(scale=scale, area=5e-4, stiffness=300.0),
        "chamber": dataclasses.replace(own.chamber, dead_volume=3e-5),
        "valve": own.valve,
    }
    return Muscle(**(groups | changes))


TIGHT = dataclasses.replace(make().chamber, leak_conductance=0.0, laminar_leak_conductance=0.0)
"""A chamber from which nothing leaks."""
PLAIN_VALVE = dataclasses.replace(
    make().valve, dead_zone=0.0, supply_resistance=0.0, line_lag=0.0, delay=0.0
)
"""A pair of valves that hears its command at once, behind a supply that does not sag."""
LASTING = {
    "chain": Chain(),
    "creep": Creep(),
    "friction": Friction(),
    "chamber": TIGHT,
    "braid": dataclasses.replace(make().braid, extensibility=0.0),
}
"""For `make`: nothing but the operator remembers, loses air or costs work, and the volume is soon
computed."""

EXTENSION = 1e-3
"""Of the chain in a `charged` muscle [m]; a rigid chain has the state too and does not mind it."""
SHIFT = -1e-4
"""Of the chain on the sprocket in a `charged` muscle [m]; not used without backlash."""
RUBBED = 3.0
"""Dry friction along the tendon of a `charged` muscle [N]."""
SAGGED = 0.01
"""Sag of the supply of a `charged` muscle, as a share of its pressure [-]."""
BONDED = 0.4
"""Bonds of the dry friction of a `charged` muscle [-]."""
RELAXED, RELAXED_2 = 0.07, 0.05
"""Contractions at which the elements of a `charged` muscle's creep are relaxed [-]."""


def charged(
    muscle: Muscle, tendon: float, pressure: float, z: float = 0.3, carried: float = 0.0
) -> list[float]:
    """States of a muscle filled to a gauge pressure [Pa] at a tendon length [m].

    An operator's memory starts at zero but for its first state, which is ``z`` where that is one
    of a single state. The command's line carries ``carried``, the others are as stated above.
    """
    row = pack(muscle)
    memory = [0.0] * (state_size(muscle) - COMMON)
    if len(memory) == 1:
        memory[0] = z
    # No step before; neither heat nor tube nor slow valves.
    early = [*[0.0] * (BLOCKS + 2), BONDED, *[0.0] * 3, RELAXED_2, 0.0, 0.0]
    states = [*memory, *early, SAGGED, RUBBED, carried, RELAXED, SHIFT, EXTENSION, 0.0]
    length = length_at_muscle(row, states, tendon)
    return [*states[:-1], float(charged_air_state(row, states, length, pressure))]
