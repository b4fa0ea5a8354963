"""Effects in the air: leaks, supply, valves, heat."""

from __future__ import annotations

from pamsim.effects.effect import SECOND_MUSCLE, Effect, change, factor, shape, size

_SUPPLY_RESISTANCE = size("valve.supply_resistance", 2e8, 0.0, 5e9)

_FLOW_FACTORS = tuple(
    factor(f"valve.conductance_{way}", 0.8, 0.2, 5.0) for way in ("fill", "exhaust")
)

_SUPPLY_VOLUME = shape("valve.supply_volume", 1e-4, 0.0, 1e-2, starts=(1e-5, 1e-3))

# Limited to [1, 1.4]: isothermal to adiabatic air.
_INDEX = change("chamber.polytropic_index", 0.15, -0.4, 0.4, natural_ends=True)

EFFECTS = (
    Effect(
        link="air", family="leak", name="air_leak", form="orifice",
        missing="a leak of air from the muscles",
        equation="mdot = -C rho_0 P phi(P_a / P) sqrt(T_0 / T)",
        parameters=(size("chamber.leak_conductance", 2e-12, 0.0, 1e-10),),
        look_alikes=("pressure_scale", "pressure_bias", "supply_sag"),
        separating="shut the valves at a high pressure and watch the pressure for some seconds",
        upstream_of_pressure=True,
    ),
    Effect(
        link="air", family="leak", name="air_leak", form="laminar",
        missing="a leak of air from the muscles through a narrow gap",
        equation="mdot = -g (P^2 - P_a^2) / (2 R T)",
        parameters=(size("chamber.laminar_leak_conductance", 1e-12, 0.0, 5e-11),),
        look_alikes=("pressure_scale", "pressure_bias", "supply_sag"),
        separating="shut the valves at a high and at a low pressure and watch the pressures for"
        " some seconds: at low pressure a narrow gap leaks less than an orifice",
        upstream_of_pressure=True,
    ),
    Effect(
        link="air", family="leak_between", name="leak_between_muscles",
        missing="a leak of air between the two muscles of a chain, as through the spool of their"
        " valves",
        equation="mdot_1 = g (P_2^2 - P_1^2) / (2 R T) = -mdot_2",
        # As `air_leak:laminar`, whose gap it has.
        parameters=(size("chamber.cross_leak_conductance", 1e-12, 0.0, 5e-11),),
        look_alikes=("air_leak", "pressure_scale", "thermal_relaxation"),
        separating="shut the valves at two different pressures and watch both for some seconds:"
        " what one muscle loses the other gains",
        upstream_of_pressure=True, rare=True,
    ),
    Effect(
        link="supply", family="supply", name="supply_sag", form="resistance",
        missing="a supply whose pressure falls with the flow that the muscles draw from it",
        equation="P_line = P_supply - R_s (mdot_1 + mdot_2 + ...)",
        parameters=(_SUPPLY_RESISTANCE,),
        look_alikes=("valve_flow", "air_leak"),
        separating="a gauge on the supply while a muscle is filled from empty",
        probes=(0.1, 0.5, 2.0), upstream_of_pressure=True,
    ),
    Effect(
        link="supply", family="supply", name="supply_sag", form="reservoir",
        missing="a supply whose reservoir is drawn down by the muscles and refilled slowly",
        equation="V_s / (R T) P_line' = (P_supply - P_line) / R_s - (mdot_1 + mdot_2 + ...)",
        parameters=(_SUPPLY_RESISTANCE, _SUPPLY_VOLUME),
        look_alikes=("valve_flow", "air_leak"),
        separating="a gauge on the supply while a muscle is filled from empty, and afterwards",
        upstream_of_pressure=True,
    ),
    Effect(
        link="supply", family="supply", name="supply_sag", form="turbulent_reservoir",
        missing="a supply whose reservoir is drawn down by the muscles and refilled slowly, through"
        " turbulent fittings",
        equation="V_s / (R T) P_line' = sqrt((P_supply - P_line) / S_s) - (mdot_1 + mdot_2 + ...)",
        parameters=(size("valve.supply_square", 1e12, 0.0, 2.5e13), _SUPPLY_VOLUME),
        look_alikes=("valve_flow", "air_leak"),
        separating="a gauge on the supply while a muscle is filled from empty, and afterwards",
        upstream_of_pressure=True,
    ),
    Effect(
        link="air", family="valve", name="valve_dead_zone", form="symmetric",
        missing="a dead zone of the valves",
        equation="u_open = sign(u) max(|u| - u_0, 0) / (1 - u_0)",
        parameters=(size("valve.dead_zone", 0.05, 0.0, 0.5),),
        look_alikes=("coulomb_friction", "valve_flow"),
        separating="increase the valve opening in small steps from shut",
        probes=(0.1, 0.5, 2.0), upstream_of_pressure=True,
    ),
    Effect(
        link="air", family="valve", name="valve_dead_zone", form="asymmetric",
        missing="a dead zone of the valves that differs from fill to exhaust",
        equation="u_open = sign(u) max(|u| - u_i, 0) / (1 - u_i), u_i = (1 + a) u_0 to fill, (1 -"
        " a) u_0 to exhaust",
        parameters=(
            size("valve.dead_zone", 0.05, 0.0, 0.5),
            shape(
                "valve.dead_zone_asymmetry", 0.0, -1.0, 1.0, starts=(-0.6, 0.6), natural_ends=True
            ),
        ),
        look_alikes=("coulomb_friction", "valve_flow"),
        separating="open each valve in small steps from shut",
        probes=(0.1, 0.5, 2.0), upstream_of_pressure=True,
    ),
    Effect(
        link="air", family="valve", name="valve_hysteresis",
        missing="valves that stick at a reversal until their command has gone back some way",
        equation="u_valve = play(u; h / 2)",
        # Data sheets of proportional valves state 0.4 % (spools) to 10 % (solenoids).
        parameters=(size("valve.hysteresis", 0.02, 0.0, 0.3),),
        look_alikes=("valve_dead_zone", "valve_slew", "coulomb_friction"),
        separating="open a valve in small steps from shut and back, and compare the flow at equal"
        " commands",
        probes=(0.1, 0.5, 2.0), upstream_of_pressure=True, rare=True,
    ),
    Effect(
        link="air", family="regulator", name="regulator_dead_band",
        missing="a dead band of the pressure regulators, which leave small errors alone",
        equation="u = clip((e -+ d) / B) for |e| > d, else 0, with e = p_set - p",
        # Data sheets of electronic regulators state 0.2 to 1 % of 10 bar.
        parameters=(size("valve.regulator_dead_band", 2e3, 0.0, 5e4),),
        look_alikes=("valve_dead_zone", "pressure_bias", "coulomb_friction"),
        separating="a set point that moves slowly to and fro: the pressure follows in steps",
        probes=(0.1, 0.5, 2.0), upstream_of_pressure=True, rare=True,
    ),
    Effect(
        link="air", family="regulator", name="least_set_point",
        missing="a least pressure that the regulators keep where less is commanded",
        equation="p_set = max(p_set, p_least)",
        # Data sheets of regulators for 5 to 10 bar begin at 5 to 50 kPa.
        parameters=(size("valve.least_set_point", 2e4, 0.0, 1.5e5),),
        look_alikes=("threshold_pressure", "pressure_bias", "valve_dead_zone"),
        separating="set points that fall step by step to 0, and a gauge",
        probes=(0.3, 1.2, 5.0), upstream_of_pressure=True, rare=True,
    ),
    Effect(
        link="air", family="valve", name="valve_flow", form="conductances",
        missing="a different flow through the valves",
        equation="mdot = u C_fill rho_0 P_s phi(P / P_s) sqrt(T_0 / T), or u C_exhaust rho_0 P"
        " phi(P_a / P) sqrt(T_0 / T)",
        parameters=_FLOW_FACTORS,
        look_alikes=("supply_sag", "line_lag", "thermal_relaxation"),
        separating="fill from empty and vent from full with a valve wide open",
        upstream_of_pressure=True,
    ),
    Effect(
        link="air", family="valve", name="valve_flow", form="critical_ratio",
        missing="a different flow through the valves, choked up to another pressure ratio",
        equation="mdot = u C_fill rho_0 P_s phi(P / P_s) sqrt(T_0 / T), or u C_exhaust rho_0 P"
        " phi(P_a / P) sqrt(T_0 / T), with phi choked up to the critical ratio b",
        parameters=(
            *_FLOW_FACTORS,
            change("valve.critical_ratio", 0.2, -0.3, 0.4, another_size=True),
        ),
        look_alikes=("supply_sag", "line_lag", "thermal_relaxation"),
        separating="fill from empty and vent from full with a valve wide open: the flow falls off"
        " where the pressures come within the critical ratio",
        upstream_of_pressure=True,
    ),
    Effect(
        link="air", family="valve", name="valve_asymmetry",
        missing="another ratio between the flows of the fill and the exhaust valve",
        equation="mdot = u C_exhaust rho_0 P phi(P_a / P) sqrt(T_0 / T) while it exhausts",
        parameters=(factor("valve.conductance_exhaust", 0.85, 0.2, 5.0),),
        look_alikes=("valve_flow", "air_leak", "supply_sag"),
        separating="fill from empty and vent from full with a valve wide open, and compare the two",
        upstream_of_pressure=True, rare=True,
    ),
    Effect(
        link="air", family="valve", name="valve_mismatch",
        missing="another flow through the valves of one muscle than through the others'",
        equation="mdot of the second muscle's valves, with a C_fill and a C_exhaust of its own",
        parameters=(
            factor(f"{SECOND_MUSCLE}:valve.conductance_fill", 0.8, 0.1, 5.0),
            factor(f"{SECOND_MUSCLE}:valve.conductance_exhaust", 1.0, 0.1, 5.0),
        ),
        look_alikes=("valve_flow", "supply_sag", "valve_asymmetry"),
        separating="fill and vent one muscle after the other with its valves wide open",
        upstream_of_pressure=True, rare=True,
    ),
    Effect(
        link="air", family="tube_resistance", name="tube_resistance", form="laminar",
        missing="the resistance of the tube between the valves with their sensor and the muscle",
        equation="V / (R T) P_valve' = mdot - (P_valve - P) / R_tube",
        parameters=(
            size("valve.tube_resistance", 1e8, 0.0, 5e9),
            shape("valve.tube_volume", 1e-5, 4e-6, 1e-4, starts=(3e-5,)),
        ),
        look_alikes=("pressure_lag", "valve_flow", "supply_sag"),
        separating="a second pressure sensor at the muscle while it is filled from empty",
        probes=(0.1, 0.5, 2.0), upstream_of_pressure=True, rare=True,
    ),
    Effect(
        link="air", family="tube_resistance", name="tube_resistance", form="turbulent",
        missing="a pressure drop along the tube in proportion to the flow squared",
        equation="V / (R T) P_valve' = mdot - v, P_valve - P = K v |v| / rho",
        parameters=(
            # 4 m of a hose of 4 mm: as much as 1e8 Pa s/kg at 5 g/s of air at 4 bar.
            size("valve.tube_friction", 1e11, 0.0, 5e12),
            shape("valve.tube_volume", 1e-5, 4e-6, 1e-4, starts=(3e-5,)),
        ),
        look_alikes=("pressure_lag", "valve_flow", "supply_sag"),
        separating="fill and vent from several pressures: a vent to 63 % takes longer from a"
        " higher pressure",
        probes=(0.1, 0.5, 2.0), upstream_of_pressure=True, rare=True,
    ),
    Effect(
        link="air", family="thermal", name="thermal_relaxation", form="index",
        missing="heat exchanged between the air and the muscle",
        equation="P V^n is constant behind shut valves",
        parameters=(_INDEX,),
        look_alikes=("valve_flow", "valve_delay", "angle_scale"),
        separating="turn the arm by hand with the valves shut and read the pressures",
    ),
    Effect(
        link="air", family="thermal", name="thermal_relaxation", form="temperature",
        missing="heat exchanged between the air and the muscle, with a time constant",
        equation="P' = n (R T mdot - P V') / V - h (P - m R T / V)",
        parameters=(size("chamber.heat_rate", 1.0, 0.0, 50.0), _INDEX),
        look_alikes=("valve_flow", "air_leak", "viscoelastic_creep"),
        separating="shut the valves after a fast fill: the pressure falls and then stays; a leak"
        " goes on",
        # First at a time of 0.25 s, usual for air in a muscle.
        probes=(4.0, 0.4),
    ),
)  # fmt: skip
