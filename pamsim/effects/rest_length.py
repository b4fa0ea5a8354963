"""The length of the muscles at the reference point."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="rest_length",
    family="muscle_force",
    layer="muscle",
    missing="another length of the muscles at the reference point",
    parameters=(
        EffectParameter(
            name="mounting.length_at_zero", typical=5e-4, low=-0.015, high=0.015, neutral=None
        ),
    ),
    signature="angle off at every step, by more the larger it is",
    look_alikes=("passive_stiffness", "angle_scale"),
    separating="measure the muscles' length at equal pressures",
)
