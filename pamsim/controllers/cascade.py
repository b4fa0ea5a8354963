"""Pressure loops under a controller of positions: from set points to valve openings.

Each muscle has a PI loop on its pressure, designed for the speed of its valves,
dP/dt = n R T mdot / V at full opening. Inside the band of a pressure regulator the opening is the
error over the band, so that the pressure follows its set point as a lag does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from pamsim.controllers.controller import (
    Command,
    Controller,
    JointObservation,
    Memory,
    Observation,
)
from pamsim.controllers.pid import PidLaw, PidMemory
from pamsim.core.errors import InputError
from pamsim.engine.equilibrium import tendon_lengths
from pamsim.engine.rig import Rig
from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.muscle_valves import flow_through_valves, leak_flow
from pamsim.physics.record import COMMON, Parameters, parameters, split_states
from pamsim.physics.static_muscle import static_volume
from pamsim.physics.supply import sags, supply_sag
from pamsim.physics.valves import clamped_opening


def full_rates(m: Parameters, tendon_length: float, pressure: float) -> tuple[float, float]:
    """Rates of gauge pressure [Pa/s] with the fill and with the exhaust valve fully open.

    The tendon is held at a length [m], and the supply sags by the flow to this muscle alone.
    """
    absolute = pressure + m.chamber.atmosphere
    inside = static_volume(m, tendon_length, pressure)
    scale = m.chamber.polytropic_index * GAS_CONSTANT * m.chamber.temperature / inside
    sag = 0.0
    if sags(m):
        source, air = m.valve.supply_pressure + m.chamber.atmosphere, m.chamber.temperature
        ratios = (m.valve.critical_ratio, m.valve.laminar_ratio)
        valve = (source, absolute, m.valve.conductance_fill, *ratios, air)
        sag = supply_sag(m, split_states([0.0] * COMMON)[0], [valve], math.inf)
    lost = leak_flow(m, absolute)
    fill, exhaust = (
        flow_through_valves(m, absolute, opening, sag) - lost for opening in (1.0, -1.0)
    )
    return scale * fill, scale * exhaust


def regulated_lag(m: Parameters, tendon_length: float, pressure: float) -> float:
    """Time constant [s] of a regulated gauge pressure [Pa], mean of filling and venting.

    The tendon is held at a length [m].

    Raises:
        InputError: for a pressure that the valves cannot both raise and lower.
    """
    fill, exhaust = full_rates(m, tendon_length, pressure)
    if not fill > 0.0 > exhaust:
        raise InputError(
            f"the valves cannot both raise and lower a pressure of {pressure / 1e3:g} kPa; choose"
            f" one between 0 and the supply's {m.valve.supply_pressure / 1e3:g} kPa"
        )
    return 0.5 * m.valve.regulator_band * (1.0 / fill - 1.0 / exhaust)


class PressureLoop(PidLaw):
    """PI from the error of one pressure to the opening of its valves; its gain is in 1/Pa."""

    def opening(self, error: float, integral: float) -> tuple[float, float]:
        """Opening in [-1, 1] for an error [Pa], and the integral part from now on [-]."""
        joint = JointObservation(position=0.0, velocity=0.0, reference=error)
        wanted, after = self.wanted(joint, PidMemory(integral))
        given = clamped_opening(wanted)
        return given, self.limited(after, given - wanted).integral

    @classmethod
    def for_rig(
        cls, rig: Rig, *, period: float, common_pressure: float, closed_loop_time: float
    ) -> tuple[PressureLoop, ...]:
        """Loop of each muscle, designed for its faster of filling and venting.

        That is at the initial position. The valves' flow is taken at a common gauge pressure [Pa].
        Period and closed-loop time constant are in s.

        Raises:
            InputError: for a time constant below two periods, which a sampled loop cannot have.
        """
        if closed_loop_time < 2.0 * period:
            raise InputError(
                f"a pressure loop of {closed_loop_time * 1e3:g} ms needs samples every"
                f" {closed_loop_time * 5e2:g} ms at least; got {period * 1e3:g} ms"
            )
        slow, loops = 8.0 * closed_loop_time, list[PressureLoop]()
        lengths = tendon_lengths(rig, rig.model.qpos0).tolist()
        for muscle, length in zip(rig.muscles.values(), lengths, strict=True):
            fill, exhaust = full_rates(parameters(muscle), length, common_pressure)
            gain = 1.0 / (closed_loop_time * max(fill, -exhaust))
            loops.append(cls(period=period, gain=gain, integral_time=slow, tracking_time=slow))
        return tuple(loops)


class CascadeMemory(NamedTuple):
    """Memory of the outer controller, and integral parts of the muscles' pressure loops [-]."""

    outer: Memory
    integrals: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Cascade:
    """From positions to valve openings.

    Attributes:
        outer: controller that commands pressures.
        inner: loop of each muscle.

    Raises:
        InputError: if the outer controller does not command pressures.
    """

    command = "valve"
    outer: Controller
    inner: tuple[PressureLoop, ...]

    def __post_init__(self) -> None:
        if self.outer.command != "pressure_set":
            raise InputError(
                f"the outer controller of a cascade commands {self.outer.command!r}; it must"
                " command pressure"
            )

    def start(self, first: Observation) -> CascadeMemory:
        """Memory with shut valves."""
        return CascadeMemory(self.outer.start(first), (0.0,) * len(first.pressure))

    def step(
        self, observation: Observation, memory: CascadeMemory
    ) -> tuple[Command, CascadeMemory]:
        """Openings from now on, and the memory for the next sample."""
        wanted, outer = self.outer.step(observation, memory.outer)
        muscles = zip(self.inner, wanted, observation.pressure, memory.integrals, strict=True)
        steps = [loop.opening(goal - now, integral) for loop, goal, now, integral in muscles]
        openings, integrals = zip(*steps, strict=True)
        return openings, CascadeMemory(outer, integrals)
