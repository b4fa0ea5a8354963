"""Effects on a muscle's static force at lengths and pressures that its force law was not fitted to.

Tables of angles at rest are searched for them. In recordings over time they are parameters of the
force law, close to its scale and its passive spring, and not searched for.
"""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECTS = (
    Effect(
        name="braid_locking",
        family="stretched_braid",
        missing="a braid that locks when it is stretched",
        equation="F = F_active + k x / (1 - (locking x)^2), x = kappa_0 - kappa > 0",
        parameters=(
            EffectParameter(
                name="passive.locking", typical=10.0, low=-120.0, high=120.0, neutral=None
            ),
            EffectParameter(
                name="passive.stiffness", typical=300.0, low=-4e4, high=4e4, neutral=None
            ),
        ),
        look_alikes=("passive_stiffness", "braid_extensibility", "angle_scale"),
        separating="stretch a muscle without pressure beyond its nominal length and read the force",
        in_trials=False,
    ),
    Effect(
        name="braid_extensibility",
        family="pressure_force",
        missing="extension of the fibres, so that pressure lengthens the braid",
        equation="kappa = 1 - l / (l_0 (1 + e p))",
        parameters=(
            EffectParameter(
                name="braid.extensibility", typical=2e-8, low=0.0, high=4e-7, neutral=None
            ),
        ),
        look_alikes=("stretch_weakening", "force_slope"),
        separating="isometric force of a stretched muscle at several pressures: extensible fibres"
        " shift the curve along the length, weaker pressure flattens it",
        in_trials=False,
    ),
    Effect(
        name="stretch_weakening",
        family="pressure_force",
        missing="weaker effect of pressure on a stretched muscle than in the force law",
        equation="F = (a p + b) exp(c kappa) + d p kappa + e p + f, a is free",
        parameters=(
            EffectParameter(
                name="force.a", unit="N/Pa", typical=-1e-4, low=-2e-3, high=2e-3, neutral=None
            ),
        ),
        look_alikes=("braid_extensibility", "force_slope"),
        separating="isometric force of a stretched muscle at several pressures: extensible fibres"
        " shift the curve along the length, weaker pressure flattens it",
        in_trials=False,
    ),
    Effect(
        name="force_slope",
        family="pressure_force",
        missing="a different decrease of force with contraction than in the force law",
        equation="F = (a p + b) exp(c kappa) + d p kappa + e p + f, d is free",
        parameters=(
            EffectParameter(
                name="force.d", unit="N/Pa", typical=2e-3, low=-3e-2, high=3e-2, neutral=None
            ),
        ),
        look_alikes=("stretch_weakening", "braid_extensibility"),
        separating="isometric force at a few pressures, from stretched to contracted",
        in_trials=False,
    ),
    Effect(
        name="rest_length",
        family="muscle_force",
        missing="a different length of the muscles at the reference point",
        equation="l = length_at_zero + tendon length",
        parameters=(
            EffectParameter(
                name="mounting.length_at_zero",
                typical=2e-3,
                low=-0.25,
                high=0.25,
                neutral=None,
                scaled_by="braid.nominal_length",
            ),
        ),
        look_alikes=("passive_stiffness", "angle_scale"),
        separating="measure the muscles' length at equal pressures",
        in_trials=False,
    ),
)
