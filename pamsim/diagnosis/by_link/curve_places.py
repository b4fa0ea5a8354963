"""Learned curves: kinds, the places where they act, and their control values there.

Torques on a joint are forces along a tendon that runs over it alone.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pamsim.comparison.links import JOINT, MUSCLE, VALVES
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.sizes import SizeErrors
from pamsim.physics.learned import LENGTH, RUB, SPEED
from pamsim.physics.spline import shares


class Kind(StrEnum):
    """What a curve runs over, and what it is."""

    POSITION = "a torque over the position"
    RATE = "a torque over the speed"
    PRESSED = "a tension per pressure over the contraction"
    UNPRESSED = "a tension over the contraction"
    READING = "an error of the sensor over the position"
    FLOW = "a change of the flow over the opening"
    FRICTION = "a dry friction over the position"
    ARM = "a change of the moment arm over the position"

    @property
    def over(self) -> str:
        """What it runs over: ``position``, ``speed``, ``contraction`` or ``opening``."""
        return self.rpartition(" ")[2]

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts of the chain in which it acts."""
        if self is Kind.FLOW:
            return (VALVES,)
        # The motion that a muscle is given is read as well, and its length follows from the arm.
        if self in (Kind.READING, Kind.ARM):
            return MUSCLE, JOINT
        return (MUSCLE,) if self in (Kind.PRESSED, Kind.UNPRESSED) else (JOINT,)


MUSCLES, ALL_VALVES = "the muscles", "the valves"
"""Where a curve acts that all muscles have."""

POINTS = 60  # of a curve that is written


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A learned curve."""

    kind: Kind  # of curve
    acts_at: str  # joint, muscle, `MUSCLES` or `ALL_VALVES`
    # (n,) from one end of what was visited to the other: positions [rad or m], speeds [the same per
    # s], contractions [-], or signed openings, fill above 0 [-]
    at: FloatArray
    # (n,) torque in the direction in which the position grows [N m or N], dry friction [the same],
    # tension [N], tension per pressure [m^2], read less true position [rad or m], or change of the
    # flow or the moment arm as a share of it [-]
    value: FloatArray
    # (n,) half width of its 95 % band; infinite where the data do not show the curve
    reach: FloatArray
    joint: str = ""  # over whose position or speed it runs


@dataclass(frozen=True, kw_only=True)
class EvenPlace:
    """A place whose curves have control values that are spread evenly over what was visited."""

    acts_at: str  # as of its curves
    joint: str = ""  # as of its curves
    ends_at: str  # beginning of the names of the parameters of the ends
    at: FloatArray  # (n,) what its curves are written over, from one end to the other
    along: FloatArray  # (n,) what the parameters have them run over there, in its units
    fields: Mapping[Kind, str]  # kind of curve -> beginning of the names of its control values
    count: int  # control values of each curve

    @property
    def _range(self) -> tuple[float, float]:
        return float(self.along.min()), float(self.along.max())

    def ends(self, kinds: Collection[Kind]) -> dict[str, float]:
        """Parameters of the ends that its curves share."""
        if not set(kinds) & self.fields.keys():
            return {}
        low, high = self._range
        return {f"{self.ends_at}low": low, f"{self.ends_at}high": high}

    def controls(self, kind: Kind) -> Sequence[str]:
        """Names of the control values of a curve."""
        field = self.fields.get(kind)
        return [f"{field}{k}" for k in range(1, self.count + 1)] if field else ()

    def curves(
        self, kinds: Sequence[Kind], values: Mapping[str, float], errors: SizeErrors
    ) -> Iterator[Curve]:
        """The learned curves as sums of their control values."""
        of_each = shares(self.along, *self._range, self.count)
        for kind in (one for one in kinds if one in self.fields):
            names = self.controls(kind)
            yield Curve(
                kind=kind,
                acts_at=self.acts_at,
                joint=self.joint,
                at=self.at,
                value=of_each @ [values[name] for name in names],
                reach=errors.reach(dict(zip(names, of_each.T, strict=True))),
            )


_CONTROLS = {
    Kind.POSITION: ("force_", LENGTH),
    Kind.RATE: ("drag_", SPEED),
    Kind.FRICTION: ("rub_", RUB),
}
"""Beginning of the names of the control forces of a curve on a joint, and how many there are."""

_SLOWEST, _TURN, _FASTEST = 0.005, 0.05, 0.5
"""Share of the fastest visited speed within which a learned dry friction is built up: least, first
and largest one. Faster turns are not seen in measured positions, and slower ones are a curve over
the speed."""


@dataclass(frozen=True)
class JointPlace:
    """A joint, the tendon of the muscle that stands for it, and what was visited of both."""

    joint: str
    muscle: str
    at: FloatArray  # (n,) positions from one end to the other [rad or m]
    rates: tuple[float, float]  # slowest and fastest change of the position [per s]
    length: FloatArray  # (n,) of the tendon at the positions [m]
    arm: FloatArray  # (n,) change of that length with the position

    @property
    def middle(self) -> float:
        """The arm that speeds of the tendon are taken with."""
        return float(np.mean(self.arm))

    def ends(self, kinds: Collection[Kind]) -> dict[str, float]:
        """Parameters of the ends of its curves, of what was visited [SI]."""
        slowest, fastest = sorted(self.middle * one for one in self.rates)
        shortest, longest = float(self.length.min()), float(self.length.max())
        values = {
            Kind.POSITION: {"low": shortest, "high": longest},
            Kind.RATE: {"slowest": slowest, "fastest": fastest},
            Kind.FRICTION: {
                "rub_low": shortest,
                "rub_high": longest,
                "rub_speed": _TURN * max(-slowest, fastest),
            },
        }
        return {
            f"{self.muscle}:learned.{name}": value
            for kind in values
            if kind in kinds
            for name, value in values[kind].items()
        }

    def speeds(self, kind: Kind) -> dict[str, tuple[float, float, float]]:
        """Name of the speed in which a dry friction is built up -> where a fit begins, and ends."""
        if kind is not Kind.FRICTION:
            return {}
        name = f"{self.muscle}:learned.rub_speed"
        first = self.ends((kind,))[name]
        return {name: (first, _SLOWEST / _TURN * first, _FASTEST / _TURN * first)}

    def controls(self, kind: Kind) -> Sequence[str]:
        """Names of the control forces of a curve; none of a kind that it has not."""
        field, count = _CONTROLS.get(kind, ("", 0))
        return [f"{self.muscle}:learned.{field}{k}" for k in range(1, count + 1)]

    @property
    def brakes(self) -> str:
        """Name of the parameter that keeps curves over speed and dry friction from driving."""
        return f"{self.muscle}:learned.brakes"

    def without_drag_at_rest(self, values: Mapping[str, float]) -> dict[str, float]:
        """Control forces of the same curves over length and speed, the latter 0 at rest."""
        drags, forces = self.controls(Kind.RATE), self.controls(Kind.POSITION)
        slowest, fastest = self.ends((Kind.RATE,)).values()
        (of_each,) = shares(np.zeros(1), slowest, fastest, len(drags))
        at_rest = float(of_each @ [values[name] for name in drags])
        return {name: values[name] - at_rest for name in drags} | {
            name: values[name] + at_rest for name in forces
        }

    def curves(
        self, kinds: Sequence[Kind], values: Mapping[str, float], errors: SizeErrors
    ) -> Iterator[Curve]:
        """The learned curves as torques on the joint.

        They are sums of the control forces. A constant may lie in the curve over position or in
        that over speed. Where there are both, the one over speed is 0 at rest.
        """
        both = {Kind.POSITION, Kind.RATE} <= set(kinds)
        at_rest = self._columns(Kind.RATE, np.zeros(1)) if both else {}
        for kind in (one for one in kinds if one in _CONTROLS):
            at = np.linspace(*self.rates, POINTS) if kind is Kind.RATE else self.at
            columns = self._columns(kind, at)
            if kind is Kind.RATE:
                columns = {n: column - at_rest.get(n, 0.0) for n, column in columns.items()}
            elif kind is Kind.POSITION:
                columns |= {n: self.arm / self.middle * torque for n, torque in at_rest.items()}
            yield Curve(
                kind=kind,
                acts_at=self.joint,
                joint=self.joint,
                at=at,
                value=sum((values[n] * column for n, column in columns.items()), np.zeros(POINTS)),
                reach=errors.reach(columns),
            )

    def _columns(self, kind: Kind, at: FloatArray) -> dict[str, FloatArray]:
        """Control force -> torque (n,) of one newton of it at positions or speeds (n,)."""
        along, arm, names = self.middle * at, self.middle, self.controls(kind)
        if kind is not Kind.RATE:
            along, arm = (np.interp(at, self.at, of) for of in (self.length, self.arm))
        # A force against lengthening pulls the joint to where the tendon is shorter; that against
        # the motion does either way.
        pulled = np.abs(arm) if kind is Kind.FRICTION else -arm
        low, high, *_ = self.ends((kind,)).values()
        of_each = shares(along, low, high, len(names))
        return dict(zip(names, (pulled * of_each.T), strict=True))


Place = EvenPlace | JointPlace
"""Something of which curves are learned: joint, sensor, tendon, muscles or their valves."""
