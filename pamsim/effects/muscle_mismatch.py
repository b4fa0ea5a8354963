"""A difference between the two muscles."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="muscle_mismatch",
    family="offset",
    layer="muscle",
    missing="a difference between the two muscles",
    parameters=(
        EffectParameter(
            name="muscle_2:force.scale",
            typical=1.04,
            low=0.7,
            high=1.4,
            neutral=None,
            relative=True,
        ),
    ),
    signature="angle off by more as both pressures rise together",
    look_alikes=("angle_bias", "load_torque"),
    separating="raise both pressures together: only unequal muscles turn the arm",
)
