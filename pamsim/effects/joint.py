"""Effects at the joint: friction, load, inertia.

Friction that the muscles' tendons carry is in newtons along each tendon: two tendons on sprockets
of radius r brake the joint by 2 r times that.
"""

from __future__ import annotations

from pamsim.effects.effect import JOINT, TILTED, Effect, change, factor, shape, size

# So short that data show none, or so long that it never ends in them.
_PRESLIDING = shape("friction.presliding", 2e-5, 5e-6, 5e-4, starts=(7e-6, 1e-4), natural_ends=True)

EFFECTS = (
    Effect(
        link="joint", family="joint_friction", name="coulomb_friction", form="rigid",
        missing="dry friction at the joint, the same at every speed",
        equation="M = -T_c sign(omega); at rest |M| <= T_c",
        parameters=(size(f"joint.{JOINT}.frictionloss", 0.3, 0.0, 5.0),),
        look_alikes=("stribeck_friction", "muscle_hysteresis", "chain_backlash"),
        separating="equal loops at two common pressures: dry friction keeps their width,"
        " the muscle's hysteresis widens with pressure",
        probes=(0.1, 0.5, 2.0), path_dependent=True,
    ),
    Effect(
        link="joint", family="joint_friction", name="coulomb_friction", form="dahl",
        missing="dry friction at the joint that gives a little before it slips",
        equation="f' = C/d (v - |v| f / C), along each tendon",
        parameters=(size("friction.coulomb_force", 12.0, 0.0, 100.0), _PRESLIDING),
        look_alikes=("stribeck_friction", "muscle_hysteresis", "chain_backlash"),
        separating="reversals so small that the joint only just breaks loose",
        probes=(0.1, 0.5, 2.0), path_dependent=True,
    ),
    Effect(
        link="joint", family="joint_friction", name="coulomb_friction", form="lugre",
        missing="dry friction at the joint that is lower in sliding than at rest",
        equation="f' = g(0)/d (v - |v| f / g(v)), g(v) = C + B exp(-(v/v_s)^2)",
        parameters=(
            size("friction.coulomb_force", 8.0, 0.0, 75.0),
            size("friction.breakaway_force", 4.0, 0.0, 75.0),
            shape(
                "friction.stribeck_velocity", 2e-3, 2e-4, 5e-2, starts=(5e-4, 1e-2),
                natural_ends=True,  # below or above all speeds of the data
            ),
            _PRESLIDING,
        ),
        look_alikes=("stribeck_friction", "load_dependent_friction"),
        separating="a triangle so slow that the arm turns at less than 0.05 rad/s",
        probes=(0.1, 0.5, 2.0), path_dependent=True,
    ),
    Effect(
        link="joint", family="joint_friction", name="coulomb_friction", form="dwell",
        missing="dry friction at the joint that grows the longer it rests",
        equation="f' = (C + D)/d (v - |v| f / (C + D b)), b' = (1 - b) / t_D - |v| b / d_D",
        parameters=(
            size("friction.coulomb_force", 8.0, 0.0, 75.0),
            # As much as in `lugre`: breakaway is a half more than sliding.
            size("friction.dwell_force", 4.0, 0.0, 75.0),
            # Greased joints take some tenths of a second to some ten (Kato et al. 1972).
            shape("friction.dwell_time", 1.0, 0.05, 30.0, starts=(0.2, 5.0), natural_ends=True),
            _PRESLIDING,
        ),
        look_alikes=("stribeck_friction", "viscoelastic_creep", "chain_backlash"),
        separating="equal small reversals after rests of different length: what breaks the joint"
        " loose grows with the rest",
        probes=(0.1, 0.5, 2.0), path_dependent=True, rare=True,
    ),
    Effect(
        link="joint", family="joint_friction", name="coulomb_friction", form="smooth",
        missing="friction at the joint that is the same at every speed, but does not stick",
        equation="M = -T_c omega / max(|omega|, omega_0)",
        parameters=(
            size(f"joint.{JOINT}.frictionloss", 0.3, 0.0, 5.0),
            shape(f"joint.{JOINT}.friction_speed", 0.05, 2e-3, 1.0, starts=(0.3,)),
        ),
        look_alikes=("viscous_friction", "muscle_hysteresis"),
        separating="let go of the arm away from its rest: it creeps back instead of staying",
        probes=(0.1, 0.5, 2.0), path_dependent=True,
    ),
    Effect(
        link="joint", family="joint_friction", name="stribeck_friction",
        missing="joint friction that is higher at low speed",
        equation="f = F v/v_s exp((1 - (v/v_s)^2) / 2), along each tendon",
        parameters=(
            size("friction.stribeck_force", 10.0, 0.0, 150.0),
            shape("friction.stribeck_velocity", 2e-3, 2e-4, 2e-2, starts=(1e-3, 5e-3)),
        ),
        look_alikes=("coulomb_friction",),
        separating="a triangle so slow that the arm turns at less than 0.05 rad/s",
        probes=(0.1, 0.5, 2.0), path_dependent=True,
    ),
    Effect(
        link="joint", family="joint_friction", name="load_dependent_friction",
        missing="dry friction at the joint that grows with the pull of the muscles",
        equation="f' = m T/d (v - |v| f / (m T)), along each tendon under its tension T",
        parameters=(size("friction.tension_share", 0.02, 0.0, 0.15), _PRESLIDING),
        look_alikes=("coulomb_friction", "muscle_hysteresis"),
        separating="equal loops at two common pressures: pressure widens them, but with the arm"
        " held still by hand the forces show no friction",
        probes=(0.1, 0.5, 2.0), path_dependent=True, rare=True,
    ),
    Effect(
        link="joint", family="joint_friction", name="viscous_friction",
        missing="joint friction proportional to speed",
        equation="M = -D omega",
        parameters=(factor(f"joint.{JOINT}.damping", 1.5, 0.2, 5.0),),
        look_alikes=("line_lag", "valve_flow", "added_inertia"),
        separating="let the arm swing freely at one pressure and measure the decay",
    ),
    Effect(
        link="joint", family="load", name="load_torque",
        missing="a gravity or payload torque on the arm",
        equation="gravity g sin(tilt) in the plane in which the arm turns",
        parameters=(change(f"body.{TILTED}.tilt", 0.03, -0.3, 0.3),),
        look_alikes=("angle_bias", "muscle_mismatch"),
        separating="add a known mass: a wrong torque grows with it, an angle offset does not",
    ),
    Effect(
        link="joint", family="inertia", name="added_inertia",
        missing="inertia on the joint",
        equation="M = -J omega'",
        parameters=(change(f"joint.{JOINT}.armature", 0.01, 0.0, 0.5),),
        look_alikes=("viscous_friction",),
        separating="small loaded steps at low stiffness: inertia lowers the frequency",
    ),
)  # fmt: skip
