"""Effects in the chain between muscle and joint: backlash and compliance."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECTS = (
    Effect(
        name="chain_backlash",
        family="backlash",
        missing="backlash between chain and sprocket",
        parameters=(
            EffectParameter(
                name="chain.backlash", typical=3e-4, low=0.0, high=5e-3, starts=(1e-4, 1e-3)
            ),
        ),
        look_alikes=("muscle_hysteresis", "coulomb_friction"),
        separating="small reversals at low stiffness, the angle read on both sides of the chain",
        path_dependent=True,
    ),
    Effect(
        name="chain_compliance",
        family="compliance",
        missing="compliance of the chain and the end fittings",
        parameters=(EffectParameter(name="chain.compliance", typical=1e-6, low=0.0, high=2e-5),),
        look_alikes=("passive_stiffness", "threshold_pressure"),
        separating="lock the arm, change the pressures, and measure the chain's extension",
    ),
)
