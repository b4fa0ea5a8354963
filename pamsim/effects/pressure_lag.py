"""A lag of the pressure sensors."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="pressure_lag",
    family="delay",
    layer="measurement",
    missing="a lag of the pressure sensors",
    parameters=(EffectParameter(name="sensor.pressure_lag", typical=0.01, low=0.0, high=0.3),),
    signature="pressures late while the arm is not",
    look_alikes=("line_lag", "valve_delay"),
    separating="fill a rigid volume and compare with a fast sensor",
)
