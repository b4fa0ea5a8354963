"""Effects in the muscle: hysteresis, creep, passive and active force."""

from __future__ import annotations

from pamsim.effects.effect import SECOND_MUSCLE, Effect, change, factor, shape, size

_WIDTH = change("hysteresis.force_per_pressure", 1.5e-4, 0.0, 2e-3)

_YIELD = shape(
    "hysteresis.yield_contraction", 2.5e-3, 6e-4, 3e-2, starts=(1.2e-3, 8e-3), neutral=None
)

_CHORD = shape("hysteresis.chord", 20.0, 0.0, 200.0, starts=(1.0,), neutral=None)
"""Most force laws were fitted to the mean of the branches, some to one of them."""

_SLIP = (
    shape("parallel_hysteresis.full_slip", 0.01, 1e-3, 0.06, starts=(0.004, 0.025)),
    shape("parallel_hysteresis.decay", 1.0, 0.6, 1.6),
    shape("parallel_hysteresis.chord", 20.0, 0.0, 200.0, starts=(1.0,)),
)

_SCALE = factor(f"{SECOND_MUSCLE}:force.scale", 1.04, 0.7, 1.4)

EFFECTS = (
    Effect(
        link="muscle", family="muscle_hysteresis", name="muscle_hysteresis", form="bouc_wen",
        missing="rate-independent hysteresis of the muscle, growing with pressure",
        equation="F = F_static - h p z, z' = kappa'/D (1 - |z|^n (sigma sign(z kappa') + 1 -"
        " sigma))",
        parameters=(_WIDTH,),
        look_alikes=("coulomb_friction", "viscoelastic_creep", "chain_backlash"),
        separating="equal loops at two common pressures: hysteresis grows with pressure, dry"
        " friction does not",
        probes=(0.1, 0.5, 2.0), path_dependent=True,
    ),
    Effect(
        link="muscle", family="muscle_hysteresis", name="muscle_hysteresis", form="free_shape",
        missing="rate-independent hysteresis of the muscle, growing with pressure, that yields"
        " within a fitted contraction",
        equation="F = F_static - h p (z - c kappa), z' = kappa'/D (1 - |z|^n (sigma sign(z kappa')"
        " + 1 - sigma))",
        parameters=(_WIDTH, _YIELD, _CHORD),
        look_alikes=("coulomb_friction", "viscoelastic_creep", "chain_backlash"),
        separating="loops of different size: in small ones the muscle is stiffer, and the size at"
        " which it yields is the hysteresis's own",
        probes=(0.1, 0.5, 2.0), path_dependent=True,
    ),
    Effect(
        link="muscle", family="muscle_hysteresis", name="muscle_hysteresis", form="maxwell_slip",
        missing="rate-independent hysteresis of the muscle, growing with pressure, with"
        " return-point memory",
        equation="F = F_static - h p (w - c kappa), w = sum share_k (kappa - play(kappa; Delta_k))"
        " / Delta_k, beside the rig's own",
        parameters=(size("parallel_hysteresis.force_per_pressure", 1.5e-4, 0.0, 2e-3), *_SLIP),
        look_alikes=("coulomb_friction", "viscoelastic_creep", "chain_backlash"),
        separating="a small loop within a large one: with return-point memory it closes",
        probes=(0.1, 0.5, 2.0), path_dependent=True,
    ),
    Effect(
        link="muscle", family="muscle_hysteresis", name="muscle_hysteresis", form="constant",
        missing="rate-independent hysteresis of the muscle, the same at every pressure",
        equation="F = F_static - H (w - c kappa), w = sum share_k (kappa - play(kappa; Delta_k))"
        " / Delta_k, beside the rig's own",
        parameters=(size("parallel_hysteresis.force", 45.0, 0.0, 500.0), *_SLIP),
        look_alikes=("coulomb_friction", "viscoelastic_creep", "chain_backlash"),
        separating="the muscle alone on a force sensor, without the joint: dry friction of the"
        " joint goes, that of the muscle stays",
        probes=(0.1, 0.5, 2.0), path_dependent=True,
    ),
    Effect(
        link="muscle", family="muscle_hysteresis", name="muscle_hysteresis", form="asymmetric",
        missing="rate-independent hysteresis of the muscle, growing with pressure, that is wider to"
        " one side, with a dead zone",
        equation="F = F_static - h p (w - c kappa), w = sum share_k s(e_k), e_k = (kappa -"
        " play(kappa; Delta_k)) / Delta_k, s(e) = (1 + a sign(e)) max(|e| - r, 0) / (1 - r), beside"
        " the rig's own",
        parameters=(
            size("parallel_hysteresis.force_per_pressure", 1.5e-4, 0.0, 2e-3),
            *_SLIP,
            # Both sides as wide, or the one three times the other.
            shape("parallel_hysteresis.asymmetry", 0.5, -0.9, 0.9, starts=(-0.5, 0.0)),
            shape("parallel_hysteresis.dead_zone", 0.3, 0.0, 0.9, starts=(0.0,)),
        ),
        look_alikes=("coulomb_friction", "chain_backlash", "muscle_mismatch"),
        separating="a loop of the muscle alone, its length imposed at one pressure: its branches"
        " are not each other's mirror image",
        probes=(0.1, 0.5, 2.0), path_dependent=True, rare=True,
    ),
    Effect(
        link="muscle", family="creep", name="viscoelastic_creep", form="one_branch",
        missing="creep of the muscle under constant pressure",
        equation="F = F_static - k (kappa - kappa_d), kappa_d' = (kappa - kappa_d) / tau",
        parameters=(
            size("creep.stiffness", 2000.0, 0.0, 5e4),
            shape("creep.relaxation_time", 1.0, 0.05, 20.0, starts=(0.3, 3.0)),
        ),
        look_alikes=("muscle_hysteresis", "air_leak", "thermal_relaxation"),
        separating="a long hold at constant measured pressure",
        path_dependent=True,
    ),
    Effect(
        link="muscle", family="creep", name="viscoelastic_creep", form="two_branch",
        missing="creep of the muscle under constant pressure, fast at first and slow later",
        equation="F = F_static - sum k_i (kappa - kappa_i), kappa_i' = (kappa - kappa_i) / tau_i,"
        " i = 1, 2",
        parameters=(
            size("creep.stiffness", 1000.0, 0.0, 5e4),
            size("creep.stiffness_2", 1000.0, 0.0, 5e4),
            shape("creep.relaxation_time", 0.2, 0.02, 2.0, starts=(0.6,)),
            shape("creep.relaxation_time_2", 2.0, 0.5, 50.0, starts=(8.0,)),
        ),
        look_alikes=("muscle_hysteresis", "air_leak", "thermal_relaxation"),
        separating="a long hold at constant measured pressure",
        path_dependent=True,
    ),
    Effect(
        link="muscle", family="first_stroke", name="first_stroke",
        missing="force that is lost in the first stroke after a rest, and not in later ones",
        equation="F = F_static - F_1 clip(1 + (kappa - kappa_m) / d, 0, 1), kappa_m the furthest"
        " kappa so far",
        parameters=(
            # A third of what `muscle_hysteresis` takes at 3 bar.
            size("first_stroke.force", 15.0, 0.0, 300.0),
            shape("first_stroke.travel", 5e-3, 1e-3, 5e-2, starts=(2e-3, 0.015)),
        ),
        look_alikes=("muscle_hysteresis", "viscoelastic_creep", "coulomb_friction"),
        separating="equal strokes one after the other, from a rest of hours: the first loop is"
        " wider, the others are equal",
        probes=(0.1, 0.5, 2.0), path_dependent=True, rare=True,
    ),
    Effect(
        link="muscle", family="softening", name="softening",
        missing="force that the muscle loses while it works, as it warms or ages",
        equation="F = F_static (1 - c w), w' = (1 - w) / tau, w = 0 after a rest",
        parameters=(
            size("softening.share", 0.05, -0.5, 0.5),
            shape("softening.time", 4.0, 0.3, 1000.0, starts=(1.0, 20.0)),
        ),
        look_alikes=("viscoelastic_creep", "air_leak", "passive_stiffness"),
        separating="the same cycle many times after a rest: the force falls from cycle to"
        " cycle, whichever way the muscle moves",
        path_dependent=True, rare=True,
    ),
    Effect(
        link="muscle", family="braid_friction", name="braid_friction",
        missing="friction in the braid, growing with pressure and with the rate of contraction",
        equation="F = F_static - b p kappa'",
        parameters=(size("braid.friction", 5e-4, 0.0, 1e-2),),
        look_alikes=("viscous_friction", "muscle_hysteresis"),
        separating="let the arm swing freely at two common pressures: friction in the braid damps"
        " more at higher pressure",
        path_dependent=True, rare=True,
    ),
    Effect(
        link="muscle", family="muscle_force", name="threshold_pressure", form="sharp",
        missing="a threshold pressure below which the tube does not press on the braid",
        equation="F = F_active(max(p - p_0, 0), kappa) + F_passive(kappa)",
        parameters=(size("threshold.pressure", 1.5e4, 0.0, 1.5e5),),
        look_alikes=("chain_compliance", "passive_stiffness", "pressure_bias"),
        separating="inflate from zero at fixed length, with a force sensor",
    ),
    Effect(
        link="muscle", family="muscle_force", name="threshold_pressure", form="gradual",
        missing="pressure that is gradually lost before the tube presses on the braid",
        equation="F = F_active(max(p - p_0 p / (p + w), 0), kappa) + F_passive(kappa)",
        parameters=(
            size("threshold.pressure", 3e4, 0.0, 3e5),
            # From nearly at once to over most of a muscle's pressures.
            shape("threshold.width", 5e4, 5e3, 5e5, starts=(2e4, 1.5e5)),
        ),
        look_alikes=("chain_compliance", "passive_stiffness", "pressure_bias"),
        separating="inflate from zero at fixed length, with a force sensor",
    ),
    Effect(
        link="muscle", family="muscle_force", name="passive_stiffness", form="softening",
        missing="the stiffness of tube and braid without pressure",
        equation="F = F_active + k/h (exp(h x) - 1), x = kappa_0 - kappa; stretched (x > 0) k x",
        parameters=(factor("passive.stiffness", 1.3, 0.3, 3.0),),
        look_alikes=("chain_compliance", "threshold_pressure", "end_shape"),
        separating="turn the arm by hand without pressure and read the force",
    ),
    Effect(
        link="muscle", family="muscle_force", name="passive_stiffness", form="hardening",
        missing="a stiffness of tube and braid that does not soften, and may harden",
        equation="F = F_active + F_passive + K x (1 + (x/x_h)^2), x = kappa_0 - kappa",
        parameters=(
            # A third of the passive stiffness of a MAS-20.
            change("passive.parallel", 2000.0, -4e4, 4e4),
            # Twice as strong at 2 % stretch; from a straight line on.
            shape("passive.hardening", 50.0, 0.0, 200.0, starts=(10.0, 25.0)),
        ),
        look_alikes=("chain_compliance", "threshold_pressure", "end_shape"),
        separating="turn the arm by hand without pressure and read the force",
    ),
    Effect(
        link="muscle", family="muscle_force", name="end_shape",
        missing="force lost to the tapered ends of a contracted muscle",
        equation="F = F_active (1 - loss x^2 / (x^2 + 0.1^2)) + F_passive, x = max(kappa - onset,"
        " 0)",
        parameters=(
            size("end_shape.loss", 0.5, 0.0, 1.0, natural_ends=True),
            shape("end_shape.onset", 0.01, 0.0, 0.2, starts=(0.0, 0.03)),
        ),
        look_alikes=("passive_stiffness", "threshold_pressure"),
        separating="isometric force at several lengths from nominal to fully contracted",
        probes=(0.3, 1.0, 1.9),
    ),
    Effect(
        link="muscle", family="muscle_mismatch", name="muscle_mismatch", form="strength",
        missing="a difference between the two muscles",
        equation="F_2 = scale F(p, kappa) of the second muscle",
        parameters=(_SCALE,),
        look_alikes=("angle_bias", "load_torque"),
        separating="raise both pressures together: the arm turns only if the muscles are unequal",
    ),
    Effect(
        link="muscle", family="muscle_mismatch", name="muscle_mismatch", form="strength_and_stroke",
        missing="a difference between the two muscles, in strength and in stroke",
        equation="F_2 = scale F(p, kappa) of the second muscle, whose d is free: its force falls"
        " with contraction by d p kappa",
        parameters=(
            _SCALE,
            change(f"{SECOND_MUSCLE}:force.d", 1e-4, -6e-3, 6e-3, unit="N/Pa", another_size=True),
        ),
        look_alikes=("angle_bias", "load_torque"),
        separating="raise both pressures together at several angles: if the strokes differ, the"
        " remaining torque depends on the angle",
    ),
)  # fmt: skip
