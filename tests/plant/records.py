"""What describes a plant: numbers of the joint and of each muscle, and its states.

The numbers are numpy records, which plain Python and compiled code read in the same way. A field
that is 0 turns its law off, unless its comment states otherwise. Fields up to ``# hidden`` are what
a rig states; the others belong to hidden effects.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

Record: TypeAlias = Any
"""One record of a dtype below: a number per field, by attribute."""


PLAYS = 6
"""Play operators of each muscle."""

BRANCHES = 5
"""Relaxing branches of each muscle, the first of which is the rig's own."""

JOINT_FIELDS = (
    "inertia",  # about the joint's axis [kg m^2]
    "weight_cos",  # gravity's torque is weight_cos cos(q) + weight_sin sin(q) [N m]
    "weight_sin",
    "moment",  # mass times distance of the centre of mass from the axis [kg m]
    "damping",  # [N m s/rad]
    "stiffness",  # of the joint's own spring [N m/rad]
    "spring_at",  # angle at which it is free [rad]
    "dry",  # Coulomb friction, sticks [N m]
    "shift_damping",  # of the chain on the sprocket [N s/m]
    "backlash",  # [m]
    "refill",  # fall of the supply's pressure per flow of all muscles [Pa s/kg]
    "reservoir",  # volume of the supply behind that resistance [m^3]
    # hidden
    "static",  # friction at standstill above the Coulomb friction, sticks [N m]
    "static_speed",  # over which it vanishes [rad/s]
    "carried",  # friction per sum of the tensions, sticks [m]
    "bristle",  # torque of the bristles that slip [N m]
    "bristle_static",  # more of it at standstill [N m]
    "bristle_speed",  # over which that vanishes [rad/s]
    "bristle_slip",  # deflection at which they slip [rad]
    "bristle_power",  # how gradually: exponent of Dahl's law
    "bristle_damping",  # [N m s/rad]
    "smooth_dry",  # tanh friction [N m]
    "smooth_speed",  # [rad/s]
    "drag",  # torque drag |w|^drag_power sign(w) [N m (s/rad)^drag_power]
    "drag_power",
    "torque",  # constant [N m]
    "ripple",  # amplitude [N m]
    "ripple_periods",  # per radian
    "ripple_phase",  # [rad]
    "detent",  # largest torque of a detent [N m]
    "detent_at",  # [rad]
    "detent_width",  # from its middle to that torque [rad]
    "stop_at",  # soft stop on one side: angle [rad]
    "stop_stiffness",  # [N m/rad]
    "tooth_stiffness",  # of elastic teeth; 0 for hard ones [N/m]
    "tooth_bend",  # deflection at which round teeth have that stiffness on average; 0 straight [m]
    "refill_square",  # the same per squared flow [Pa s^2/kg^2]
    "cross",  # laminar leak between the first two muscles [kg/(s Pa)]
)

MUSCLE_FIELDS = (
    "arm",  # tendon length per angle, signed [m/rad]
    "length_at_zero",
    "nominal_length",
    "diameter",
    "fibre_angle",
    "extensibility",
    "law",  # 0 six-parameter, 1 ideal McKibben
    "scale",
    "a",
    "b",
    "c",
    "d",
    "e",
    "f",
    "passive_stiffness",
    "passive_softening",
    "passive_slack",
    "passive_locking",
    "threshold",
    "end_loss",
    "end_onset",
    "loop_force",  # Bouc-Wen hysteresis
    "loop_per_pressure",
    "loop_share",
    "loop_yield",
    "loop_sigma",
    "loop_sharpness",
    "polytropic",
    "temperature",
    "dead_volume",
    "atmosphere",
    "leak",
    "fill_conductance",
    "exhaust_conductance",
    "critical",
    "laminar",
    "supply",
    "band",
    "dead_band",
    "dead_zone_fill",
    "dead_zone_exhaust",
    "lag",
    "delay",
    "compliance",
    "compliance_time",
    "teeth",  # amplitude by which the travel on the sprocket's teeth ripples [m]
    "teeth_pitch",  # [m]
    "teeth_phase",  # [rad]
    "braid_rub",  # friction of the braid per pressure and rate of contraction [N s/Pa]
    "brake",  # Stribeck friction along the tendon, smooth in speed [N]
    "brake_speed",  # [m/s]
    "rub",  # friction of bristles along the tendon [N]
    "rub_static",  # more of it at standstill, lost at brake_speed [N]
    "rub_share",  # and per tension [-]
    "rub_travel",  # in which it builds up [m]
    "rub_time",  # damping of that travel over its stiffness [s]
    "creep_0",  # stiffness of each relaxing branch [N] ...
    "creep_1",
    "creep_2",
    "creep_3",
    "creep_4",
    "creep_time_0",  # ... and its time constant [s]
    "creep_time_1",
    "creep_time_2",
    "creep_time_3",
    "creep_time_4",
    # hidden
    "play_force",  # hysteresis of play operators, without pressure [N]
    "play_per_pressure",  # and per pressure [N/Pa]
    "play_reach",  # contraction at which the last of them slips [-]
    "play_even",  # 1: shares grow with the reach (Prandtl-Ishlinskii); 0: they fall (Maxwell slip)
    "duhem_per_pressure",  # hysteresis of the Duhem type [N/Pa]
    "duhem_travel",  # [-]
    "duhem_skew",  # how much faster it turns over while the muscle shortens [-]
    "lost_pressure",  # threshold that builds up smoothly [Pa]
    "lost_over",  # pressure over which it does [Pa]
    "cubic",  # stiffness of a cubic spring [N]
    "cubic_at",  # stretch at which its cubic part equals its linear one [-]
    "sinh",  # stiffness of a spring that stiffens exponentially [N]
    "sinh_at",  # stretch over which it does [-]
    "cone",  # share of the force lost per contraction [-]
    "cone_onset",
    "cone_bend",
    "ageing",  # share of the force lost in the end
    "ageing_time",
    "laminar_leak",  # [kg/(s Pa)]
    "nozzle",  # 1: isentropic nozzle in place of ISO 6358's ellipse
    "heat_time",  # of the air's temperature; replaces the polytropic law [s]
    "hardening",  # tension around which the chain's compliance falls [N]
    "slew",  # full scale per second of the command's line [1/s]
    "slew_scale",  # full scale [unit of the command]
    "second_lag",  # behind the first [s]
    "stuck_from",  # time from which the valve opens no further than stuck_at [s]
    "stuck_at",
    "stuck_fills",  # 1 for the fill valve, -1 for the exhaust valve, 0 for neither
)

JOINT = np.dtype([(name, np.float64) for name in JOINT_FIELDS])
MUSCLE = np.dtype([(name, np.float64) for name in MUSCLE_FIELDS])

# States of the joint, then of each muscle.
ANGLE, SPEED, RESERVOIR, BRISTLE, SHIFT = range(5)
JOINT_STATES = 5
PRESSURE, STRETCH, LOOP, DUHEM, LINE, SECOND_LINE, AIR_TEMPERATURE, RUB, STRAIN = range(9)
MUSCLE_STATES = STRAIN + BRANCHES


def state_count(muscles: int) -> int:
    """Number of states of a plant."""
    return JOINT_STATES + muscles * MUSCLE_STATES
