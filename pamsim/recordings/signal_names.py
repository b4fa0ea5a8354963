"""Names of a rig's signals, as channels of a recording and as columns of its files.

A signal is a quantity of a joint or of a muscle: ``knee.angle``, ``flexor.pressure``,
``flexor.force``. A rig with one joint that turns has short forms: ``angle``, ``pressure_1`` and
``force_1``, the muscles by number.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import DEG_PER_RAD, MM_PER_M, PA_PER_KPA


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of measured quantity.

    Attributes:
        unit: SI.
        shown: unit on screens and in files.
        scale: of the shown unit in an SI unit.
        suffix: end of a column's name.
    """

    unit: str
    shown: str
    scale: float
    suffix: str


KINDS: dict[str, Kind] = {
    "angle": Kind(unit="rad", shown="deg", scale=DEG_PER_RAD, suffix="deg"),
    "position": Kind(unit="m", shown="mm", scale=MM_PER_M, suffix="mm"),
    "pressure": Kind(unit="Pa", shown="kPa", scale=1.0 / PA_PER_KPA, suffix="kpa"),
    "force": Kind(unit="N", shown="N", scale=1.0, suffix="n"),
    "torque": Kind(unit="N*m", shown="N*m", scale=1.0, suffix="nm"),
}
"""Kind of a measured channel -> its units. A joint that turns has an angle, one that slides a
position; what is exerted on it from outside is a torque or a force."""

JOINT_KINDS = ("angle", "position")

EFFORTS = {"angle": "torque", "position": "force"}
"""Kind of a joint's position -> kind of what acts on the joint from outside."""

MOVES = {"angle": "turns", "position": "slides"}
_DRIVES = {"angle": ("torque", "angle"), "position": ("force", "length")}
"""Kind of a joint's position -> kinds of drive it may have."""

MUSCLE_COLUMNS: dict[str, tuple[str, str]] = {
    "valve": ("u{}", "{}_valve"),
    "pulse": ("u{}", "{}_valve"),
    "pressure_set": ("p{}_set_kpa", "{}_set_kpa"),
    "pressure": ("p{}_kpa", "{}_kpa"),
    "force": ("force{}_n", "{}_n"),
}
"""Quantity of a muscle -> its column by number, and by name."""


def kind_of(channel: str) -> str:
    """Kind of a channel: ``pressure`` of ``pressure_1`` and of ``flexor.pressure``."""
    return channel.rpartition(".")[2].split("_")[0]


def owner_of(channel: str) -> str:
    """Joint or muscle whose quantity a channel is; empty for a short form."""
    return channel.rpartition(".")[0]


def muscle_channels(kind: str, muscles: tuple[str, ...], count: int) -> tuple[str, ...]:
    """Channels of one kind of all muscles, in their order.

    Args:
        kind: ``pressure`` or ``force``.
        muscles: names; none for numbers.
        count: of the muscles.
    """
    if muscles:
        return tuple(f"{name}.{kind}" for name in muscles)
    return tuple(f"{kind}_{number}" for number in range(1, count + 1))


def muscle_columns(quantity: str, muscles: tuple[str, ...], count: int) -> tuple[str, ...]:
    """Columns of one quantity of all muscles, in their order.

    Args:
        quantity: one of `MUSCLE_COLUMNS`.
        muscles: names; none for numbers.
        count: of the muscles.
    """
    numbered, named = MUSCLE_COLUMNS[quantity]
    if muscles:
        return tuple(named.format(name) for name in muscles)
    return tuple(numbered.format(number) for number in range(1, count + 1))


def column_of(channel: str) -> str:
    """Column of a measured channel in a file: ``knee_deg`` of ``knee.angle``."""
    kind, owner = kind_of(channel), owner_of(channel)
    if owner:
        return f"{owner}_{KINDS[kind].suffix}"
    if channel in (*JOINT_KINDS, *EFFORTS.values()):
        return f"{channel}_{KINDS[kind].suffix}"
    return MUSCLE_COLUMNS[kind][0].format(channel.rpartition("_")[2])


@dataclass(frozen=True, kw_only=True)
class SignalNames:
    """What a rig records.

    Attributes:
        joints: recorded joint -> its kind, ``angle`` or ``position``.
        muscles: names, in actuator order.
    """

    joints: Mapping[str, str]
    muscles: tuple[str, ...]

    def __post_init__(self) -> None:
        """Refuse names whose columns a reader would take for others.

        Raises:
            InputError: such as for a muscle ``p1``, whose pressure would be that of muscle 1.
        """
        if self.short:
            return
        for name in self.muscles:
            if self.joints.get(name) == "position":
                raise InputError(
                    f"{name!r} is a muscle and a joint: {name}_n could be the force of either; give"
                    " one another name"
                )
            if re.fullmatch(r"[pu]\d+|force\d+|.*_set|.*_valve", name):
                raise InputError(
                    f"muscle {name!r}: the column {name}_kpa could mean another muscle or its set"
                    " point; give it another name"
                )

    @property
    def short(self) -> bool:
        """Whether the short forms are used: a single joint, which turns."""
        return tuple(self.joints.values()) == ("angle",)

    @property
    def named_muscles(self) -> tuple[str, ...]:
        """Names of the muscles in channels and columns; none where they have numbers."""
        return () if self.short else self.muscles

    @property
    def joint_channels(self) -> tuple[str, ...]:
        """Channel of each joint."""
        return tuple(map(self.joint_channel, self.joints))

    def joint_channel(self, joint: str) -> str:
        """Channel of one joint's position."""
        return "angle" if self.short else f"{joint}.{self.joints[joint]}"

    def effort_channel(self, joint: str) -> str:
        """Channel of the torque or force that acts on a joint from outside."""
        effort = EFFORTS[self.joints[joint]]
        return effort if self.short else f"{joint}.{effort}"

    def check_driven(self, driven: Mapping[str, str], where: str) -> None:
        """Refuse to drive joints that the rig does not record, or otherwise than they move.

        Args:
            driven: joint -> kind of its drive, see `pamsim.recordings.drive`.
            where: names the rig, for errors.

        Raises:
            InputError: naming the joint.
        """
        for joint, kind in driven.items():
            if joint not in self.joints:
                raise InputError(f"{where} has no joint {joint!r}; {nearest(joint, self.joints)}")
            moves = self.joints[joint]
            if kind not in _DRIVES[moves]:
                raise InputError(
                    f"{where}: joint {joint!r} {MOVES[moves]}, so that its drive is"
                    f" {' or '.join(_DRIVES[moves])}, not {kind}"
                )

    def of_muscles(self, kind: str) -> tuple[str, ...]:
        """Channel of each muscle, of the kind ``pressure`` or ``force``."""
        return muscle_channels(kind, self.named_muscles, len(self.muscles))

    def joint_columns(self) -> tuple[str, ...]:
        """Column of each joint in a file."""
        return tuple(map(column_of, self.joint_channels))

    def muscle_columns(self, quantity: str) -> tuple[str, ...]:
        """Column of each muscle in a file, of a quantity of `MUSCLE_COLUMNS`."""
        return muscle_columns(quantity, self.named_muscles, len(self.muscles))
