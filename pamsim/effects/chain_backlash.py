"""Play between chain and sprocket."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="chain_backlash",
    family="backlash",
    layer="transmission",
    missing="play between chain and sprocket",
    parameters=(
        EffectParameter(
            name="chain.backlash", typical=3e-4, low=0.0, high=5e-3, starts=(1e-4, 1e-3)
        ),
    ),
    signature="a flat spot wherever the torque on the arm changes its sign, as wide at every"
    " pressure",
    look_alikes=("muscle_hysteresis", "coulomb_friction"),
    separating="small reversals at low stiffness, with the angle read on both sides of the chain",
)
