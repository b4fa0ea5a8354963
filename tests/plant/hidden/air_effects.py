"""Hidden effects of air, valves and the command's line."""

from __future__ import annotations

from pamsim.core.errors import InputError
from tests.plant.air import orifice
from tests.plant.hidden.hidden_effect import Own, PlantEffect, Quantities, Quantity, stated
from tests.plant.hidden.virtual_tests import PRESSURE
from tests.plant.read_rig import Numbers
from tests.plant.run import Timing

_FLOW = 2e-4
"""Flow at which a supply with a turbulent restriction falls as much as a linear one [kg/s]."""

_FILL, _EXHAUST = "valve.conductance_fill", "valve.conductance_exhaust"


def _leak(n: Numbers, size: float) -> None:
    for m in n.muscles:
        flow = orifice(m, size, PRESSURE + m.atmosphere, m.atmosphere)
        m.laminar_leak = flow / PRESSURE


def _leaked(there: Numbers, _: Numbers, __: float) -> Quantities:
    flow = float(there.muscles[0].laminar_leak) * PRESSURE
    return {
        "mass_flow": Quantity(value=flow, unit="kg/s"),
        "at_pressure": Quantity(value=PRESSURE, unit="Pa"),
    }


def _reservoir(n: Numbers, size: float) -> None:
    n.joint.reservoir, n.joint.refill = 1e-4, 0.1 * size
    n.joint.refill_square = 0.9 * size / _FLOW


def _balance(n: Numbers, size: float) -> None:
    n.muscles.heat_time = size


def _nozzle(n: Numbers, size: float) -> None:
    n.muscles.nozzle = 1.0
    n.muscles.fill_conductance *= 1.0 + size
    n.muscles.exhaust_conductance *= 1.0 + size


def _choked(size: float, _: Quantities, own: Own) -> dict[str, float]:
    return {name: own(name) * (1.0 + size) for name in (_FILL, _EXHAUST)}


def _dead_zones(n: Numbers, size: float) -> None:
    n.muscles.dead_zone_fill, n.muscles.dead_zone_exhaust = 1.4 * size, 0.6 * size


def _widths(_: Numbers, __: Numbers, size: float) -> Quantities:
    return {
        "opening_lost_filling": Quantity(value=1.4 * size, unit="1"),
        "opening_lost_venting": Quantity(value=0.6 * size, unit="1"),
    }


def _bus(size: float, seed: tuple[int, ...]) -> Timing:
    return Timing(delay=size, spread=0.3 * size, seed=seed)


def _slew(n: Numbers, size: float) -> None:
    n.muscles.slew = 1.0 / size


def _two_lags(n: Numbers, size: float) -> None:
    n.muscles.lag, n.muscles.second_lag = 0.5 * size, 0.5 * size


def _stuck(n: Numbers, size: float) -> None:
    n.muscles[-1].stuck_fills, n.muscles[-1].stuck_from = 1.0, 1.5
    n.muscles[-1].stuck_at = size


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
        library=lambda size, *_: {"chamber.leak_conductance": size},
    ),
    PlantEffect(
        name="small_reservoir",
        formulation="a reservoir of 0.1 litres that all muscles share, refilled through a turbulent"
        " restriction: its pressure falls with the square of the flow",
        stands_for=("supply_sag",),
        unit="Pa*s/kg",
        typical=2e8,
        change=_reservoir,
        measure=stated("pressure_drop_per_flow_at_0.2_g/s", "Pa*s/kg"),
        library=lambda size, *_: {"valve.supply_resistance": size},
    ),
    PlantEffect(
        name="air_temperature",
        formulation="the air's balance of energy, with heat exchanged in a time constant",
        stands_for=("thermal_relaxation",),
        unit="s",
        typical=0.15,
        change=_balance,
        measure=stated("temperature_time_constant", "s"),
    ),
    PlantEffect(
        name="nozzle_flow",
        formulation="isentropic nozzles of another size in place of the ellipse of ISO 6358",
        stands_for=("valve_flow",),
        unit="1",
        typical=-0.2,
        change=_nozzle,
        measure=stated("relative_change_of_choked_flow", "1"),
        library=_choked,
        signed=True,
    ),
    PlantEffect(
        name="asymmetric_dead_zone",
        formulation="a dead zone of the valves, wider while filling",
        stands_for=("valve_dead_zone",),
        unit="1",
        typical=0.05,
        change=_dead_zones,
        measure=_widths,
        library=lambda size, *_: {"valve.dead_zone": size},
    ),
    PlantEffect(
        name="bus_delay",
        formulation="a dead time that varies by 30 % from command to command",
        stands_for=("valve_delay",),
        unit="s",
        typical=0.01,
        timing=_bus,
        measure=stated("mean_dead_time", "s"),
        library=lambda size, *_: {"valve.delay": size},
    ),
    PlantEffect(
        name="slewing_line",
        formulation="a command that moves at a limited rate: 1 bar or a full opening in this time",
        stands_for=("line_lag", "valve_slew"),
        unit="s",
        typical=0.06,
        change=_slew,
        measure=stated("time_for_full_scale", "s"),
    ),
    PlantEffect(
        name="two_lags",
        formulation="two equal lags in series between command and valves",
        stands_for=("line_lag",),
        unit="s",
        typical=0.02,
        change=_two_lags,
        measure=stated("sum_of_time_constants", "s"),
        library=lambda size, *_: {"valve.line_lag": size},
    ),
    PlantEffect(
        name="stuck_valve",
        formulation="the last muscle's fill valve opens no further than this from 1.5 s on",
        family="valve",
        unit="1",
        typical=0.3,
        change=_stuck,
        measure=stated("largest_opening", "1"),
    ),
    PlantEffect(
        name="cross_leak",
        formulation="a laminar leak from one muscle to the other",
        resembles=("air_leak",),
        family="leak",
        unit="kg/(s*Pa)",
        typical=1.2e-11,
        change=_cross,
        measure=stated("mass_flow_per_pressure", "kg/(s*Pa)"),
    ),
    PlantEffect(
        name="cold_air",
        formulation="air colder than the model's",
        resembles=("valve_flow",),
        unit="K",
        typical=25.0,
        change=_cold,
        measure=stated("temperature_difference", "K"),
        signed=True,
    ),
)
"""Hidden effects of air and valves."""
