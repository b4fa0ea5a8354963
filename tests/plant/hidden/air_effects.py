"""Hidden effects of air, valves and the command's line."""

from __future__ import annotations

from pamsim.core.errors import InputError
from pamsim.diagnosis.bench import PRESSURE
from tests.plant.air import orifice
from tests.plant.hidden.hidden_effect import (
    Own,
    PlantEffect,
    Quantities,
    Quantity,
    on_joint,
    on_muscles,
)
from tests.plant.read_rig import Numbers
from tests.plant.run import Timing

_FLOW = 2e-4
"""Flow at which a supply with a turbulent restriction falls as much as a linear one [kg/s]."""

_LAST = slice(-1, None)

_FILL, _EXHAUST = "valve.conductance_fill", "valve.conductance_exhaust"


def _leak(n: Numbers, size: float) -> None:
    for m in n.muscles:
        flow = orifice(m, size, PRESSURE + m.atmosphere, m.atmosphere)
        m.laminar_leak = flow / PRESSURE


def _leaked(there: Numbers, _: Numbers, __: float) -> Quantities:
    flow = float(there.muscles[0].laminar_leak) * PRESSURE
    return {
        "mass_flow": Quantity(flow, "kg/s"),
        "at_pressure": Quantity(PRESSURE, "Pa"),
    }


def _nozzle(n: Numbers, size: float) -> None:
    n.muscles.nozzle = 1.0
    n.muscles.fill_conductance *= 1.0 + size
    n.muscles.exhaust_conductance *= 1.0 + size


def _choked(size: float, _: Quantities, own: Own) -> dict[str, float]:
    return {name: own(name) * (1.0 + size) for name in (_FILL, _EXHAUST)}


def _widths(_: Numbers, __: Numbers, size: float) -> Quantities:
    return {
        "opening_lost_filling": Quantity(1.4 * size, "1"),
        "opening_lost_venting": Quantity(0.6 * size, "1"),
    }


def _cross(n: Numbers, size: float) -> None:
    if len(n.muscles) < 2:
        raise InputError("cross_leak is between two muscles; this rig has one")
    n.joint.cross = size


def _cold(n: Numbers, size: float) -> None:
    n.muscles.temperature -= size


EFFECTS = (
    PlantEffect(
        name="laminar_leak",
        formulation="a laminar leak: its mass flow is proportional to gauge pressure",
        stands_for=("air_leak",),
        unit="m^3/(s*Pa)",
        typical=2e-12,
        change=_leak,
        measure=_leaked,
        equals="chamber.leak_conductance",
    ),
    PlantEffect(
        name="small_reservoir",
        formulation="a reservoir of 0.1 litres that all muscles share, refilled through a turbulent"
        " restriction: its pressure falls with the square of the flow",
        stands_for=("supply_sag",),
        unit="Pa*s/kg",
        typical=2e8,
        change=on_joint(
            lambda s: {"refill": 0.1 * s, "refill_square": 0.9 * s / _FLOW}, reservoir=1e-4
        ),
        stated="pressure_drop_per_flow_at_200_mg/s",
        equals="valve.supply_resistance",
    ),
    PlantEffect(
        name="air_temperature",
        formulation="the air's balance of energy, with heat exchanged in a time constant",
        stands_for=("thermal_relaxation",),
        unit="s",
        typical=0.15,
        change=on_muscles("heat_time"),
        stated="temperature_time_constant",
    ),
    PlantEffect(
        name="nozzle_flow",
        formulation="isentropic nozzles of another size in place of the ellipse of ISO 6358",
        stands_for=("valve_flow",),
        unit="1",
        typical=-0.2,
        change=_nozzle,
        stated="relative_change_of_choked_flow",
        library=_choked,
        signed=True,
    ),
    PlantEffect(
        name="asymmetric_dead_zone",
        formulation="a dead zone of the valves, wider while filling",
        stands_for=("valve_dead_zone",),
        unit="1",
        typical=0.05,
        change=on_muscles(lambda s: {"dead_zone_fill": 1.4 * s, "dead_zone_exhaust": 0.6 * s}),
        measure=_widths,
        equals="valve.dead_zone",
    ),
    PlantEffect(
        name="bus_delay",
        formulation="a dead time that varies by 30 % from command to command",
        stands_for=("valve_delay",),
        unit="s",
        typical=0.01,
        timing=lambda s, seed: Timing(delay=s, spread=0.3 * s, seed=seed),
        stated="mean_dead_time",
        equals="valve.delay",
    ),
    PlantEffect(
        name="slewing_line",
        formulation="a command that moves at a limited rate: 1 bar or a full opening in this time",
        stands_for=("line_lag", "valve_slew"),
        unit="s",
        typical=0.06,
        change=on_muscles(lambda s: {"slew": 1.0 / s}),
        stated="time_for_full_scale",
    ),
    PlantEffect(
        name="two_lags",
        formulation="two equal lags in series between command and valves",
        stands_for=("line_lag",),
        unit="s",
        typical=0.02,
        change=on_muscles(lambda s: {"lag": 0.5 * s, "second_lag": 0.5 * s}),
        stated="sum_of_time_constants",
        equals="valve.line_lag",
    ),
    PlantEffect(
        name="stuck_valve",
        formulation="the last muscle's fill valve opens no further than this from 1.5 s on",
        family="valve",
        unit="1",
        typical=0.3,
        change=on_muscles("stuck_at", _LAST, stuck_fills=1.0, stuck_from=1.5),
        stated="largest_opening",
    ),
    PlantEffect(
        name="cross_leak",
        formulation="a laminar leak from one muscle to the other",
        stands_for=("leak_between_muscles",),
        resembles=("air_leak",),
        family="leak",
        unit="kg/(s*Pa)",
        typical=1.2e-11,
        change=_cross,
        stated="mass_flow_per_pressure",
    ),
    PlantEffect(
        name="cold_air",
        formulation="air colder than the model's",
        resembles=("valve_flow",),
        unit="K",
        typical=25.0,
        change=_cold,
        stated="temperature_difference",
        signed=True,
    ),
)
"""Hidden effects of air and valves."""
