"""Give of the chain and the end fittings."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="chain_compliance",
    family="compliance",
    layer="transmission",
    missing="give of the chain and the end fittings",
    parameters=(EffectParameter(name="chain.compliance", typical=1e-6, low=0.0, high=2e-5),),
    signature="angle and stiffness off in proportion to the tension",
    look_alikes=("passive_stiffness", "threshold_pressure"),
    separating="hold the arm fast, change the pressures, and measure the chain's extension",
)
