"""A curve that was learned of what has no name, and the place that it acts at."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from pamsim.comparison.links import JOINT, MUSCLE, VALVES
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.sizes import SizeErrors


class Kind(StrEnum):
    """What a curve runs over, and what it is."""

    POSITION = "a torque over the position"
    RATE = "a torque over the speed"
    PRESSED = "a tension per pressure over the contraction"
    UNPRESSED = "a tension over the contraction"
    READING = "an error of the sensor over the position"
    FLOW = "a change of the flow over the opening"

    @property
    def over(self) -> str:
        """What it runs over: ``position``, ``speed``, ``contraction`` or ``opening``."""
        return self.rpartition(" ")[2]

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts of the chain in which it acts."""
        if self is Kind.FLOW:
            return (VALVES,)
        if self is Kind.READING:  # the motion that a muscle is given is read as well
            return MUSCLE, JOINT
        return (MUSCLE,) if self in (Kind.PRESSED, Kind.UNPRESSED) else (JOINT,)


MUSCLES, ALL_VALVES = "the muscles", "the valves"
"""Where a curve acts that all muscles have."""

POINTS = 60  # of a curve that is written


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A learned curve.

    Attributes:
        kind: of curve.
        acts_at: joint, `MUSCLES` or `ALL_VALVES`.
        at: (n,) from one end of what was visited to the other: positions [rad or m], speeds [the
            same per s], contractions [-], or signed openings, fill above 0 [-].
        value: (n,) torque in the direction in which the position grows [N m or N], tension [N],
            tension per pressure [m^2], read less true position [rad or m], or change of the flow
            as a share of it [-].
        reach: (n,) half width of its 95 % band; infinite where the data do not show the curve.
    """

    kind: Kind
    acts_at: str
    at: FloatArray
    value: FloatArray
    reach: FloatArray


class Place(Protocol):
    """Something of which curves are learned: a joint, its sensor, the muscles or their valves."""

    def ends(self, kinds: Collection[Kind]) -> dict[str, float]:
        """Parameters of the ends of its curves, from one end of what was visited to the other."""
        ...

    def controls(self, kind: Kind) -> Sequence[str]:
        """Names of the control values of a curve; none of a kind that it has not."""
        ...

    def curves(
        self, kinds: Sequence[Kind], values: Mapping[str, float], errors: SizeErrors
    ) -> Iterator[Curve]:
        """Its curves, of control values [SI]."""
        ...
