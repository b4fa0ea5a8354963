"""Pressure loops under a controller of positions: from set points to valve openings.

Each muscle has a PI loop on its pressure; its integral is reduced where the valve is fully open
(back calculation, as in `pamsim.controllers.pid`).
"""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.controllers.controller import Command, Controller, Memory, Observation
from pamsim.controllers.pressure_rate import full_rates
from pamsim.core.errors import InputError
from pamsim.engine.rig import Rig
from pamsim.physics.record import parameters
from pamsim.physics.valves import clamped_opening


@dataclass(frozen=True, kw_only=True)
class PressureLoop:
    """PI from the error of one pressure to the opening of its valves.

    Attributes:
        period: between two samples [s].
        gain: [1/Pa].
        integral_time: [s].
        tracking_time: in which the integral follows a valve that is fully open [s].
    """

    period: float
    gain: float
    integral_time: float
    tracking_time: float

    def opening(self, error: float, integral: float) -> tuple[float, float]:
        """Opening in [-1, 1] for an error [Pa], and the integral part from now on [-]."""
        wanted = self.gain * error + integral
        given = clamped_opening(wanted)
        grown = self.gain * error / self.integral_time + (given - wanted) / self.tracking_time
        return given, integral + self.period * grown

    @classmethod
    def for_rig(
        cls, rig: Rig, *, period: float, common_pressure: float, closed_loop_time: float
    ) -> PressureLoop:
        """Loop designed for the faster of filling and venting of muscle 1 at angle 0.

        Args:
            rig: the rig.
            period: between two samples [s].
            common_pressure: at which the valves' flow is taken, gauge [Pa].
            closed_loop_time: time constant wanted, of at least two periods [s].

        Raises:
            InputError: for a shorter one, which a sampled loop cannot have.
        """
        if closed_loop_time < 2.0 * period:
            raise InputError(
                f"a pressure loop of {closed_loop_time * 1e3:g} ms needs samples every"
                f" {closed_loop_time * 5e2:g} ms at least; got {period * 1e3:g} ms"
            )
        muscle = next(iter(rig.muscles.values()))
        fill, exhaust = full_rates(parameters(muscle), 0.0, common_pressure)
        rate = max(fill, -exhaust)
        return cls(
            period=period,
            gain=1.0 / (closed_loop_time * rate),
            integral_time=8.0 * closed_loop_time,
            tracking_time=8.0 * closed_loop_time,
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class CascadeMemory:
    """What a cascade keeps.

    Attributes:
        outer: memory of the outer controller.
        integrals: of the muscles' pressure loops [-].
    """

    outer: Memory
    integrals: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Cascade:
    """From positions to valve openings.

    Attributes:
        outer: controller that commands pressures.
        inner: loop of each muscle.
        command: always ``valve``.
    """

    outer: Controller
    inner: PressureLoop
    command: str = "valve"

    def __post_init__(self) -> None:
        """Check the outer controller.

        Raises:
            InputError: if it does not command pressures.
        """
        if self.outer.command != "pressure_set":
            raise InputError(
                f"the outer controller of a cascade commands {self.outer.command!r}; it must"
                " command pressure"
            )

    def start(self, first: Observation) -> CascadeMemory:
        """Memory with shut valves."""
        return CascadeMemory(outer=self.outer.start(first), integrals=(0.0,) * len(first.pressure))

    def step(
        self, observation: Observation, memory: CascadeMemory
    ) -> tuple[Command, CascadeMemory]:
        """Openings from now on, and the memory for the next sample."""
        wanted, outer = self.outer.step(observation, memory.outer)
        steps = [
            self.inner.opening(goal - pressure, integral)
            for goal, pressure, integral in zip(
                wanted, observation.pressure, memory.integrals, strict=True
            )
        ]
        openings, integrals = zip(*steps, strict=True)
        return openings, CascadeMemory(outer=outer, integrals=integrals)
