"""Effects on a muscle's static force at lengths and pressures that its force law was not fitted to.

Tables of angles at rest are searched for them. In recordings over time they are parameters of the
force law, close to its scale and its passive spring, and not searched for.
"""

from __future__ import annotations

from pamsim.effects.effect import Effect, change

EFFECTS = (
    Effect(
        link="muscle", family="stretched_braid", name="braid_locking",
        missing="a braid that locks when it is stretched",
        equation="F = F_active + k x / (1 - (locking x)^2), x = kappa_0 - kappa > 0",
        parameters=(
            change("passive.locking", 10.0, -120.0, 120.0),
            change("passive.stiffness", 300.0, -4e4, 4e4),
        ),
        look_alikes=("passive_stiffness", "braid_extensibility", "angle_scale"),
        separating="stretch a muscle without pressure beyond its nominal length and read the force",
        in_trials=False,
    ),
    Effect(
        link="muscle", family="pressure_force", name="braid_extensibility",
        missing="extension of the fibres, so that pressure lengthens the braid",
        equation="kappa = 1 - l / (l_0 (1 + e p))",
        parameters=(change("braid.extensibility", 2e-8, 0.0, 4e-7),),
        look_alikes=("stretch_weakening", "force_slope"),
        separating="isometric force of a stretched muscle at several pressures: extensible fibres"
        " shift the curve along the length, weaker pressure flattens it",
        in_trials=False,
    ),
    Effect(
        link="muscle", family="pressure_force", name="stretch_weakening",
        missing="weaker effect of pressure on a stretched muscle than in the force law",
        equation="F = (a p + b) exp(c kappa) + d p kappa + e p + f, a is free",
        parameters=(change("force.a", -1e-4, -2e-3, 2e-3, unit="N/Pa"),),
        look_alikes=("braid_extensibility", "force_slope"),
        separating="isometric force of a stretched muscle at several pressures: extensible fibres"
        " shift the curve along the length, weaker pressure flattens it",
        in_trials=False,
    ),
    Effect(
        link="muscle", family="pressure_force", name="force_slope",
        missing="a different decrease of force with contraction than in the force law",
        equation="F = (a p + b) exp(c kappa) + d p kappa + e p + f, d is free",
        parameters=(change("force.d", 2e-3, -3e-2, 3e-2, unit="N/Pa"),),
        look_alikes=("stretch_weakening", "braid_extensibility"),
        separating="isometric force at a few pressures, from stretched to contracted",
        in_trials=False,
    ),
    Effect(
        link="muscle", family="muscle_force", name="rest_length",
        missing="a different length of the muscles at the reference point",
        equation="l = length_at_zero + tendon length",
        parameters=(
            change("mounting.length_at_zero", 2e-3, -0.25, 0.25, scaled_by="braid.nominal_length"),
        ),
        look_alikes=("passive_stiffness", "angle_scale"),
        separating="measure the muscles' length at equal pressures",
        in_trials=False,
    ),
)  # fmt: skip
