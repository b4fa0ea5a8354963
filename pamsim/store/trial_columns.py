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
from pamsim.core.signal_names import (
    COMMAND_QUANTITY,
    JOINT_KINDS,
    KINDS,
    MUSCLE_COLUMNS,
    muscle_channels,
    muscle_columns,
)
from pamsim.store.columns import Columns

_NUMBERED = ("time_s", "angle_deg", *dict.fromkeys(n for n, _ in MUSCLE_COLUMNS.values()))


@dataclass(frozen=True, kw_only=True)
class TrialColumns:
    """The columns of one trial's file.

    Attributes:
        columns: those that the format knows.
        muscles: names, in the order of their commands; none where muscles have numbers.
        command: column of each muscle's command.
        channels: column -> measured channel; also of columns that are not there.
    """

    columns: Columns
    muscles: tuple[str, ...]
    command: tuple[str, ...]
    channels: Mapping[str, str]


def trial_columns(columns: Columns, kind: str) -> TrialColumns:
    """Find the columns of a trial.

    Args:
        columns: of its file.
        kind: of its command: ``valve``, ``pulse``, ``pressure`` or ``measured``.

    Raises:
        InputError: if there is no command, a muscle is left out of it, or a column's name is so
            close to a known one that it must be meant.
    """
    named = MUSCLE_COLUMNS[COMMAND_QUANTITY[kind]][1]
    found = [re.fullmatch(named.replace("{}", "(.+?)"), name) for name in columns.cells]
    muscles = tuple(match[1] for match in found if match and not match[1].endswith("_set"))
    if not muscles or any(re.fullmatch(r"u\d+|p\d+(_set)?_kpa", name) for name in columns.cells):
        return _by_number(columns.select(_NUMBERED), kind)
    command = muscle_columns(COMMAND_QUANTITY[kind], muscles, len(muscles))
    joints: dict[str, str] = {}
    for joint_kind in JOINT_KINDS:
        end = f"_{KINDS[joint_kind].suffix}"
        names = [name for name in columns.cells if name.endswith(end)]
        joints |= {name: f"{name.removesuffix(end)}.{joint_kind}" for name in names}
    channels = _channels(joints, muscles, len(muscles))
    known = (name for q in MUSCLE_COLUMNS for name in muscle_columns(q, muscles, len(muscles)))
    selected = columns.select(("time_s", *command, *channels, *known))
    return TrialColumns(columns=selected, muscles=muscles, command=command, channels=channels)


def _by_number(columns: Columns, kind: str) -> TrialColumns:
    # A muscle whose pressure was measured must be commanded, too.
    count = max([1, *(int(digits) for digits in re.findall(r"\d+", " ".join(columns.cells)))])
    command = muscle_columns(COMMAND_QUANTITY[kind], (), count)
    for name in command:
        if name not in columns.cells:
            have = ", ".join((*columns.cells, *columns.ignored))
            raise InputError(
                f"{columns.path}: no command column {name!r}, which command = {kind!r} needs: what"
                f" drives the simulation must be recorded (there are: {have})"
            )
    channels = _channels({"angle_deg": "angle"}, (), count)
    return TrialColumns(columns=columns, muscles=(), command=command, channels=channels)


def _channels(joints: Mapping[str, str], muscles: tuple[str, ...], count: int) -> dict[str, str]:
    """Column -> channel of pressures, joints and forces."""

    def of_muscles(kind: str) -> dict[str, str]:
        columns = muscle_columns(kind, muscles, count)
        return dict(zip(columns, muscle_channels(kind, muscles, count), strict=True))

    return {**of_muscles("pressure"), **joints, **of_muscles("force")}
