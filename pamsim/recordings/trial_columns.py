"""Which column of a trial's file is which command and which measured channel.

A file has its muscles either by number (``u1``, ``p1_set_kpa``, ``p1_kpa``, ``force1_n``, with one
joint's ``angle_deg``) or by name (``flexor_valve``, ``flexor_set_kpa``, ``flexor_kpa``,
``flexor_n``, with ``knee_deg`` of a joint that turns and ``slider_mm`` of one that slides). The
command columns decide.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from pamsim.core.errors import InputError
from pamsim.recordings.columns import Columns
from pamsim.recordings.drive import MUSCLE_DRIVES, Drive, DriveLike, command_columns
from pamsim.recordings.signal_names import (
    EFFORTS,
    JOINT_KINDS,
    KINDS,
    MUSCLE_COLUMNS,
    column_of,
    muscle_channels,
    muscle_columns,
)

_NUMBERED = (
    "time_s",
    "angle_deg",
    "torque_nm",
    *dict.fromkeys(n for n, _ in MUSCLE_COLUMNS.values()),
)
_BY_NUMBER = re.compile(r"u\d+|p\d+(_set)?_kpa")


@dataclass(frozen=True, kw_only=True)
class TrialColumns:
    """The columns of one trial's file.

    Attributes:
        columns: those that the format knows.
        muscles: names, in the order of their commands; none where muscles have numbers.
        drives: of each muscle and driven joint.
        command: column of each muscle's command, then of each driven joint; empty of one without.
        channels: column -> measured channel; also of columns that are not there.
    """

    columns: Columns
    muscles: tuple[str, ...]
    drives: Drive
    command: tuple[str, ...]
    channels: Mapping[str, str]


def trial_columns(columns: Columns, drive: DriveLike) -> TrialColumns:
    """Find the columns of a trial.

    Args:
        columns: of its file.
        drive: of all its muscles, or of each of them and of driven joints.

    Raises:
        InputError: if there is no command, a muscle is left out of it, or a column's name is so
            close to a known one that it must be meant.
    """
    muscles = _names(columns, drive)
    named = any(cell.startswith(f"{muscle}_") for muscle in muscles for cell in columns.cells)
    if not named or any(map(_BY_NUMBER.fullmatch, columns.cells)):
        return _by_number(columns.select(_NUMBERED), drive)
    drives = Drive.of(drive, len(muscles) if isinstance(drive, str) else len(drive))
    command = command_columns(drives, muscles)
    joints: dict[str, str] = {}
    for joint_kind in (*JOINT_KINDS, "torque"):
        end = f"_{KINDS[joint_kind].suffix}"
        names = [name for name in columns.cells if name.endswith(end)]
        joints |= {name: f"{name.removesuffix(end)}.{joint_kind}" for name in names}
    joints |= {f"{joint}_n": f"{joint}.force" for joint in drives.joints}
    channels = _channels(joints, muscles, len(muscles))
    own = [column for column in command if column]
    known = (name for q in MUSCLE_COLUMNS for name in muscle_columns(q, muscles, len(muscles)))
    selected = columns.select(("time_s", *own, *channels, *known))
    return _found(selected, muscles, drives, command, channels)


def _names(columns: Columns, drive: DriveLike) -> tuple[str, ...]:
    """Names of the muscles: those of the drive, or those of columns that hold it."""
    if not isinstance(drive, str):
        return tuple(name for name, kind in drive.items() if kind in MUSCLE_DRIVES)
    named = MUSCLE_COLUMNS[MUSCLE_DRIVES[drive].quantity or "pressure"][1]
    found = [re.fullmatch(named.replace("{}", "(.+?)"), name) for name in columns.cells]
    return tuple(match[1] for match in found if match and not match[1].endswith("_set"))


def _by_number(columns: Columns, drive: DriveLike) -> TrialColumns:
    # A muscle whose pressure was measured must be commanded, too.
    digits = re.findall(r"\d+", " ".join(columns.cells))
    count = max([1, *map(int, digits)]) if isinstance(drive, str) else len(drive)
    drives = Drive.of(drive, count)
    command = command_columns(drives, ())
    shown = ("angle", "torque") if drives.joints else ("angle",)
    joints = {column_of(channel): channel for channel in shown}
    channels = _channels(joints, (), len(drives.muscles))
    return _found(columns, (), drives, command, channels)


def _found(
    columns: Columns,
    muscles: tuple[str, ...],
    drives: Drive,
    command: tuple[str, ...],
    channels: Mapping[str, str],
) -> TrialColumns:
    for name, kind in zip(command, drives.kinds, strict=True):
        if name and name not in columns.cells:
            have = ", ".join((*columns.cells, *columns.ignored))
            raise InputError(
                f"{columns.path}: no command column {name!r}, which drive = {kind!r} needs: what"
                f" drives the simulation must be recorded (there are: {have})"
            )
    # What is given from outside is no measurement of the rig.
    given = [
        name for name, kind in zip(command, drives.kinds, strict=True) if kind in EFFORTS.values()
    ]
    return TrialColumns(
        columns=columns,
        muscles=muscles,
        drives=drives,
        command=command,
        channels={column: c for column, c in channels.items() if column not in given},
    )


def _channels(joints: Mapping[str, str], muscles: tuple[str, ...], count: int) -> dict[str, str]:
    """Column -> channel of pressures, joints and forces."""

    def of_muscles(kind: str) -> dict[str, str]:
        columns = muscle_columns(kind, muscles, count)
        return dict(zip(columns, muscle_channels(kind, muscles, count), strict=True))

    return {**of_muscles("pressure"), **joints, **of_muscles("force")}
