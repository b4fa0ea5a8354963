"""The interface of controllers: observation and memory in, command and memory out.

A controller is a frozen set of numbers. Its memory goes in and comes out as a value, so that a run
can be stopped, copied and continued, and one controller can serve many rigs at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.recordings.experiment import Experiment

Memory: TypeAlias = Any
"""What one controller keeps from sample to sample; of its own kind, never changed in place."""

Command: TypeAlias = tuple[float, ...]
"""Of each muscle: pressure set points, gauge [Pa], or valve openings in [-1, 1]."""


@dataclass(frozen=True, kw_only=True, slots=True)
class JointObservation:
    """Measured motion and reference of one joint at a sample.

    Attributes:
        position: measured [rad or m].
        velocity: of the measured position [per s].
        reference: wanted position at the next sample [rad or m].
        reference_rate: its first derivative [per s].
        reference_acceleration: its second derivative [per s^2].
        stiffness: wanted of the joint [N m/rad or N/m]; None if the task leaves it free.
    """

    position: float
    velocity: float
    reference: float
    reference_rate: float = 0.0
    reference_acceleration: float = 0.0
    stiffness: float | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class Observation:
    """What a controller sees at a sample.

    Attributes:
        time: since the start [s].
        joints: in the order of the rig's.
        pressure: measured, of each muscle, gauge [Pa].
    """

    time: float
    joints: tuple[JointObservation, ...]
    pressure: tuple[float, ...]

    @property
    def joint(self) -> JointObservation:
        """The joint of a rig that has one.

        Raises:
            InputError: if there are several.
        """
        if len(self.joints) != 1:
            raise InputError(
                f"this controller drives one joint, the rig has {len(self.joints)};"
                " pamsim.controllers.joint_control drives any number"
            )
        return self.joints[0]


class Controller(Protocol):
    """Turns an observation into a command, once per sampling period."""

    @property
    def command(self) -> str:
        """What is commanded: ``pressure_set`` or ``valve``."""
        ...

    def start(self, first: Observation) -> Memory:
        """Memory before the first sample, the rig being at rest."""
        ...

    def step(self, observation: Observation, memory: Memory) -> tuple[Command, Memory]:
        """Command from now on, and the memory for the next sample."""
        ...


@dataclass(frozen=True, kw_only=True)
class PressureSplit:
    """Makes pressures of a difference.

    Attributes:
        common: p0, mean of both pressures where neither is limited, gauge [Pa].
        supply: highest pressure there is, gauge [Pa].

    Raises:
        InputError: if the common pressure is not between 0 and the supply.
    """

    common: float
    supply: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.common <= self.supply:
            raise InputError(
                f"common pressure {self.common / 1e3:g} kPa is not between 0 and the supply's"
                f" {self.supply / 1e3:g} kPa; choose one that is"
            )

    def pressures(self, difference: float) -> Command:
        """Pressures of muscles 1 and 2 for a wanted difference p1 - p2, gauge [Pa]."""
        wanted = self.common + 0.5 * difference, self.common - 0.5 * difference
        return tuple(min(max(pressure, 0.0), self.supply) for pressure in wanted)

    def given(self, difference: float) -> float:
        """Difference [Pa] that remains of a wanted one after the limits."""
        first, second = self.pressures(difference)
        return first - second

    def experiment(self, time: FloatArray, differences: FloatArray, **more: Any) -> Experiment:
        """Run that starts at the first of some differences (n,) [Pa], each set at a time (n,) [s].

        ``more`` are other attributes of `Experiment`, such as its duration.
        """
        command = np.array([self.pressures(each) for each in differences.tolist()])
        own = {"command_time": time, "command_value": command, "start_pressure": command[0]}
        return Experiment(drive="pressure_set", **own, **more)

    def beyond(self, difference: float) -> bool:
        """Whether the limits reduce a wanted difference [Pa]."""
        return 0.5 * abs(difference) > min(self.common, self.supply - self.common)


def present_reference(joint: JointObservation, period: float) -> tuple[float, float]:
    """Reference [rad or m] and its rate at the present sample, one period [s] earlier.

    The acceleration is taken as constant meanwhile. A negative period looks ahead.
    """
    acceleration = joint.reference_acceleration
    rate = joint.reference_rate - period * acceleration
    return joint.reference - period * (joint.reference_rate - 0.5 * period * acceleration), rate
