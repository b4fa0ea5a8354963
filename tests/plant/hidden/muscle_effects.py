"""Hidden effects of the muscles' force, and of the chain that they pull."""

from __future__ import annotations

from pamsim.core.errors import InputError
from pamsim.effects.effect import SECOND_MUSCLE
from tests.plant.hidden.hidden_effect import Own, PlantEffect, Quantities, Quantity, stated
from tests.plant.hidden.virtual_tests import PRESSURE, creep, muscle_loop, pull_change
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


def _prandtl_ishlinskii(n: Numbers, size: float) -> None:
    n.muscles.play_per_pressure, n.muscles.play_reach, n.muscles.play_even = size, 0.02, 1.0


def _maxwell_slip(n: Numbers, size: float) -> None:
    n.muscles.play_per_pressure, n.muscles.play_reach, n.muscles.play_even = size, 7e-3, 0.0


def _constant_loop(n: Numbers, size: float) -> None:
    n.muscles.play_force, n.muscles.play_reach, n.muscles.play_even = size, 7e-3, 0.0


def _duhem(n: Numbers, size: float) -> None:
    n.muscles.duhem_per_pressure, n.muscles.duhem_travel = size, 4e-3
    n.muscles.duhem_skew = 0.4


def _as_half_width(_: float, found: Quantities, own: Own) -> dict[str, float]:
    return {_LOOP: own(_LOOP) + found["loop_half_width"].value / PRESSURE}


def _branches(branches: tuple[tuple[float, float], ...]):
    def change(n: Numbers, size: float) -> None:
        for k, (share, time) in enumerate(branches, start=1):
            n.muscles[f"creep_{k}"], n.muscles[f"creep_time_{k}"] = share * size, time

    return change


def _smooth_threshold(n: Numbers, size: float) -> None:
    n.muscles.lost_pressure, n.muscles.lost_over = size, 8e4


def _lost_pressure(there: Numbers, _: Numbers, __: float) -> Quantities:
    lost = PRESSURE - inside_pressure(there.muscles[0], PRESSURE)
    return {
        "pressure_lost": Quantity(value=float(lost), unit="Pa"),
        "at_pressure": Quantity(value=PRESSURE, unit="Pa"),
    }


def _cubic(n: Numbers, size: float) -> None:
    n.muscles.cubic, n.muscles.cubic_at = size, 0.02


def _cone(n: Numbers, size: float) -> None:
    n.muscles.cone, n.muscles.cone_onset, n.muscles.cone_bend = size, 0.01, 4e-3


def _unequal(n: Numbers, size: float) -> None:
    if float(n.muscles[-1].law) != 0.0:
        raise InputError("unequal_muscles needs the six-parameter law, which this rig has not")
    n.muscles[-1].e *= 1.0 + size
    n.muscles[-1].d *= 1.0 + 3.0 * size


def _ageing(n: Numbers, size: float) -> None:
    n.muscles.ageing, n.muscles.ageing_time = size, 4.0


def _hardening(n: Numbers, size: float) -> None:
    n.muscles.compliance, n.muscles.compliance_time = size, 5e-3
    n.muscles.hardening = _MIDDLE_TENSION


def _teeth(n: Numbers, size: float) -> None:
    n.joint.backlash, n.joint.tooth_stiffness, n.joint.shift_damping = size, 4e5, 500.0


EFFECTS = (
    PlantEffect(
        name="play_hysteresis",
        formulation="Prandtl-Ishlinskii hysteresis of six play operators up to 2 % contraction,"
        " less its chord, growing with pressure",
        stands_for=("muscle_hysteresis",),
        unit="N/Pa",
        typical=4e-4,
        change=_prandtl_ishlinskii,
        measure=muscle_loop,
        library=_as_half_width,
    ),
    PlantEffect(
        name="slip_hysteresis",
        formulation="Maxwell-slip hysteresis of six blocks, growing with pressure",
        stands_for=("muscle_hysteresis",),
        unit="N/Pa",
        typical=1.5e-4,
        change=_maxwell_slip,
        measure=muscle_loop,
        library=_as_half_width,
    ),
    PlantEffect(
        name="duhem_hysteresis",
        formulation="Duhem hysteresis that turns over faster while the muscle shortens, growing"
        " with pressure",
        stands_for=("muscle_hysteresis",),
        unit="N/Pa",
        typical=1.5e-4,
        change=_duhem,
        measure=muscle_loop,
        library=_as_half_width,
    ),
    PlantEffect(
        name="constant_hysteresis",
        formulation="Maxwell-slip hysteresis of six blocks, the same at every pressure",
        resembles=("muscle_hysteresis", "coulomb_friction"),
        family="muscle_hysteresis",
        unit="N",
        typical=30.0,
        change=_constant_loop,
        measure=muscle_loop,
    ),
    PlantEffect(
        name="two_branch_creep",
        formulation="two Maxwell branches that relax in 0.25 s and 2.5 s",
        stands_for=("viscoelastic_creep",),
        unit="N",
        typical=2000.0,
        change=_branches(_TWO_BRANCHES),
        measure=creep,
        library=lambda size, *_: {"creep.stiffness": size},
    ),
    PlantEffect(
        name="power_law_creep",
        formulation="creep whose force falls about as a power of time between 0.05 and 8 s",
        stands_for=("viscoelastic_creep",),
        unit="N",
        typical=2000.0,
        change=_branches(_MANY_BRANCHES),
        measure=creep,
        library=lambda size, *_: {"creep.stiffness": size},
    ),
    PlantEffect(
        name="smooth_threshold",
        formulation="a loss of pressure that builds up smoothly over 0.8 bar",
        stands_for=("threshold_pressure",),
        unit="Pa",
        typical=1.5e4,
        change=_smooth_threshold,
        measure=_lost_pressure,
        library=lambda _, found, __: {"threshold.pressure": found["pressure_lost"].value},
    ),
    PlantEffect(
        name="cubic_spring",
        formulation="a cubic spring beside each muscle",
        stands_for=("passive_stiffness",),
        unit="N",
        typical=2800.0,
        change=_cubic,
        measure=pull_change,
        signed=True,
    ),
    PlantEffect(
        name="cone_ends",
        formulation="a loss of force proportional to contraction beyond a smooth onset",
        stands_for=("end_shape",),
        unit="1",
        typical=1.0,
        change=_cone,
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
        unit="1",
        typical=0.03,
        change=_ageing,
        measure=stated("share_lost_in_the_end", "1"),
        signed=True,
    ),
    PlantEffect(
        name="hardening_chain",
        formulation="a chain that gives less under more tension",
        stands_for=("chain_compliance",),
        unit="m/N",
        typical=1e-6,
        change=_hardening,
        measure=stated("compliance_at_700_N", "m/N"),
        library=lambda size, *_: {"chain.compliance": size},
    ),
    PlantEffect(
        name="elastic_teeth",
        formulation="backlash between elastic teeth, with less friction on them",
        stands_for=("chain_backlash",),
        unit="m",
        typical=3e-4,
        change=_teeth,
        measure=stated("lost_travel", "m"),
        library=lambda size, *_: {"chain.backlash": size},
    ),
)
"""Hidden effects of muscles and chain."""
