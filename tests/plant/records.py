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


def _fields(text: str) -> np.dtype[Any]:
    """Names of a table, whose lines are names, and after ``#`` what they are."""
    names = [name for line in text.splitlines() for name in line.partition("#")[0].split()]
    return np.dtype([(name, np.float64) for name in names])


JOINT = _fields("""
inertia                     # about the joint's axis [kg m^2]
weight_cos weight_sin       # gravity's torque is weight_cos cos(q) + weight_sin sin(q) [N m]
moment                      # mass times distance of the centre of mass from the axis [kg m]
damping stiffness spring_at # [N m s/rad]; of its own spring [N m/rad], which is free here [rad]
dry                         # Coulomb friction, sticks [N m]
shift_damping backlash      # of the chain on the sprocket [N s/m, m]
refill                      # fall of the supply's pressure per flow of all muscles [Pa s/kg]
reservoir                   # volume of the supply behind that resistance [m^3]
# hidden
static static_speed         # friction at standstill above the Coulomb friction, sticks [N m],
                            # and speed over which it vanishes [rad/s]
carried                     # friction per sum of the tensions, sticks [m]
bristle bristle_slip        # torque of the bristles that slip [N m], at this deflection [rad]
bristle_static bristle_speed # more of it at standstill [N m], which vanishes over this [rad/s]
bristle_power               # how gradually they slip: exponent of Dahl's law
bristle_damping             # [N m s/rad]
smooth_dry smooth_speed     # tanh friction [N m, rad/s]
drag drag_power             # torque drag |w|^drag_power sign(w) [N m (s/rad)^drag_power]
torque                      # constant [N m]
ripple ripple_periods ripple_phase # amplitude [N m], per radian [-], [rad]
detent detent_at detent_width # largest torque [N m], middle, and from there to that torque [rad]
stop_at stop_stiffness      # soft stop on one side [rad, N m/rad]
cube                        # spring that stiffens with the angle's cube [N m/rad^3]
patch patch_at patch_width patch_speed # dry friction about an angle [N m, rad, rad], smooth in
                            # speed [rad/s]
tooth_stiffness             # of elastic teeth; 0 for hard ones [N/m]
tooth_bend                  # deflection at which round teeth have that on average; 0 straight [m]
refill_square               # the same as `refill`, per squared flow [Pa s^2/kg^2]
cross                       # laminar leak between the first two muscles [kg/(s Pa)]
""")

MUSCLE = _fields("""
arm                         # tendon length per angle, signed [m/rad]
length_at_zero nominal_length diameter fibre_angle extensibility
law                         # 0 six-parameter, 1 ideal McKibben
scale a b c d e f           # its coefficients
passive_stiffness passive_softening passive_slack passive_locking
threshold end_loss end_onset
loop_force loop_per_pressure loop_share # Bouc-Wen hysteresis
loop_yield loop_sigma loop_sharpness
polytropic temperature dead_volume atmosphere leak
fill_conductance exhaust_conductance critical laminar supply
band dead_band dead_zone_fill dead_zone_exhaust lag delay
compliance compliance_time  # of the chain
teeth teeth_pitch teeth_phase # ripple of the travel on the sprocket's teeth [m, m, rad]
cam cam_at cam_width        # share by which the arm is larger, where and how wide [-, rad, rad]
braid_rub                   # friction of the braid per pressure and rate of contraction [N s/Pa]
brake brake_speed           # Stribeck friction along the tendon, smooth in speed [N, m/s]
rub rub_share               # friction of bristles along the tendon [N], and per tension [-]
rub_static                  # more of it at standstill, lost at brake_speed [N]
rub_travel rub_time         # in which it builds up [m]; damping over stiffness of that travel [s]
creep_0 creep_1 creep_2 creep_3 creep_4 # stiffness of each relaxing branch [N] ...
creep_time_0 creep_time_1 creep_time_2 creep_time_3 creep_time_4 # ... and time constant [s]
# hidden
play_force play_per_pressure # hysteresis of play operators [N], and per pressure [N/Pa]
play_reach                  # contraction at which the last of them slips [-]
play_even                   # 1: shares grow with the reach (Prandtl-Ishlinskii)
                            # 0: they fall (Maxwell slip)
duhem_per_pressure duhem_travel # hysteresis of the Duhem type [N/Pa, -]
duhem_skew                  # how much faster it turns over while the muscle shortens [-]
lost_pressure lost_over     # threshold that builds up smoothly, over this pressure [Pa]
cubic cubic_at              # cubic spring [N], of which the cube equals the rest at a stretch [-]
sinh sinh_at                # spring that stiffens exponentially [N], over this stretch [-]
cone cone_onset cone_bend   # share of the force lost per contraction [-]
swell swell_at swell_width  # area that the pressure pulls on besides [m^2], where and how wide [-]
knot knot_at knot_width     # force without pressure besides [N], where and how wide [-]
ageing ageing_time          # share of the force lost in the end
laminar_leak                # [kg/(s Pa)]
nozzle                      # 1: isentropic nozzle in place of ISO 6358's ellipse
heat_time                   # of the air's temperature; replaces the polytropic law [s]
hardening                   # tension around which the chain's compliance falls [N]
slew slew_scale             # full scale per second of the command's line [1/s]; full scale
second_lag                  # behind the first [s]
stuck_from stuck_at         # time from which the valve opens no further than this [s, -]
lift                        # opening over which poppets lift out of the way of the flow [-]
stuck_fills                 # 1 for the fill valve, -1 for the exhaust valve, 0 for neither
""")

# States of the joint, then of each muscle.
ANGLE, SPEED, RESERVOIR, BRISTLE, SHIFT = range(5)
JOINT_STATES = 5
PRESSURE, STRETCH, LOOP, DUHEM, LINE, SECOND_LINE, AIR_TEMPERATURE, RUB, STRAIN = range(9)
MUSCLE_STATES = STRAIN + BRANCHES


def state_count(muscles: int) -> int:
    """Number of states of a plant."""
    return JOINT_STATES + muscles * MUSCLE_STATES
