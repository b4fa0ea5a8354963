"""What was learned where nothing has a name, as a result states it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pamsim.core.encoding import json_property
from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.diagnosis.by_link.learned_shape import POSITION, LearnedShape
from pamsim.diagnosis.by_link.shape_description import description
from pamsim.engine.rig import Rig


@dataclass(frozen=True, kw_only=True)
class LearnedEntry:
    """A learned curve. It is a description of what is missing, not a name.

    Attributes:
        joint: on which it acts.
        over: ``position`` or ``speed`` of the joint.
        at: (n,) of them.
        at_unit: ``deg`` or ``m``, or the same per second.
        torque: (n,) in the direction in which the position grows.
        torque_unit: ``N*m``, or ``N`` on a joint that slides.
        resembles: closed form that follows it, see
            `pamsim.diagnosis.by_link.shape_description.Description`; empty for none.
        numbers: of that form, in these units.
        links: in which the curves are seen.
        before: mean square that is left there without all curves, in the variance of the noise.
        after: the same with them.
        p_value: of curves that predict no better.
    """

    joint: str
    over: str
    at: FloatArray
    at_unit: str
    torque: FloatArray
    torque_unit: str
    resembles: str
    numbers: Mapping[str, float] = field(default_factory=dict[str, float])
    links: tuple[str, ...]
    before: float
    after: float
    p_value: float

    @json_property
    def words(self) -> str:
        """The form that follows it, in words; empty for none."""
        n = {name: f"{value:.3g}" for name, value in self.numbers.items()}
        at, torque = self.at_unit, self.torque_unit
        match self.resembles:
            case "constant":
                return f"a constant {n['torque']} {torque}"
            case "spring":
                return f"a spring of {n['stiffness']} {torque}/{at}"
            case "stop":
                way = "up" if self.numbers["side"] > 0.0 else "down"
                return f"a stop from {n['begin']} {at} {way}, {n['stiffness']} {torque}/{at}"
            case "ripple":
                return f"a ripple of +-{n['amplitude']} {torque}, its period {n['period']} {at}"
            case "viscous":
                return f"viscous friction of {n['damping']} {torque} per {at}"
            case "quadratic":
                return f"a drag of {n['coefficient']} {torque} per ({at})^2"
            case "dry":
                return f"dry friction of {n['torque']} {torque}, built up within {n['speed']} {at}"
            case _:
                return ""


_AT = {"stiffness": -1, "damping": -1, "coefficient": -2, "begin": 1, "period": 1, "speed": 1}
"""Number of a form -> power of the unit of position or speed in it."""


def learned_entries(rig: Rig, shape: LearnedShape | None) -> tuple[LearnedEntry, ...]:
    """Every learned curve with what it looks like."""
    if shape is None:
        return ()
    found: list[LearnedEntry] = []
    for curve in shape.curves:
        turns = rig.joints[curve.joint] == "angle"
        scale = DEG_PER_RAD if turns else 1.0
        form = description(curve.over, curve.at, curve.torque)
        numbers = {} if form is None else form.numbers
        found.append(
            LearnedEntry(
                joint=curve.joint,
                over=curve.over,
                at=curve.at * scale,
                at_unit=("deg" if turns else "m") + ("" if curve.over == POSITION else "/s"),
                torque=curve.torque,
                torque_unit="N*m" if turns else "N",
                resembles="" if form is None else form.form,
                numbers={name: one * scale ** _AT.get(name, 0) for name, one in numbers.items()},
                links=tuple(link.name for link in shape.links),
                before=shape.before,
                after=shape.after,
                p_value=shape.p_value,
            )
        )
    return tuple(found)
