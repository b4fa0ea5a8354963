"""Effects in the muscle: hysteresis, creep, passive and active force."""

from __future__ import annotations

from pamsim.effects.effect import SECOND_MUSCLE, Effect, EffectParameter

_WIDTH = EffectParameter(
    name="hysteresis.force_per_pressure", typical=1.5e-4, low=0.0, high=2e-3, neutral=None
)

_YIELD = EffectParameter(
    name="hysteresis.yield_contraction",
    typical=2.5e-3,
    low=6e-4,
    high=3e-2,
    neutral=None,
    shape=True,
    starts=(1.2e-3, 8e-3),
)

_CHORD = EffectParameter(
    name="hysteresis.chord",
    typical=20.0,
    low=0.0,
    high=200.0,
    neutral=None,
    shape=True,
    starts=(1.0,),
)
"""Most force laws were fitted to the mean of the branches, some to one of them."""

_SLIP = (
    EffectParameter(
        name="parallel_hysteresis.full_slip",
        typical=0.01,
        low=1e-3,
        high=0.06,
        shape=True,
        starts=(0.004, 0.025),
    ),
    EffectParameter(name="parallel_hysteresis.decay", typical=1.0, low=0.6, high=1.6, shape=True),
    EffectParameter(
        name="parallel_hysteresis.chord",
        typical=20.0,
        low=0.0,
        high=200.0,
        shape=True,
        starts=(1.0,),
    ),
)

_STRENGTH = EffectParameter(
    name=f"{SECOND_MUSCLE}:force.scale",
    typical=1.04,
    low=0.7,
    high=1.4,
    neutral=None,
    relative=True,
)

EFFECTS = (
    Effect(
        name="muscle_hysteresis",
        form="bouc_wen",
        family="muscle_hysteresis",
        missing="rate-independent hysteresis of the muscle, growing with pressure",
        equation="F = F_static - h p z, z' = kappa'/D (1 - |z|^n (sigma sign(z kappa') + 1 -"
        " sigma))",
        parameters=(_WIDTH,),
        look_alikes=("coulomb_friction", "viscoelastic_creep", "chain_backlash"),
        separating="equal loops at two common pressures: hysteresis grows with pressure, dry"
        " friction does not",
        probes=(0.1, 0.5, 2.0),
        path_dependent=True,
    ),
    Effect(
        name="muscle_hysteresis",
        form="free_shape",
        family="muscle_hysteresis",
        missing="rate-independent hysteresis of the muscle, growing with pressure, that turns over"
        " within a contraction of its own",
        equation="F = F_static - h p (z - c kappa), z' = kappa'/D (1 - |z|^n (sigma sign(z kappa')"
        " + 1 - sigma))",
        parameters=(
            _WIDTH,
            _YIELD,
            _CHORD,
        ),
        look_alikes=("coulomb_friction", "viscoelastic_creep", "chain_backlash"),
        separating="loops of different size: in small ones the muscle is stiffer, and the size at"
        " which it yields is the hysteresis's own",
        probes=(0.1, 0.5, 2.0),
        path_dependent=True,
    ),
    Effect(
        name="muscle_hysteresis",
        form="maxwell_slip",
        family="muscle_hysteresis",
        missing="rate-independent hysteresis of the muscle, growing with pressure, with"
        " return-point memory",
        equation="F = F_static - h p (w - c kappa), w = sum share_k (kappa - play(kappa; Delta_k))"
        " / Delta_k, beside the rig's own",
        parameters=(
            EffectParameter(
                name="parallel_hysteresis.force_per_pressure", typical=1.5e-4, low=0.0, high=2e-3
            ),
            *_SLIP,
        ),
        look_alikes=("coulomb_friction", "viscoelastic_creep", "chain_backlash"),
        separating="a small loop within a large one: with return-point memory it closes",
        probes=(0.1, 0.5, 2.0),
        path_dependent=True,
    ),
    Effect(
        name="muscle_hysteresis",
        form="constant",
        family="muscle_hysteresis",
        missing="rate-independent hysteresis of the muscle, the same at every pressure",
        equation="F = F_static - H (w - c kappa), w = sum share_k (kappa - play(kappa; Delta_k))"
        " / Delta_k, beside the rig's own",
        parameters=(
            EffectParameter(name="parallel_hysteresis.force", typical=45.0, low=0.0, high=500.0),
            *_SLIP,
        ),
        look_alikes=("coulomb_friction", "viscoelastic_creep", "chain_backlash"),
        separating="the muscle alone on a force sensor, without the joint: dry friction of the"
        " joint goes, that of the muscle stays",
        probes=(0.1, 0.5, 2.0),
        path_dependent=True,
    ),
    Effect(
        name="viscoelastic_creep",
        form="one_branch",
        family="creep",
        missing="creep of the muscle under constant pressure",
        equation="F = F_static - k (kappa - kappa_d), kappa_d' = (kappa - kappa_d) / tau",
        parameters=(
            EffectParameter(name="creep.stiffness", typical=2000.0, low=0.0, high=5e4),
            EffectParameter(
                name="creep.relaxation_time",
                typical=1.0,
                low=0.05,
                high=20.0,
                shape=True,
                starts=(0.3, 3.0),
            ),
        ),
        look_alikes=("muscle_hysteresis", "air_leak", "thermal_relaxation"),
        separating="a long hold at constant measured pressure",
        path_dependent=True,
    ),
    Effect(
        name="viscoelastic_creep",
        form="two_branch",
        family="creep",
        missing="creep of the muscle under constant pressure, fast at first and slow later",
        equation="F = F_static - sum k_i (kappa - kappa_i), kappa_i' = (kappa - kappa_i) / tau_i,"
        " i = 1, 2",
        parameters=(
            EffectParameter(name="creep.stiffness", typical=1000.0, low=0.0, high=5e4),
            EffectParameter(name="creep.stiffness_2", typical=1000.0, low=0.0, high=5e4),
            EffectParameter(
                name="creep.relaxation_time",
                typical=0.2,
                low=0.02,
                high=2.0,
                shape=True,
                starts=(0.6,),
            ),
            EffectParameter(
                name="creep.relaxation_time_2",
                typical=2.0,
                low=0.5,
                high=50.0,
                shape=True,
                starts=(8.0,),
            ),
        ),
        look_alikes=("muscle_hysteresis", "air_leak", "thermal_relaxation"),
        separating="a long hold at constant measured pressure",
        path_dependent=True,
    ),
    Effect(
        name="braid_friction",
        family="braid_friction",
        missing="friction in the braid, growing with pressure and with the rate of contraction",
        equation="F = F_static - b p kappa'",
        parameters=(EffectParameter(name="braid.friction", typical=5e-4, low=0.0, high=1e-2),),
        look_alikes=("viscous_friction", "muscle_hysteresis"),
        separating="let the arm swing freely at two common pressures: friction in the braid damps"
        " the more, the higher the pressure",
        path_dependent=True,
        rare=True,
    ),
    Effect(
        name="threshold_pressure",
        family="muscle_force",
        missing="a threshold pressure below which the tube does not press on the braid",
        equation="F = F_active(max(p - p_0, 0), kappa) + F_passive(kappa)",
        parameters=(
            EffectParameter(name="threshold.pressure", typical=1.5e4, low=0.0, high=1.5e5),
        ),
        look_alikes=("chain_compliance", "passive_stiffness", "pressure_bias"),
        separating="inflate from zero at fixed length, with a force sensor",
    ),
    Effect(
        name="passive_stiffness",
        family="muscle_force",
        missing="the stiffness of tube and braid without pressure",
        equation="F = F_active + k/h (exp(h x) - 1), x = kappa_0 - kappa; stretched (x > 0) k x",
        parameters=(
            EffectParameter(
                name="passive.stiffness",
                typical=1.3,
                low=0.3,
                high=3.0,
                neutral=None,
                relative=True,
            ),
        ),
        look_alikes=("chain_compliance", "threshold_pressure", "end_shape"),
        separating="turn the arm by hand without pressure and read the force",
    ),
    Effect(
        name="end_shape",
        family="muscle_force",
        missing="force lost to the tapered ends of a contracted muscle",
        equation="F = F_active (1 - loss x^2 / (x^2 + 0.1^2)) + F_passive, x = max(kappa - onset,"
        " 0)",
        parameters=(
            EffectParameter(
                name="end_shape.loss", typical=0.5, low=0.0, high=1.0, natural_ends=True
            ),
            EffectParameter(
                name="end_shape.onset",
                typical=0.01,
                low=0.0,
                high=0.2,
                shape=True,
                starts=(0.0, 0.03),
            ),
        ),
        look_alikes=("passive_stiffness", "threshold_pressure"),
        separating="isometric force at several lengths from nominal to fully contracted",
        probes=(0.3, 1.0, 1.9),
    ),
    Effect(
        name="muscle_mismatch",
        form="strength",
        family="muscle_mismatch",
        missing="a difference between the two muscles",
        equation="F_2 = scale F(p, kappa) of the second muscle",
        parameters=(_STRENGTH,),
        look_alikes=("angle_bias", "load_torque"),
        separating="raise both pressures together: the arm turns only if the muscles are unequal",
    ),
    Effect(
        name="muscle_mismatch",
        form="strength_and_stroke",
        family="muscle_mismatch",
        missing="a difference between the two muscles, in strength and in stroke",
        equation="F_2 = scale F(p, kappa) of the second muscle, whose d is free: its force falls"
        " with contraction by d p kappa",
        parameters=(
            _STRENGTH,
            EffectParameter(
                name=f"{SECOND_MUSCLE}:force.d",
                unit="N/Pa",
                typical=1e-4,
                low=-6e-3,
                high=6e-3,
                neutral=None,
                another_size=True,
            ),
        ),
        look_alikes=("angle_bias", "load_torque"),
        separating="raise both pressures together at several angles: the torque that they leave"
        " depends on the angle as the muscles' strokes differ",
    ),
)
