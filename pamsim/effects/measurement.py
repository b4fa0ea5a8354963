"""Effects in the sensors: bias, scale and lag of angle and pressure."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECTS = (
    Effect(
        name="angle_bias",
        family="angle_sensor",
        missing="an offset of the angle sensor",
        equation="beta_read = beta + bias",
        parameters=(EffectParameter(name="sensor.angle_bias", typical=0.01, low=-0.2, high=0.2),),
        look_alikes=("load_torque", "muscle_mismatch"),
        separating="read the angle at a mechanical stop",
    ),
    Effect(
        name="angle_scale",
        family="angle_sensor",
        missing="a wrong scale of the angle sensor",
        equation="beta_read = scale beta",
        parameters=(
            EffectParameter(
                name="sensor.angle_scale", typical=0.03, low=0.7, high=1.4, neutral=1.0
            ),
        ),
        look_alikes=("thermal_relaxation", "passive_stiffness"),
        separating="read the angle at two known positions",
    ),
    Effect(
        name="angle_lag",
        family="angle_sensor",
        missing="a lag of the angle sensor",
        equation="tau beta_read' = beta - beta_read",
        parameters=(EffectParameter(name="sensor.angle_lag", typical=0.01, low=0.0, high=0.3),),
        look_alikes=("viscous_friction", "line_lag"),
        separating="tap the arm and compare with a second sensor",
    ),
    Effect(
        name="pressure_bias",
        family="pressure_sensor",
        missing="an offset of the pressure sensors",
        equation="p_read = p + bias",
        parameters=(EffectParameter(name="sensor.pressure_bias", typical=3e3, low=-5e4, high=5e4),),
        look_alikes=("air_leak", "pressure_scale"),
        separating="vent to the atmosphere and read the sensors",
    ),
    Effect(
        name="pressure_scale",
        family="pressure_sensor",
        missing="a wrong scale of the pressure sensors",
        equation="p_read = scale p",
        parameters=(
            EffectParameter(
                name="sensor.pressure_scale", typical=0.02, low=0.7, high=1.4, neutral=1.0
            ),
        ),
        look_alikes=("air_leak", "pressure_bias", "supply_sag"),
        separating="compare with a reference gauge at two pressures",
    ),
    Effect(
        name="pressure_lag",
        family="pressure_sensor",
        missing="a lag of the pressure sensors",
        equation="tau p_read' = p - p_read",
        parameters=(EffectParameter(name="sensor.pressure_lag", typical=0.01, low=0.0, high=0.3),),
        look_alikes=("line_lag", "valve_delay"),
        separating="fill a rigid volume and compare with a fast sensor",
    ),
)
