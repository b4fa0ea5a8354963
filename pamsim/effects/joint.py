"""Effects at the joint: friction, load, inertia.

Friction that the muscles' tendons carry is in newtons along each tendon: two tendons on sprockets
of radius r brake the joint by 2 r times that.
"""

from __future__ import annotations

from pamsim.effects.effect import JOINT, TILTED, Effect, EffectParameter

_PRESLIDING = EffectParameter(
    name="friction.presliding",
    typical=2e-5,
    low=5e-6,
    high=5e-4,
    shape=True,
    starts=(7e-6, 1e-4),
)

EFFECTS = (
    Effect(
        name="coulomb_friction",
        form="rigid",
        family="joint_friction",
        missing="dry friction at the joint, the same at every speed",
        equation="M = -T_c sign(omega); at rest |M| <= T_c",
        parameters=(
            EffectParameter(name=f"joint.{JOINT}.frictionloss", typical=0.3, low=0.0, high=5.0),
        ),
        look_alikes=("stribeck_friction", "muscle_hysteresis", "chain_backlash"),
        separating="equal loops at two common pressures: dry friction keeps their width,"
        " the muscle's hysteresis widens with pressure",
        probes=(0.1, 0.5, 2.0),
        path_dependent=True,
    ),
    Effect(
        name="coulomb_friction",
        form="dahl",
        family="joint_friction",
        missing="dry friction at the joint that gives a little before it slips",
        equation="f' = C/d (v - |v| f / C), along each tendon",
        parameters=(
            EffectParameter(name="friction.coulomb_force", typical=12.0, low=0.0, high=100.0),
            _PRESLIDING,
        ),
        look_alikes=("stribeck_friction", "muscle_hysteresis", "chain_backlash"),
        separating="reversals so small that the joint only just breaks loose",
        probes=(0.1, 0.5, 2.0),
        path_dependent=True,
    ),
    Effect(
        name="coulomb_friction",
        form="lugre",
        family="joint_friction",
        missing="dry friction at the joint that is lower in sliding than at rest",
        equation="f' = g(0)/d (v - |v| f / g(v)), g(v) = C + B exp(-(v/v_s)^2)",
        parameters=(
            EffectParameter(name="friction.coulomb_force", typical=8.0, low=0.0, high=75.0),
            EffectParameter(name="friction.breakaway_force", typical=4.0, low=0.0, high=75.0),
            EffectParameter(
                name="friction.stribeck_velocity",
                typical=2e-3,
                low=2e-4,
                high=5e-2,
                shape=True,
                starts=(5e-4, 1e-2),
            ),
            _PRESLIDING,
        ),
        look_alikes=("stribeck_friction", "load_dependent_friction"),
        separating="a triangle so slow that the arm turns at less than 0.05 rad/s",
        probes=(0.1, 0.5, 2.0),
        path_dependent=True,
    ),
    Effect(
        name="coulomb_friction",
        form="smooth",
        family="joint_friction",
        missing="friction at the joint that is the same at every speed, but does not stick",
        equation="M = -T_c omega / max(|omega|, omega_0)",
        parameters=(
            EffectParameter(name=f"joint.{JOINT}.frictionloss", typical=0.3, low=0.0, high=5.0),
            EffectParameter(
                name=f"joint.{JOINT}.friction_speed",
                typical=0.05,
                low=2e-3,
                high=1.0,
                shape=True,
                starts=(0.3,),
            ),
        ),
        look_alikes=("viscous_friction", "muscle_hysteresis"),
        separating="the arm left alone off its rest: it creeps back, and does not stay",
        probes=(0.1, 0.5, 2.0),
        path_dependent=True,
    ),
    Effect(
        name="stribeck_friction",
        family="joint_friction",
        missing="joint friction that is higher at low speed",
        equation="f = F v/v_s exp((1 - (v/v_s)^2) / 2), along each tendon",
        parameters=(
            EffectParameter(name="friction.stribeck_force", typical=10.0, low=0.0, high=150.0),
            EffectParameter(
                name="friction.stribeck_velocity",
                typical=2e-3,
                low=2e-4,
                high=2e-2,
                shape=True,
                starts=(1e-3, 5e-3),
            ),
        ),
        look_alikes=("coulomb_friction",),
        separating="a triangle so slow that the arm turns at less than 0.05 rad/s",
        probes=(0.1, 0.5, 2.0),
        path_dependent=True,
    ),
    Effect(
        name="load_dependent_friction",
        family="joint_friction",
        missing="dry friction at the joint that grows with the pull of the muscles",
        equation="f' = m T/d (v - |v| f / (m T)), along each tendon under its tension T",
        parameters=(
            EffectParameter(name="friction.tension_share", typical=0.02, low=0.0, high=0.15),
            _PRESLIDING,
        ),
        look_alikes=("coulomb_friction", "muscle_hysteresis"),
        separating="equal loops at two common pressures: friction that grows with the pull widens"
        " them, and the arm held still by hand shows none in the forces",
        probes=(0.1, 0.5, 2.0),
        path_dependent=True,
        rare=True,
    ),
    Effect(
        name="viscous_friction",
        family="joint_friction",
        missing="joint friction proportional to speed",
        equation="M = -D omega",
        parameters=(
            EffectParameter(
                name=f"joint.{JOINT}.damping",
                typical=1.5,
                low=0.2,
                high=5.0,
                neutral=None,
                relative=True,
            ),
        ),
        look_alikes=("line_lag", "valve_flow", "added_inertia"),
        separating="let the arm swing freely at one pressure and measure the decay",
    ),
    Effect(
        name="load_torque",
        family="load",
        missing="a gravity or payload torque on the arm",
        equation="gravity g sin(tilt) in the plane in which the arm turns",
        parameters=(
            EffectParameter(
                name=f"body.{TILTED}.tilt", typical=0.03, low=-0.3, high=0.3, neutral=None
            ),
        ),
        look_alikes=("angle_bias", "muscle_mismatch"),
        separating="add a known mass: a wrong torque grows with it, an angle offset does not",
    ),
    Effect(
        name="added_inertia",
        family="inertia",
        missing="inertia on the joint",
        equation="M = -J omega'",
        parameters=(
            EffectParameter(
                name=f"joint.{JOINT}.armature", typical=0.01, low=0.0, high=0.5, neutral=None
            ),
        ),
        look_alikes=("viscous_friction",),
        separating="small loaded steps at low stiffness: inertia lowers the frequency",
    ),
)
