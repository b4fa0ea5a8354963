"""Rate-independent hysteresis of the muscle, growing with pressure."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="muscle_hysteresis",
    family="muscle_hysteresis",
    layer="muscle",
    missing="rate-independent hysteresis of the muscle, growing with pressure",
    parameters=(
        EffectParameter(
            name="hysteresis.force_per_pressure", typical=1.5e-4, low=0.0, high=2e-3, neutral=None
        ),
    ),
    signature="loops as wide at every rate, wider at higher pressure, with minor loops inside",
    look_alikes=("coulomb_friction", "viscoelastic_creep", "chain_backlash"),
    separating="equal loops at two common pressures: hysteresis grows with pressure, dry friction"
    " does not",
    probes=(0.1, 0.5, 2.0),
)
