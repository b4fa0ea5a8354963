"""Creep of the muscle under constant pressure."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="viscoelastic_creep",
    family="creep",
    layer="muscle",
    missing="creep of the muscle under constant pressure",
    parameters=(
        EffectParameter(name="creep.stiffness", typical=2000.0, low=0.0, high=5e4),
        EffectParameter(
            name="creep.relaxation_time",
            typical=1.0,
            low=0.05,
            high=20.0,
            shape=True,
            starts=(0.3, 3.0),
        ),
    ),
    signature="the arm goes on moving in holds; loops are widest at one rate",
    look_alikes=("muscle_hysteresis", "air_leak", "thermal_relaxation"),
    separating="a long hold at constant measured pressure",
)
