"""Signals of a rig: names as channels of a recording and columns of its files, and what drives it.

A signal is a quantity of a joint or of a muscle: ``knee.angle``, ``flexor.pressure``,
``flexor.force``. A rig with one joint that turns has short forms: ``angle``, ``pressure_1`` and
``force_1``, the muscles by number.

A drive is the air of each muscle, and what acts on a joint from outside. It is stated as one word
for all muscles, ``"pressure_set"``, or by name:
``{"flexor": "pressure_set", "extensor": "measured", "knee": "torque"}``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

from pamsim.core.errors import InputError, nearest, refuse_unknown
from pamsim.core.units import DEG_PER_RAD, MM_PER_M, PA_PER_KPA

DriveLike: TypeAlias = str | Mapping[str, str]
"""A drive as an experiment or a recording states it."""


class Kind(NamedTuple):
    """A quantity's SI unit, unit on screens and in files, its scale, and its columns' ending."""

    unit: str
    shown: str
    scale: float
    suffix: str


KINDS: dict[str, Kind] = {
    "angle": Kind("rad", "deg", DEG_PER_RAD, "deg"),
    "position": Kind("m", "mm", MM_PER_M, "mm"),
    "pressure": Kind("Pa", "kPa", 1.0 / PA_PER_KPA, "kpa"),
    "force": Kind("N", "N", 1.0, "n"),
    "torque": Kind("N*m", "N*m", 1.0, "nm"),
}
"""Kind of a measured channel -> its units. A joint that turns has an angle, one that slides a
position; what is exerted on it from outside is a torque or a force."""

EFFORTS = {"angle": "torque", "position": "force"}
"""Kind of a joint's position -> kind of what acts on the joint from outside."""
JOINT_KINDS = tuple(EFFORTS)
MOVES = {"angle": "turns", "position": "slides"}

NUMBERED = {
    "valve": "u{}",
    "pulse": "u{}",
    "pressure_set": "p{}_set_kpa",
    "pressure": "p{}_kpa",
    "force": "force{}_n",
}
"""Quantity of a muscle -> its column by number."""
ENDINGS = {kind: row.suffix for kind, row in KINDS.items()}
ENDINGS |= {"valve": "valve", "pulse": "valve", "pressure_set": "set_kpa"}
"""Quantity -> what its column by name ends in."""


class DriveKind(NamedTuple):
    """One way to drive a muscle, or a joint that has this kind of position.

    ``quantity`` names the column in a file that holds its values [``unit``], and is empty if it
    needs none. They run straight from one to the next if ``between``; else each is held.
    """

    of: str
    meaning: str
    unit: str
    quantity: str
    between: bool


_MEASURED = "measured gauge pressure, which the muscle has whatever valves and air would do"
_SEALED = "none: valves stay shut on the air of the start pressure"
_SET = "set point of the gauge pressure"
_ANGLE = "angle, imposed whatever torque that takes"
_LENGTH = "position, imposed whatever force that takes"
DRIVES: dict[str, DriveKind] = {
    "valve": DriveKind("muscle", "signed valve opening", "1", "valve", False),
    "pulse": DriveKind("muscle", "signed duty of a pulsed valve", "1", "pulse", False),
    "pressure_set": DriveKind("muscle", _SET, "Pa", "pressure_set", False),
    "measured": DriveKind("muscle", _MEASURED, "Pa", "pressure", True),
    "sealed": DriveKind("muscle", _SEALED, "1", "", False),
    "torque": DriveKind("angle", "torque on a joint that turns", "N*m", "torque", True),
    "force": DriveKind("position", "force on a joint that slides", "N", "force", True),
    "angle": DriveKind("angle", _ANGLE, "rad", "angle", True),
    "length": DriveKind("position", _LENGTH, "m", "position", True),
}
"""All drives; those of a joint count positive in the joint's positive direction."""
MUSCLE_DRIVES = {name: kind for name, kind in DRIVES.items() if kind.of == "muscle"}
JOINT_DRIVES = {name: kind for name, kind in DRIVES.items() if kind.of != "muscle"}
IMPOSED = tuple(name for name, kind in JOINT_DRIVES.items() if kind.quantity in JOINT_KINDS)
"""Drives of a joint that set its motion."""
MOTIONS = {JOINT_DRIVES[name].of: name for name in IMPOSED}
"""Kind of a joint's position -> drive that imposes it."""


def kind_of(channel: str) -> str:
    """Kind of a channel: ``pressure`` of ``pressure_1`` and of ``flexor.pressure``."""
    return channel.rpartition(".")[2].split("_")[0]


def owner_of(channel: str) -> str:
    """Joint or muscle whose quantity a channel is; empty for a short form."""
    return channel.rpartition(".")[0]


def muscle_channels(quantity: str, muscles: Sequence[str], count: int) -> tuple[str, ...]:
    """Channels of one quantity of `NUMBERED` of ``count`` muscles, by name if they have names."""
    if muscles:
        return tuple(f"{muscle}.{quantity}" for muscle in muscles)
    return tuple(f"{quantity}_{number + 1}" for number in range(count))


def column_of(channel: str) -> str:
    """A channel's column in a file, such as ``knee_deg`` of ``knee.angle``."""
    owner, _, quantity = channel.rpartition(".")
    if owner or channel in KINDS:
        return f"{owner or channel}_{ENDINGS[quantity]}"
    quantity, _, number = channel.rpartition("_")
    return NUMBERED[quantity].format(number)


@dataclass(frozen=True, kw_only=True)
class SignalNames:
    """What a rig records: joint -> its kind, ``angle`` or ``position``; muscles in their order."""

    joints: Mapping[str, str]
    muscles: tuple[str, ...]

    def __post_init__(self) -> None:
        """Refuse names whose columns a reader would take for others.

        Raises:
            InputError: such as for a muscle ``p1``, whose pressure would be that of muscle 1.
        """
        for name in self.named_muscles:
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

    def of_muscles(self, quantity: str) -> tuple[str, ...]:
        """Channel of each muscle, such as of its ``pressure`` or ``force``."""
        return muscle_channels(quantity, self.named_muscles, len(self.muscles))

    def check_driven(self, driven: Mapping[str, str], where: str) -> None:
        """Refuse joints -> kind of drive that a rig ``where`` has not or that move otherwise."""
        for joint, kind in driven.items():
            refuse_unknown(joint, self.joints, f"{where} has no joint {joint!r}")
            moves = self.joints[joint]
            if DRIVES[kind].of != moves:
                known = [name for name, drive in JOINT_DRIVES.items() if drive.of == moves]
                raise InputError(
                    f"{where}: joint {joint!r} {MOVES[moves]}, so that its drive is"
                    f" {' or '.join(known)}, not {kind}"
                )


@dataclass(frozen=True, kw_only=True)
class Drive:
    """A resolved drive, whose values are columns: one per muscle, then one per driven joint."""

    muscles: tuple[str, ...]  # kind of each muscle's, of `MUSCLE_DRIVES`
    names: tuple[str, ...] = ()  # of the muscles; none if they go by order
    # driven joint -> its kind, of `JOINT_DRIVES`
    joints: Mapping[str, str] = field(default_factory=dict[str, str])

    @classmethod
    def of(cls, stated: DriveLike, columns: int) -> Drive:
        """Resolve a drive, one kind for all muscles or name -> kind, of so many columns of values.

        Raises:
            InputError: for an unknown kind, or another number of columns.
        """
        if isinstance(stated, str):
            return cls(muscles=(checked(stated, MUSCLE_DRIVES),) * columns)
        for name, kind in stated.items():
            checked(kind, DRIVES, f" of {name!r}")
        if len(stated) != columns:
            raise InputError(
                f"the drive is of {', '.join(stated) or 'nothing'}; there are {columns} columns of"
                " values, and each muscle and each driven joint has one"
            )
        muscles = {name: kind for name, kind in stated.items() if kind in MUSCLE_DRIVES}
        joints = {name: kind for name, kind in stated.items() if kind in JOINT_DRIVES}
        return cls(muscles=tuple(muscles.values()), names=tuple(muscles), joints=joints)

    def stated(self, names: Sequence[str]) -> DriveLike:
        """The shortest form that `of` resolves to it, with the muscles' names."""
        if not self.joints and len(set(self.muscles)) == 1:
            return self.muscles[0]
        return {**dict(zip(names, self.muscles, strict=True)), **self.joints}

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kind of every column: of the muscles, then of the joints."""
        return (*self.muscles, *self.joints.values())

    @property
    def between(self) -> tuple[bool, ...]:
        """Of every column, whether values run straight from one to the next."""
        return tuple(DRIVES[kind].between for kind in self.kinds)

    @property
    def imposed(self) -> tuple[str, ...]:
        """Joints whose motion is imposed."""
        return tuple(joint for joint, kind in self.joints.items() if kind in IMPOSED)

    @property
    def all_measured(self) -> bool:
        """Whether every muscle has its measured pressure."""
        return set(self.muscles) == {"measured"}

    def order(self, muscles: Sequence[str], where: str) -> list[int]:
        """Columns in the order of a rig's muscles, then of the driven joints.

        Raises:
            InputError: naming the rig by ``where``, if a muscle is missing or none of the rig's.
        """
        count = len(self.muscles)
        if not self.names and count != len(muscles):
            raise InputError(
                f"{where} has {len(muscles)} muscles ({', '.join(muscles)}), the drive has"
                f" {count}: give a number for each, in this order"
            )
        names = self.names or tuple(muscles)
        for name in names:
            refuse_unknown(name, muscles, f"{where} has no muscle {name!r}")
        for name in muscles:
            if name not in names:
                raise InputError(f"{where} has a muscle {name!r}: give its drive")
        return [*map(names.index, muscles), *range(count, count + len(self.joints))]


def checked(kind: object, known: Mapping[str, DriveKind], whose: str = "") -> str:
    """A kind of drive, if it is known; InputError with the nearest one, if not."""
    if not isinstance(kind, str) or kind not in known:
        raise InputError(f"no drive {kind!r}{whose}; {nearest(str(kind), known)}")
    return kind


def command_columns(drives: Drive, muscles: tuple[str, ...]) -> tuple[str, ...]:
    """Column in a file of each muscle's and driven joint's command; empty of a sealed muscle.

    ``muscles`` are names; none where muscles have numbers, and the only joint no name.
    """
    count = len(drives.muscles)
    quantities = [DRIVES[kind].quantity for kind in drives.kinds]
    channels = [muscle_channels(q, muscles, count)[i] for i, q in enumerate(quantities[:count])]
    joints = zip(drives.joints, quantities[count:], strict=True)
    channels += [f"{joint}.{quantity}" if muscles else quantity for joint, quantity in joints]
    return tuple(column_of(c) if q else "" for c, q in zip(channels, quantities, strict=True))


def in_toml(value: object) -> str:
    """A text, a number, a list of them or a drive, as ``recording.toml`` states it."""
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{in_toml(n)} = {in_toml(kind)}' for n, kind in value.items())} }}"
    # A JSON string is a TOML basic string, unless it escapes what lies beyond U+FFFF.
    return json.dumps(value, ensure_ascii=False)
