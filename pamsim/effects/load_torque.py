"""A torque of gravity or payload on the arm."""

from __future__ import annotations

from pamsim.effects.effect import TILTED, Effect, EffectParameter

EFFECT = Effect(
    name="load_torque",
    family="offset",
    layer="joint",
    missing="a torque of gravity or payload on the arm",
    parameters=(
        EffectParameter(name=f"body.{TILTED}.tilt", typical=0.03, low=-0.3, high=0.3, neutral=None),
    ),
    signature="angle off by more where both pressures, and so the stiffness, are low; grows with"
    " the load",
    look_alikes=("angle_bias", "muscle_mismatch"),
    separating="add a known mass: a wrong torque grows with it, a wrong angle reading does not",
)
