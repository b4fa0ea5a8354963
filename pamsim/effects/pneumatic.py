"""Effects in the air: leaks, supply, valves, heat."""

from __future__ import annotations

from pamsim.effects.effect import SECOND_MUSCLE, Effect, EffectParameter

_SUPPLY_RESISTANCE = EffectParameter(name="valve.supply_resistance", typical=2e8, low=0.0, high=5e9)

_CONDUCTANCES = tuple(
    EffectParameter(
        name=f"valve.conductance_{way}", typical=0.8, low=0.2, high=5.0, neutral=None, relative=True
    )
    for way in ("fill", "exhaust")
)

_SUPPLY_VOLUME = EffectParameter(
    name="valve.supply_volume",
    typical=1e-4,
    low=0.0,
    high=1e-2,
    shape=True,
    starts=(1e-5, 1e-3),
)

EFFECTS = (
    Effect(
        name="air_leak",
        form="orifice",
        family="leak",
        missing="a leak of air from the muscles",
        equation="mdot = -C rho_0 P phi(P_a / P) sqrt(T_0 / T)",
        parameters=(
            EffectParameter(name="chamber.leak_conductance", typical=2e-12, low=0.0, high=1e-10),
        ),
        look_alikes=("pressure_scale", "pressure_bias", "supply_sag"),
        separating="shut the valves at a high pressure and watch the pressure for some seconds",
        upstream_of_pressure=True,
    ),
    Effect(
        name="air_leak",
        form="laminar",
        family="leak",
        missing="a leak of air from the muscles through a narrow gap",
        equation="mdot = -g (P^2 - P_a^2) / (2 R T)",
        parameters=(
            EffectParameter(
                name="chamber.laminar_leak_conductance", typical=1e-12, low=0.0, high=5e-11
            ),
        ),
        look_alikes=("pressure_scale", "pressure_bias", "supply_sag"),
        separating="shut the valves at a high and at a low pressure and watch the pressures for"
        " some seconds: a narrow gap leaks the less, the lower the pressure, than an orifice",
        upstream_of_pressure=True,
    ),
    Effect(
        name="supply_sag",
        form="resistance",
        family="supply",
        missing="a supply whose pressure falls with the flow that the muscles draw from it",
        equation="P_line = P_supply - R_s (mdot_1 + mdot_2 + ...)",
        parameters=(_SUPPLY_RESISTANCE,),
        look_alikes=("valve_flow", "air_leak"),
        separating="a gauge on the supply while a muscle is filled from empty",
        probes=(0.1, 0.5, 2.0),
        upstream_of_pressure=True,
    ),
    Effect(
        name="supply_sag",
        form="reservoir",
        family="supply",
        missing="a supply whose reservoir is drawn down by the muscles and refilled slowly",
        equation="V_s / (R T) P_line' = (P_supply - P_line) / R_s - (mdot_1 + mdot_2 + ...)",
        parameters=(_SUPPLY_RESISTANCE, _SUPPLY_VOLUME),
        look_alikes=("valve_flow", "air_leak"),
        separating="a gauge on the supply while a muscle is filled from empty, and afterwards",
        probes=(0.3,),
        upstream_of_pressure=True,
    ),
    Effect(
        name="supply_sag",
        form="turbulent_reservoir",
        family="supply",
        missing="a supply whose reservoir is drawn down by the muscles and refilled slowly, through"
        " turbulent fittings",
        equation="V_s / (R T) P_line' = sqrt((P_supply - P_line) / S_s) - (mdot_1 + mdot_2 + ...)",
        parameters=(
            EffectParameter(name="valve.supply_square", typical=1e12, low=0.0, high=2.5e13),
            _SUPPLY_VOLUME,
        ),
        look_alikes=("valve_flow", "air_leak"),
        separating="a gauge on the supply while a muscle is filled from empty, and afterwards",
        probes=(0.3,),
        upstream_of_pressure=True,
    ),
    Effect(
        name="valve_dead_zone",
        form="symmetric",
        family="valve",
        missing="a dead zone of the valves",
        equation="u_open = sign(u) max(|u| - u_0, 0) / (1 - u_0)",
        parameters=(EffectParameter(name="valve.dead_zone", typical=0.05, low=0.0, high=0.5),),
        look_alikes=("coulomb_friction", "valve_flow"),
        separating="increase the valve opening in small steps from shut",
        probes=(0.1, 0.5, 2.0),
        upstream_of_pressure=True,
    ),
    Effect(
        name="valve_dead_zone",
        form="asymmetric",
        family="valve",
        missing="a dead zone of the valves, another one to fill than to exhaust",
        equation="u_open = sign(u) max(|u| - u_i, 0) / (1 - u_i), u_i = (1 + a) u_0 to fill, (1 -"
        " a) u_0 to exhaust",
        parameters=(
            EffectParameter(name="valve.dead_zone", typical=0.05, low=0.0, high=0.5),
            EffectParameter(
                name="valve.dead_zone_asymmetry",
                typical=0.0,
                low=-1.0,
                high=1.0,
                shape=True,
                starts=(-0.6, 0.6),
                natural_ends=True,
            ),
        ),
        look_alikes=("coulomb_friction", "valve_flow"),
        separating="open each valve in small steps from shut",
        probes=(0.1, 0.5, 2.0),
        upstream_of_pressure=True,
    ),
    Effect(
        name="valve_flow",
        form="conductances",
        family="valve",
        missing="a different flow through the valves",
        equation="mdot = u C_fill rho_0 P_s phi(P / P_s) sqrt(T_0 / T), or u C_exhaust rho_0 P"
        " phi(P_a / P) sqrt(T_0 / T)",
        parameters=_CONDUCTANCES,
        look_alikes=("supply_sag", "line_lag", "thermal_relaxation"),
        separating="fill from empty and vent from full with a valve wide open",
        upstream_of_pressure=True,
    ),
    Effect(
        name="valve_flow",
        form="critical_ratio",
        family="valve",
        missing="a different flow through the valves, choked up to another pressure ratio",
        equation="mdot = u C_fill rho_0 P_s phi(P / P_s) sqrt(T_0 / T), or u C_exhaust rho_0 P"
        " phi(P_a / P) sqrt(T_0 / T), with phi choked up to the critical ratio b",
        parameters=(
            *_CONDUCTANCES,
            EffectParameter(
                name="valve.critical_ratio",
                typical=0.2,
                low=-0.3,
                high=0.4,
                neutral=None,
                another_size=True,
            ),
        ),
        look_alikes=("supply_sag", "line_lag", "thermal_relaxation"),
        separating="fill from empty and vent from full with a valve wide open: the flow falls off"
        " where the pressures come within the critical ratio",
        upstream_of_pressure=True,
    ),
    Effect(
        name="valve_asymmetry",
        family="valve",
        missing="another ratio between the flows of the fill and the exhaust valve",
        equation="mdot = u C_exhaust rho_0 P phi(P_a / P) sqrt(T_0 / T) while it exhausts",
        parameters=(
            EffectParameter(
                name="valve.conductance_exhaust",
                typical=0.85,
                low=0.2,
                high=5.0,
                neutral=None,
                relative=True,
            ),
        ),
        look_alikes=("valve_flow", "air_leak", "supply_sag"),
        separating="fill from empty and vent from full with a valve wide open, and compare the two",
        upstream_of_pressure=True,
        rare=True,
    ),
    Effect(
        name="valve_mismatch",
        family="valve",
        missing="another flow through the valves of one muscle than through the others'",
        equation="mdot of the second muscle's valves, with a C_fill and a C_exhaust of its own",
        parameters=(
            EffectParameter(
                name=f"{SECOND_MUSCLE}:valve.conductance_fill",
                typical=0.8,
                low=0.1,
                high=5.0,
                neutral=None,
                relative=True,
            ),
            EffectParameter(
                name=f"{SECOND_MUSCLE}:valve.conductance_exhaust",
                typical=1.0,
                low=0.1,
                high=5.0,
                neutral=None,
                relative=True,
            ),
        ),
        look_alikes=("valve_flow", "supply_sag", "valve_asymmetry"),
        separating="fill and vent one muscle after the other with its valves wide open",
        upstream_of_pressure=True,
        rare=True,
    ),
    Effect(
        name="tube_resistance",
        family="tube_resistance",
        missing="the resistance of the tube between the valves with their sensor and the muscle",
        equation="V / (R T) P_valve' = mdot - (P_valve - P) / R_tube",
        parameters=(
            EffectParameter(name="valve.tube_resistance", typical=1e8, low=0.0, high=5e9),
            EffectParameter(
                name="valve.tube_volume",
                typical=1e-5,
                low=4e-6,
                high=1e-4,
                shape=True,
                starts=(3e-5,),
            ),
        ),
        look_alikes=("pressure_lag", "valve_flow", "supply_sag"),
        separating="a second pressure sensor at the muscle while it is filled from empty",
        probes=(0.1, 0.5, 2.0),
        upstream_of_pressure=True,
        rare=True,
    ),
    Effect(
        name="thermal_relaxation",
        form="index",
        family="thermal",
        missing="heat exchanged between the air and the muscle",
        equation="P V^n is constant behind shut valves",
        parameters=(
            # Limited to [1, 1.4]: isothermal to adiabatic air.
            EffectParameter(
                name="chamber.polytropic_index",
                typical=0.15,
                low=-0.4,
                high=0.4,
                neutral=None,
                natural_ends=True,
            ),
        ),
        look_alikes=("valve_flow", "valve_delay", "angle_scale"),
        separating="turn the arm by hand with the valves shut and read the pressures",
    ),
    Effect(
        name="thermal_relaxation",
        form="temperature",
        family="thermal",
        missing="heat that the air exchanges with the muscle in a time of its own",
        equation="P' = n (R T mdot - P V') / V - h (P - m R T / V)",
        parameters=(
            EffectParameter(name="chamber.heat_rate", typical=1.0, low=0.0, high=50.0),
            # Limited to [1, 1.4]: isothermal to adiabatic air.
            EffectParameter(
                name="chamber.polytropic_index",
                typical=0.15,
                low=-0.4,
                high=0.4,
                neutral=None,
                natural_ends=True,
            ),
        ),
        look_alikes=("valve_flow", "air_leak", "viscoelastic_creep"),
        separating="shut the valves after a fast fill: the pressure falls and then stays, where a"
        " leak goes on",
        # First at a time of 0.25 s, usual for air in a muscle.
        probes=(4.0, 0.4),
    ),
)
