"""Independent models of the air: valve flow, reservoir, laminar leak, heat exchange."""

from __future__ import annotations

from pamsim.actuator.layout import slot
from pamsim.comparison.effects_on_rig import at_size
from pamsim.effects.catalog import effect
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.pneumatics.air import GAS_CONSTANT
from pamsim.pneumatics.orifice import mass_flow
from pamsim.pneumatics.valves import valve_flow
from pamsim.twins.independent_models.independent_model import IndependentModel, Law
from pamsim.twins.independent_models.plant import Plant, RunContext

_SUPPLY = slot("valve.supply_pressure")
_FILL, _EXHAUST = slot("valve.conductance_fill"), slot("valve.conductance_exhaust")
_CRITICAL, _LAMINAR = slot("valve.critical_ratio"), slot("valve.laminar_ratio")
_TEMPERATURE = slot("chamber.temperature")
_ATMOSPHERE = slot("chamber.atmosphere")
_INDEX = slot("chamber.polytropic_index")

_EQUAL_PRESSURE = 2.5e5
"""Gauge pressure at which the laminar leak's flow equals that of the library's leak [Pa]."""

_RESERVOIR = 1e-4
"""Volume of the supply's reservoir [m^3]."""

_HEAT_TIME = 1.5
"""Time in which heat exchange of size 1 brings the air back to the muscle's temperature [s]."""

_CRITICAL_SHIFT = 0.2
"""Difference of the critical ratio in the model of `valve_flow` [-]."""


def laminar_leak(pressure: float, conductance: float) -> float:
    """Mass flow of a laminar leak, proportional to gauge pressure [kg/s].

    Args:
        pressure: gauge [Pa].
        conductance: [kg/(s Pa)].
    """
    return conductance * pressure


def _leak(size: float, context: RunContext) -> Law:
    sonic = effect("air_leak").parameters[0].typical
    laminar: list[float] = []

    def law(plant: Plant) -> None:
        for i in plant.muscles:
            if len(laminar) <= i:
                row = plant.rows[i]
                flow = mass_flow(
                    _EQUAL_PRESSURE + row[_ATMOSPHERE],
                    row[_ATMOSPHERE],
                    size * sonic,
                    row[_CRITICAL],
                    row[_LAMINAR],
                    row[_TEMPERATURE],
                )
                laminar.append(flow / _EQUAL_PRESSURE)
            plant.add_air(i, -laminar_leak(plant.pressure(i), laminar[i]))

    return law


class Reservoir:
    """A supply of finite volume that all muscles share, refilled through a restriction.

    Args:
        resistance: of the restriction, laminar [Pa s/kg].
        pressure: gauge, of what refills it [Pa].
        temperature: of the air [K].
    """

    def __init__(self, resistance: float, pressure: float, temperature: float) -> None:
        self._resistance, self._source, self.pressure = resistance, pressure, pressure
        self._rate = GAS_CONSTANT * temperature / _RESERVOIR

    def draw(self, flow: float, timestep: float) -> None:
        """Let a mass flow [kg/s] out during a time step [s]."""
        filled = self._rate * timestep / self._resistance
        self.pressure -= self._rate * timestep * flow
        self.pressure += (self._source - self.pressure) * filled / (1.0 + filled)

    def __call__(self, plant: Plant) -> None:
        """Feed the muscles."""
        drawn = 0.0
        for i in plant.muscles:
            opening = plant.opening(i)
            if opening > 0.0:
                row = plant.rows[i]
                drawn += valve_flow(
                    opening,
                    plant.pressure_abs(i),
                    self.pressure + row[_ATMOSPHERE],
                    row[_ATMOSPHERE],
                    row[_FILL],
                    row[_EXHAUST],
                    row[_CRITICAL],
                    row[_LAMINAR],
                    row[_TEMPERATURE],
                )
        self.draw(drawn, plant.timestep)
        plant.user[:, _SUPPLY] = self.pressure


def _sag(size: float, context: RunContext) -> Law:
    muscle = next(iter(context.rig.muscles.values()))
    return Reservoir(
        size * effect("supply_sag").parameters[0].typical,
        muscle.valve.supply_pressure,
        muscle.chamber.temperature,
    )


class HeatExchange:
    """Heat exchange between air and muscle walls, by which the pressure relaxes.

    The chamber's polytropic index holds for fast changes; slowly the pressure approaches that of
    its mass of air at the walls' temperature.

    Args:
        rate: of the relaxation [1/s].
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._mass: list[float] = []
        self._before: list[float] = []

    def __call__(self, plant: Plant) -> None:
        """Relax the pressures, from their values at time 0."""
        if plant.settling:
            return
        if not self._mass:
            for i in plant.muscles:
                heat = GAS_CONSTANT * plant.rows[i][_TEMPERATURE]
                self._mass.append(plant.pressure_abs(i) * plant.volume(i) / heat)
                self._before.append(plant.air(i))
        for i in plant.muscles:
            row, air = plant.rows[i], plant.air(i)
            pressure, volume = plant.pressure_abs(i), plant.volume(i)
            heat = GAS_CONSTANT * row[_TEMPERATURE]
            # The valves' flow during the last step, from the change of the air state.
            self._mass[i] += (air - self._before[i]) / air * volume * pressure / heat
            walls = self._mass[i] * heat / volume
            share = (walls / pressure - 1.0) * self._rate * plant.timestep / row[_INDEX]
            self._before[i] = air * (1.0 + share)
            plant.set_air(i, self._before[i])


def _thermal(size: float, context: RunContext) -> Law:
    return HeatExchange(abs(size) / _HEAT_TIME)


def _index(rig: Rig, size: float) -> dict[str, float]:
    return at_size(rig, effect("thermal_relaxation"), size)


def _flow(rig: Rig, size: float) -> dict[str, float]:
    critical = rig_parameter(rig, "valve.critical_ratio").value
    return at_size(rig, effect("valve_flow"), size) | {
        "valve.critical_ratio": min(critical + _CRITICAL_SHIFT * abs(size), 0.6)
    }


MODELS = (
    IndependentModel(
        name="valve_flow",
        formulation="other conductances and another critical pressure ratio",
        parameters=_flow,
        signed=True,
    ),
    IndependentModel(
        name="supply_sag",
        formulation="a reservoir of 0.1 litres that both muscles share, refilled through a"
        " laminar restriction",
        law=_sag,
    ),
    IndependentModel(
        name="air_leak",
        formulation="a laminar leak, its mass flow proportional to gauge pressure",
        law=_leak,
    ),
    IndependentModel(
        name="thermal_relaxation",
        formulation="another index for fast changes, and heat exchange with the walls",
        parameters=_index,
        law=_thermal,
        signed=True,
    ),
)
"""Independent models of the pneumatic effects."""
