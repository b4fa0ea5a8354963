"""What drives a trial: the air of each muscle, and what acts on a joint from outside.

Stated as one word for all muscles, ``"pressure_set"``, or by name:
``{"flexor": "pressure_set", "extensor": "measured", "knee": "torque"}``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from pamsim.core.errors import InputError, nearest
from pamsim.recordings.signal_names import column_of, muscle_columns

DriveLike: TypeAlias = str | Mapping[str, str]
"""As an experiment or a recording states it."""


@dataclass(frozen=True, kw_only=True)
class DriveKind:
    """One way to drive a muscle or a joint.

    Attributes:
        meaning: of its values.
        unit: SI unit of its values.
        quantity: whose column in a file holds them; empty if it needs none.
        between: True if values run straight from one to the next, False if each is held.
    """

    meaning: str
    unit: str
    quantity: str
    between: bool


MUSCLE_DRIVES: dict[str, DriveKind] = {
    "valve": DriveKind(meaning="signed valve opening", unit="1", quantity="valve", between=False),
    "pulse": DriveKind(
        meaning="signed duty of a pulsed valve", unit="1", quantity="pulse", between=False
    ),
    "pressure_set": DriveKind(
        meaning="set point of the gauge pressure", unit="Pa", quantity="pressure_set", between=False
    ),
    "measured": DriveKind(
        meaning="measured gauge pressure, which the muscle has whatever valves and air would do",
        unit="Pa",
        quantity="pressure",
        between=True,
    ),
    "sealed": DriveKind(
        meaning="none: valves stay shut on the air of the start pressure",
        unit="1",
        quantity="",
        between=False,
    ),
}
"""Of a muscle."""

JOINT_DRIVES: dict[str, DriveKind] = {
    "torque": DriveKind(
        meaning="torque on a joint that turns", unit="N*m", quantity="torque", between=True
    ),
    "force": DriveKind(
        meaning="force on a joint that slides", unit="N", quantity="force", between=True
    ),
    "angle": DriveKind(
        meaning="angle, imposed whatever torque that takes",
        unit="rad",
        quantity="angle",
        between=True,
    ),
    "length": DriveKind(
        meaning="position, imposed whatever force that takes",
        unit="m",
        quantity="position",
        between=True,
    ),
}
"""Of a joint, from outside; positive in the joint's positive direction."""

IMPOSED = ("angle", "length")
"""Drives of a joint that set its motion."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """A resolved drive, whose values are columns: one per muscle, then one per driven joint.

    Attributes:
        muscles: kind of each muscle's, of `MUSCLE_DRIVES`.
        names: of the muscles; none if they go by order.
        joints: driven joint -> its kind, of `JOINT_DRIVES`.
    """

    muscles: tuple[str, ...]
    names: tuple[str, ...] = ()
    joints: Mapping[str, str] = field(default_factory=dict[str, str])

    @classmethod
    def of(cls, stated: DriveLike, columns: int) -> Drive:
        """Resolve a drive.

        Args:
            stated: one kind for all muscles, or muscle or joint -> kind.
            columns: of its values.

        Raises:
            InputError: for an unknown kind, or another number of columns.
        """
        if isinstance(stated, str):
            return cls(muscles=(checked(stated, MUSCLE_DRIVES),) * columns)
        kinds = {**MUSCLE_DRIVES, **JOINT_DRIVES}
        given = {name: checked(kind, kinds, f" of {name!r}") for name, kind in stated.items()}
        if len(given) != columns:
            raise InputError(
                f"the drive is of {', '.join(given) or 'nothing'}; there are {columns} columns of"
                " values, and each muscle and each driven joint has one"
            )
        muscles = {name: kind for name, kind in given.items() if kind in MUSCLE_DRIVES}
        joints = {name: kind for name, kind in given.items() if kind in JOINT_DRIVES}
        return cls(muscles=tuple(muscles.values()), names=tuple(muscles), joints=joints)

    def stated(self, names: Sequence[str]) -> DriveLike:
        """The shortest form that `of` resolves to it.

        Args:
            names: of the muscles.
        """
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
        return tuple({**MUSCLE_DRIVES, **JOINT_DRIVES}[kind].between for kind in self.kinds)

    @property
    def imposed(self) -> tuple[str, ...]:
        """Joints whose motion is imposed."""
        return tuple(joint for joint, kind in self.joints.items() if kind in IMPOSED)

    @property
    def all_measured(self) -> bool:
        """Whether every muscle has its measured pressure."""
        return set(self.muscles) == {"measured"}

    def order(self, muscles: Sequence[str], where: str) -> list[int]:
        """Columns in a rig's order: of each of its muscles, then of the driven joints.

        Args:
            muscles: of the rig, in actuator order.
            where: whose drive it is, and of which rig, for errors.

        Raises:
            InputError: if a muscle is missing, or a name is none of the rig's.
        """
        count = len(self.muscles)
        joints = range(count, count + len(self.joints))
        if not self.names:
            if count != len(muscles):
                raise InputError(f"the drive commands {count} muscles, {where} has {len(muscles)}")
            return [*range(count), *joints]
        for name in self.names:
            if name not in muscles:
                raise InputError(f"{where} has no muscle {name!r}; {nearest(name, muscles)}")
        for name in muscles:
            if name not in self.names:
                raise InputError(f"{where} has a muscle {name!r}: give its drive")
        return [*(self.names.index(name) for name in muscles), *joints]


def command_columns(drives: Drive, muscles: tuple[str, ...]) -> tuple[str, ...]:
    """Column in a file of each muscle's command and each joint's drive; empty for a sealed muscle.

    Args:
        drives: of a trial.
        muscles: names; none where muscles have numbers, and the only joint no name.
    """
    count = len(drives.muscles)
    quantities = [MUSCLE_DRIVES[kind].quantity for kind in drives.muscles]
    joints = [(joint, JOINT_DRIVES[kind].quantity) for joint, kind in drives.joints.items()]
    return (
        *(muscle_columns(q, muscles, count)[i] if q else "" for i, q in enumerate(quantities)),
        *(column_of(f"{joint}.{quantity}" if muscles else quantity) for joint, quantity in joints),
    )


def in_toml(drive: DriveLike) -> str:
    """A drive as ``recording.toml`` states it."""
    # A JSON string is a TOML basic string.
    if isinstance(drive, str):
        return json.dumps(drive, ensure_ascii=False)
    each = (f"{json.dumps(n, ensure_ascii=False)} = {json.dumps(k)}" for n, k in drive.items())
    return f"{{ {', '.join(each)} }}"


def checked(kind: object, known: Mapping[str, DriveKind], whose: str = "") -> str:
    """A kind of drive, if it is known.

    Raises:
        InputError: with the nearest one, if not.
    """
    if not isinstance(kind, str) or kind not in known:
        raise InputError(f"no drive {kind!r}{whose}; {nearest(str(kind), known)}")
    return kind
