"""Effects in the sensors: bias, scale and lag, backlash, two clocks, and channels that are dead."""

from __future__ import annotations

from pamsim.effects.effect import Effect, size

EFFECTS = (
    Effect(
        link="sensor", family="angle_sensor", name="angle_bias",
        missing="an offset of the angle sensor",
        equation="beta_read = beta + bias",
        parameters=(size("sensor.angle_bias", 0.01, -0.2, 0.2),),
        look_alikes=("load_torque", "muscle_mismatch"),
        separating="read the angle at a mechanical stop",
    ),
    Effect(
        link="sensor", family="angle_sensor", name="angle_scale", form="straight",
        missing="a wrong scale of the angle sensor",
        equation="beta_read = scale beta",
        parameters=(size("sensor.angle_scale", 0.03, 0.7, 1.4, neutral=1.0),),
        look_alikes=("thermal_relaxation", "passive_stiffness"),
        separating="read the angle at two known positions",
    ),
    Effect(
        link="sensor", family="angle_sensor", name="angle_scale", form="bent",
        missing="a scale of the angle sensor that is wrong and changes over its range",
        equation="beta_read = (scale + bend beta) beta",
        parameters=(
            size("sensor.angle_scale", 0.03, 0.7, 1.4, neutral=1.0),
            # Of a potentiometer or magnet that is linear to 1 % over half a radian.
            size("sensor.angle_bend", 0.02, -0.5, 0.5, another_size=True),
        ),
        look_alikes=("angle_bias", "passive_stiffness"),
        separating="read the angle at five known positions",
    ),
    Effect(
        link="sensor", family="angle_sensor", name="angle_lag",
        missing="a lag of the angle sensor",
        equation="tau beta_read' = beta - beta_read",
        parameters=(size("sensor.angle_lag", 0.01, 0.0, 0.3),),
        look_alikes=("viscous_friction", "line_lag"),
        separating="tap the arm and compare with a second sensor",
    ),
    Effect(
        link="sensor", family="angle_sensor", name="angle_backlash",
        missing="backlash between the joint and its angle sensor",
        equation="beta_read = play(beta; b / 2)",
        # A coupling or a pair of small gears has some tenths of a degree.
        parameters=(size("sensor.angle_backlash", 5e-3, 0.0, 0.1),),
        look_alikes=("chain_backlash", "coulomb_friction", "angle_lag"),
        separating="turn the joint to and fro by hand, without pressure, with a second sensor on"
        " it: the reading stays behind at each reversal, by the same angle at any load",
        probes=(0.1, 0.5, 2.0), path_dependent=True, rare=True,
    ),
    Effect(
        link="sensor", family="angle_sensor", name="dead_angle",
        missing="an angle channel that stands still, all the time or from some moment on",
        equation="beta_read(t) = beta(min(t, (1 - share) T)) in a recording of length T",
        # Any share may be dead. It may be sought from half of it: at 1 no signal is left.
        parameters=(size("sensor.angle_dead_share", 0.5, 0.0, 1.0, natural_ends=True),),
        look_alikes=("angle_scale", "coulomb_friction", "angle_backlash"),
        separating="turn the arm by hand and watch the reading",
        path_dependent=True, rare=True,
    ),
    Effect(
        link="sensor", family="clock", name="clock_offset",
        missing="a constant offset between the clocks of the angle's and the pressures' logs",
        equation="beta_read(t) = beta(t - offset)",
        # A sample of a log at 100 Hz; loggers that are started by hand are off by more.
        parameters=(size("sensor.clock_offset", 0.01, -0.2, 0.2),),
        look_alikes=("angle_lag", "valve_delay", "line_lag"),
        separating="knock on the arm: pressures and angle jump at one instant",
        path_dependent=True, rare=True,
    ),
    Effect(
        link="sensor", family="pressure_sensor", name="pressure_bias",
        missing="an offset of the pressure sensors",
        equation="p_read = p + bias",
        parameters=(size("sensor.pressure_bias", 3e3, -5e4, 5e4),),
        look_alikes=("air_leak", "pressure_scale"),
        separating="vent to the atmosphere and read the sensors",
    ),
    Effect(
        link="sensor", family="pressure_sensor", name="pressure_scale", form="straight",
        missing="a wrong scale of the pressure sensors",
        equation="p_read = scale p",
        parameters=(size("sensor.pressure_scale", 0.02, 0.7, 1.4, neutral=1.0),),
        look_alikes=("air_leak", "pressure_bias", "supply_sag"),
        separating="compare with a reference gauge at two pressures",
    ),
    Effect(
        link="sensor", family="pressure_sensor", name="pressure_scale", form="bent",
        missing="a scale of the pressure sensors that is wrong and changes over their range",
        equation="p_read = (scale + bend p) p",
        parameters=(
            size("sensor.pressure_scale", 0.02, 0.7, 1.4, neutral=1.0),
            # Linear to 0.5 % of 5 bar, as cheap transducers are.
            size("sensor.pressure_bend", 1e-8, -4e-7, 4e-7, another_size=True),
        ),
        look_alikes=("air_leak", "pressure_bias", "supply_sag"),
        separating="compare with a reference gauge at five pressures",
    ),
    Effect(
        link="sensor", family="pressure_sensor", name="pressure_lag",
        missing="a lag of the pressure sensors",
        equation="tau p_read' = p - p_read",
        parameters=(size("sensor.pressure_lag", 0.01, 0.0, 0.3),),
        look_alikes=("line_lag", "valve_delay"),
        separating="fill a rigid volume and compare with a fast sensor",
    ),
    Effect(
        link="sensor", family="pressure_sensor", name="dead_pressure",
        missing="pressure channels that stand still, all the time or from some moment on",
        equation="p_read(t) = p(min(t, (1 - share) T)) in a recording of length T",
        parameters=(size("sensor.pressure_dead_share", 0.5, 0.0, 1.0, natural_ends=True),),
        look_alikes=("pressure_scale", "regulator_dead_band", "pressure_lag"),
        separating="change the pressure by hand and watch the readings",
        path_dependent=True, rare=True,
    ),
)  # fmt: skip
