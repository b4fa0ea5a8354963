"""Measured trials under the names of the rig that they are compared with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from pamsim.core.errors import InputError, nearest
from pamsim.recordings.signal_names import (
    EFFORTS,
    JOINT_KINDS,
    KINDS,
    MOVES,
    SignalNames,
    kind_of,
    owner_of,
)
from pamsim.recordings.trial import Trial


def of_rig(trial: Trial, names: SignalNames, rig: str) -> tuple[Trial, tuple[str, ...]]:
    """A trial with its channels and commands as a rig names and orders them.

    Args:
        trial: as its file names them.
        names: of the rig's signals.
        rig: its name, for messages.

    Returns:
        The trial, and notes on channels that the rig does not record.

    Raises:
        InputError: if the trial does not command each of the rig's muscles, drives a joint that the
            rig does not record or as it does not move, gives the angle of a rig with several joints
            without a name, or a joint in a unit that it does not move in.
    """
    columns = _order(trial, names, rig)
    order = columns[: trial.muscles]
    names.check_driven(trial.drives.joints, f"{trial.name!r}: rig {rig!r}")
    channels = _channels(trial, names, order)
    measured = {channels[c]: v for c, v in trial.measured.items() if c in channels}
    left = [channel for channel in trial.measured if channel not in channels]
    for channel in left:
        _refuse_other_joint(trial, channel, names, rig)
    known = ", ".join((*names.joints, *names.muscles))
    lead = trial.lead_in
    if lead is not None:
        start = lead.start_pressure[order]
        lead = replace(lead, command=lead.command[:, columns], start_pressure=start)
    drives = trial.drives
    in_order = replace(drives, muscles=tuple(drives.muscles[i] for i in order))
    return replace(
        trial,
        lead_in=lead,
        drive=in_order.stated(names.muscles),
        command=trial.command[:, columns],
        measured=measured,
        muscle_names=names.named_muscles,
    ), tuple(
        f"{trial.name}: {channel} is not used: rig {rig!r} records {known}" for channel in left
    )


def _order(trial: Trial, names: SignalNames, rig: str) -> list[int]:
    """Columns of the trial's command in the rig's order."""
    have = ", ".join(names.muscles)
    if trial.muscles != len(names.muscles):
        raise InputError(
            f"{trial.name!r} is of {trial.muscles} muscles, rig {rig!r} has {len(names.muscles)}"
            f" ({have})"
        )
    for name in trial.muscle_names:
        if name not in names.muscles:
            raise InputError(
                f"{trial.name!r} commands {name!r}, which is no muscle of rig {rig!r}; "
                f"{nearest(name, names.muscles)}"
            )
    order = trial.drives.order(names.muscles, f"{trial.name!r}: rig {rig!r}")
    if trial.muscle_names:
        own = [trial.muscle_names.index(name) for name in names.muscles]
        return [*own, *order[len(own) :]]
    if order != sorted(order):
        raise InputError(
            f"{trial.name!r}: columns by number are in the order of rig {rig!r}, {have}; name the"
            " muscles in that order in the drive"
        )
    return order


def _channels(trial: Trial, names: SignalNames, order: list[int]) -> Mapping[str, str]:
    """The trial's channel -> the rig's."""
    channels = {
        f"{name}.{kind}": channel
        for (name, kind), channel in zip(names.joints.items(), names.joint_channels, strict=True)
    }
    for name in trial.drives.imposed:
        effort = names.effort_channel(name)
        channels |= {effort: effort, f"{name}.{EFFORTS[names.joints[name]]}": effort}
    if names.short:
        channels["angle"] = "angle"
    for kind in ("pressure", "force"):
        for number, channel in zip(order, names.of_muscles(kind), strict=True):
            own = trial.muscle_names[number] + f".{kind}" if trial.muscle_names else ""
            channels[own or f"{kind}_{number + 1}"] = channel
    return channels


def _refuse_other_joint(trial: Trial, channel: str, names: SignalNames, rig: str) -> None:
    """Refuse a joint's channel that the rig must mean otherwise."""
    columns = " or ".join(names.joint_columns())
    if channel == "angle":
        raise InputError(
            f"{trial.name!r}: which joint of rig {rig!r} is angle_deg? Name the column {columns}"
        )
    joint = owner_of(channel)
    if joint in names.joints and kind_of(channel) in JOINT_KINDS:
        kind = names.joints[joint]
        raise InputError(
            f"{trial.name!r}: joint {joint!r} of rig {rig!r} {MOVES[kind]}; give its column in"
            f" {KINDS[kind].shown} and name it {columns}"
        )
