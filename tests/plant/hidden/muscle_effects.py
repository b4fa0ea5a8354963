"""Hidden effects of the muscles' force, and of the chain that they pull."""

from __future__ import annotations

from functools import partial

from pamsim.core.errors import InputError
from pamsim.diagnosis.bench import PRESSURE
from pamsim.effects.effect import SECOND_MUSCLE
from tests.plant.hidden.hidden_effect import (
    Own,
    PlantEffect,
    Quantities,
    Quantity,
    on_joint,
    on_muscles,
)
from tests.plant.hidden.virtual_tests import creep, muscle_loop, pull_change
from tests.plant.muscle import inside_pressure
from tests.plant.read_rig import Numbers

_LOOP = "hysteresis.force_per_pressure"
_SECOND_SCALE = f"{SECOND_MUSCLE}:force.scale"

_TWO_BRANCHES = ((0.55, 0.25), (0.45, 2.5), (0.0, 1.0), (0.0, 1.0))
"""Share of the stiffness and time constant [s] of the creep's branches."""

_MANY_BRANCHES = ((0.35, 0.05), (0.27, 0.35), (0.13, 2.5), (0.25, 20.0))
"""The same of a creep whose force falls about as a power of time, from 0.05 to 8 s."""

_MIDDLE_TENSION = 700.0
"""Tension at which a chain that hardens gives as much as a linear one [N]."""


def _branches(branches: tuple[tuple[float, float], ...], size: float) -> dict[str, float]:
    shares = {f"creep_{k}": share * size for k, (share, _) in enumerate(branches, start=1)}
    return shares | {f"creep_time_{k}": time for k, (_, time) in enumerate(branches, start=1)}


def _as_half_width(_: float, found: Quantities, own: Own) -> dict[str, float]:
    return {_LOOP: own(_LOOP) + found["loop_half_width"].value / PRESSURE}


def _lost_pressure(there: Numbers, _: Numbers, __: float) -> Quantities:
    lost = PRESSURE - inside_pressure(there.muscles[0], PRESSURE)
    return {
        "pressure_lost": Quantity(float(lost), "Pa"),
        "at_pressure": Quantity(PRESSURE, "Pa"),
    }


def _unequal(n: Numbers, size: float) -> None:
    if float(n.muscles[-1].law) != 0.0:
        raise InputError("unequal_muscles needs the six-parameter law, which this rig has not")
    n.muscles[-1].e *= 1.0 + size
    n.muscles[-1].d *= 1.0 + 3.0 * size


_hysteresis = partial(
    PlantEffect,
    stands_for=("muscle_hysteresis",),
    unit="N/Pa",
    typical=1.5e-4,
    measure=muscle_loop,
    library=_as_half_width,
)
_creep = partial(
    PlantEffect,
    stands_for=("viscoelastic_creep",),
    unit="N",
    typical=2000.0,
    measure=creep,
    equals="creep.stiffness",
)
_beside = partial(
    PlantEffect,
    stands_for=("passive_stiffness",),
    unit="N",
    typical=2800.0,
    measure=pull_change,
    signed=True,
)
_backlash = partial(
    PlantEffect,
    stands_for=("chain_backlash",),
    unit="m",
    typical=3e-4,
    stated="lost_travel",
    equals="chain.backlash",
)

EFFECTS = (
    _hysteresis(
        name="play_hysteresis",
        formulation="Prandtl-Ishlinskii hysteresis of six play operators up to 2 % contraction,"
        " less its chord, growing with pressure",
        typical=4e-4,
        change=on_muscles("play_per_pressure", play_reach=0.02, play_even=1.0),
    ),
    _hysteresis(
        name="slip_hysteresis",
        formulation="Maxwell-slip hysteresis of six blocks, growing with pressure",
        change=on_muscles("play_per_pressure", play_reach=7e-3, play_even=0.0),
    ),
    _hysteresis(
        name="duhem_hysteresis",
        formulation="Duhem hysteresis that turns over faster while the muscle shortens, growing"
        " with pressure",
        change=on_muscles("duhem_per_pressure", duhem_travel=4e-3, duhem_skew=0.4),
    ),
    PlantEffect(
        name="constant_hysteresis",
        formulation="Maxwell-slip hysteresis of six blocks, the same at every pressure",
        resembles=("muscle_hysteresis", "coulomb_friction"),
        family="muscle_hysteresis",
        unit="N",
        typical=30.0,
        change=on_muscles("play_force", play_reach=7e-3, play_even=0.0),
        measure=muscle_loop,
    ),
    _creep(
        name="two_branch_creep",
        formulation="two Maxwell branches that relax in 0.25 s and 2.5 s",
        change=on_muscles(lambda s: _branches(_TWO_BRANCHES, s)),
    ),
    _creep(
        name="power_law_creep",
        formulation="creep whose force falls about as a power of time between 0.05 and 8 s",
        change=on_muscles(lambda s: _branches(_MANY_BRANCHES, s)),
    ),
    PlantEffect(
        name="smooth_threshold",
        formulation="a loss of pressure that builds up smoothly over 0.8 bar",
        stands_for=("threshold_pressure",),
        unit="Pa",
        typical=1.5e4,
        change=on_muscles("lost_pressure", lost_over=8e4),
        measure=_lost_pressure,
        library=lambda _, found, __: {"threshold.pressure": found["pressure_lost"].value},
    ),
    _beside(
        name="cubic_spring",
        formulation="a cubic spring beside each muscle",
        change=on_muscles("cubic", cubic_at=0.02),
    ),
    _beside(
        name="stiffening_spring",
        formulation="a spring beside each muscle that stiffens exponentially to both sides",
        change=on_muscles("sinh", sinh_at=0.015),
    ),
    PlantEffect(
        name="cone_ends",
        formulation="a loss of force proportional to contraction beyond a smooth onset",
        stands_for=("end_shape",),
        unit="1",
        typical=1.0,
        change=on_muscles("cone", cone_onset=0.01, cone_bend=4e-3),
        measure=pull_change,
    ),
    PlantEffect(
        name="unequal_muscles",
        formulation="coefficients e and d of the last muscle's law differ, d three times as much",
        stands_for=("muscle_mismatch",),
        unit="1",
        typical=0.04,
        change=_unequal,
        measure=pull_change,
        library=lambda _, found, own: {
            _SECOND_SCALE: own(_SECOND_SCALE) * found["force_per_pressure_ratio"].value
        },
        signed=True,
    ),
    PlantEffect(
        name="ageing_drift",
        formulation="all muscles lose force within each trial, with a time constant of 4 s",
        stands_for=("softening",),
        unit="1",
        typical=0.03,
        change=on_muscles("ageing", ageing_time=4.0),
        stated="share_lost_in_the_end",
        equals="softening.share",
        signed=True,
    ),
    PlantEffect(
        name="hardening_chain",
        formulation="a chain that gives less under more tension",
        stands_for=("chain_compliance",),
        unit="m/N",
        typical=1e-6,
        change=on_muscles("compliance", compliance_time=5e-3, hardening=_MIDDLE_TENSION),
        stated="compliance_at_700_N",
        equals="chain.compliance",
    ),
    _backlash(
        name="elastic_teeth",
        formulation="backlash between elastic teeth, with less friction on them",
        change=on_joint("backlash", tooth_stiffness=4e5, shift_damping=500.0),
    ),
    _backlash(
        name="round_teeth",
        formulation="backlash between round teeth that give as bodies of Hertz do",
        change=on_joint("backlash", tooth_stiffness=4e5, tooth_bend=5e-4, shift_damping=700.0),
    ),
)
"""Hidden effects of muscles and chain."""
