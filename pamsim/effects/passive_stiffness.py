"""The stiffness of tube and braid without pressure."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="passive_stiffness",
    family="muscle_force",
    layer="muscle",
    missing="the stiffness of tube and braid without pressure",
    parameters=(
        EffectParameter(
            name="passive.stiffness", typical=1.3, low=0.3, high=3.0, neutral=None, relative=True
        ),
    ),
    signature="angle off in proportion to the stretch, at every pressure alike",
    look_alikes=("chain_compliance", "threshold_pressure", "end_shape"),
    separating="turn the arm by hand without pressure and read the force",
)
