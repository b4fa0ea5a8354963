"""The interface of controllers: observation and memory in, command and memory out.

A controller is a frozen set of numbers. Its memory goes in and comes out as a value, so that a run
can be stopped, copied and continued, and one controller can serve many arms at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

Memory: TypeAlias = Any
"""What one controller keeps from sample to sample; of its own kind, never changed in place."""

Command: TypeAlias = tuple[float, float]
"""Of muscles 1 and 2: pressure set points, gauge [Pa], or valve openings in [-1, 1]."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Observation:
    """Measured signals and reference at a sample.

    Attributes:
        time: since the start [s].
        angle: measured [rad].
        velocity: of the measured angle [rad/s].
        pressure: measured, of muscles 1 and 2, gauge [Pa].
        reference: wanted angle at the next sample [rad].
        reference_rate: its first derivative [rad/s].
        reference_acceleration: its second derivative [rad/s^2].
        stiffness: wanted stiffness of the joint [N m/rad]; None if the task leaves it free.
    """

    time: float
    angle: float
    velocity: float
    pressure: tuple[float, float]
    reference: float
    reference_rate: float = 0.0
    reference_acceleration: float = 0.0
    stiffness: float | None = None


class Controller(Protocol):
    """Turns an observation into a command, once per sampling period."""

    @property
    def command(self) -> str:
        """What is commanded: ``pressure`` or ``valve``."""
        ...

    def start(self, first: Observation) -> Memory:
        """Memory before the first sample, the arm being at rest."""
        ...

    def act(self, observation: Observation, memory: Memory) -> tuple[Command, Memory]:
        """Command from now on, and the memory for the next sample."""
        ...
