"""A braid whose fibres meet when the muscle is stretched."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="braid_locking",
    family="stretched_braid",
    layer="muscle",
    missing="a braid that locks when it is stretched",
    parameters=(
        EffectParameter(name="passive.locking", typical=10.0, low=-120.0, high=120.0, neutral=None),
        EffectParameter(name="passive.stiffness", typical=300.0, low=-4e4, high=4e4, neutral=None),
    ),
    signature="the angle falls short at large steps and is right at small ones, whatever the"
    " common pressure",
    look_alikes=("passive_stiffness", "braid_extensibility", "angle_scale"),
    separating="stretch a muscle without pressure beyond its nominal length and read the force",
)
