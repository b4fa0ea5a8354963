"""A measured trial: commands of a rig and readings of its sensors, by the names of a rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.recordings.signals import (
    EFFORTS,
    JOINT_KINDS,
    KINDS,
    MOVES,
    Drive,
    DriveLike,
    SignalNames,
    column_of,
    kind_of,
    muscle_channels,
    owner_of,
)
from pamsim.recordings.stated_noise import StatedNoise

HELD_OUT_SUFFIX = "_check"
"""Trials of protocols with this end of the name are held out unless others are named."""


@dataclass(frozen=True, kw_only=True)
class TrialLead:
    """What a rig did right before a trial: simulated, so that memory settles, not compared."""

    time: FloatArray  # (k,) [s], increasing from 0
    duration: float  # from its first sample to the trial's [s]
    command: FloatArray  # (k, m + j) as that of the trial
    start_pressure: FloatArray  # (m,) first measured gauge pressures [Pa]; NaN where not measured
    # channel -> (k,) [SI], as those of the trial
    measured: Mapping[str, FloatArray] = field(default_factory=dict[str, FloatArray])


@dataclass(frozen=True, kw_only=True)
class Trial:
    """Sampled commands and measurements of one trial, in SI.

    Commands are held from each sample on, but where measured pressures, torques, forces, angles or
    positions drive; see `pamsim.recordings.signals` for drives and channels.

    Attributes:
        name: such as the file's stem.
        protocol: trials of the same protocol and settings are repeats of each other.
        drive: one kind for all muscles, or muscle or driven joint -> kind.
        load: mass on the arm [kg].
        time: (n,) [s], increasing from 0, not necessarily uniform.
        command: (n, m + j) of each muscle, then of each driven joint [-, Pa, N m, N, rad or m].
        measured: channel -> (n,) [SI], gauge pressures; what was not measured is absent.
        muscle_names: in the order of the commands; none where muscles have numbers.
        lead_in: None for a trial that begins at rest.
        noise: channel -> noise that the lab states of it.
        turned: channels whose sign is not the instrument's.
    """

    name: str
    protocol: str
    drive: DriveLike
    load: float
    time: FloatArray
    command: FloatArray
    measured: Mapping[str, FloatArray]
    muscle_names: tuple[str, ...] = ()
    lead_in: TrialLead | None = None
    noise: Mapping[str, StatedNoise] = field(default_factory=dict[str, StatedNoise])
    turned: frozenset[str] = frozenset()

    @property
    def sample_interval(self) -> float:
        """Median time between samples [s]."""
        return float(np.median(np.diff(self.time)))

    @cached_property
    def drives(self) -> Drive:
        """``drive`` of every column of the command."""
        return Drive.of(self.drive, self.command.shape[1])

    @property
    def muscles(self) -> int:
        """Number of muscles commanded."""
        return len(self.drives.muscles)

    @property
    def with_lead_in(self) -> Trial:
        """Lead-in and trial as one, with the channels that were measured in both."""
        lead = self.lead_in
        if lead is None:
            return self
        both = [name for name in self.measured if name in lead.measured]
        return replace(
            self,
            time=np.concatenate([lead.time, lead.duration + self.time]),
            command=np.concatenate([lead.command, self.command]),
            measured={n: np.concatenate([lead.measured[n], self.measured[n]]) for n in both},
            lead_in=None,
        )

    def rows(self, rows: slice) -> Trial:
        """Some rows as a trial, whose time begins at 0; it has the same lead-in."""
        return replace(
            self,
            time=self.time[rows] - self.time[rows.start or 0],
            command=self.command[rows],
            measured={channel: values[rows] for channel, values in self.measured.items()},
        )

    @property
    def pressure_channels(self) -> tuple[str, ...]:
        """Channel of each muscle's pressure, measured or not."""
        return muscle_channels("pressure", self.muscle_names, self.muscles)


@dataclass(frozen=True, kw_only=True)
class TrialSet:
    """The trials of one recording folder.

    Attributes:
        rig: name or path of the rig they belong to.
        trials: in the order of ``recording.toml``.
        notes: what a reader should know, one sentence each.
    """

    rig: str
    trials: tuple[Trial, ...]
    notes: tuple[str, ...] = ()


def of_rig(trial: Trial, names: SignalNames, rig: str) -> tuple[Trial, tuple[str, ...]]:
    """A trial with its channels and commands as a rig names and orders them.

    ``rig`` is its name, for messages. With the trial come notes on channels that the rig does not
    record.

    Raises:
        InputError: for another number of muscles, a joint that the rig does not record or that
            moves otherwise, the angle of one of several joints without its name.
    """
    columns = _order(trial, names, rig)
    order = columns[: trial.muscles]
    names.check_driven(trial.drives.joints, f"{trial.name!r}: rig {rig!r}")
    channels = _channels(trial, names, order)
    left = [channel for channel in trial.measured if channel not in channels]
    shown = " or ".join(map(column_of, names.joint_channels))
    for channel in left:
        joint, asked = owner_of(channel), f"of rig {rig!r}"
        if channel == "angle":
            raise InputError(
                f"{trial.name!r}: angle_deg may be any joint {asked}; name the column {shown}"
            )
        if joint in names.joints and kind_of(channel) in JOINT_KINDS:
            kind = names.joints[joint]
            raise InputError(
                f"{trial.name!r}: joint {joint!r} {asked} {MOVES[kind]}; give its column in"
                f" {KINDS[kind].shown} and name it {shown}"
            )
    lead = trial.lead_in
    if lead is not None:
        start = lead.start_pressure[order]
        lead = replace(
            lead,
            command=lead.command[:, columns],
            start_pressure=start,
            measured={channels[c]: v for c, v in lead.measured.items() if c in channels},
        )
    in_order = replace(trial.drives, muscles=tuple(trial.drives.muscles[i] for i in order))
    known = ", ".join((*names.joints, *names.muscles))
    notes = (f"{trial.name}: {c} is not used: rig {rig!r} records {known}" for c in left)
    return replace(
        trial,
        lead_in=lead,
        drive=in_order.stated(names.muscles),
        command=trial.command[:, columns],
        measured={channels[c]: v for c, v in trial.measured.items() if c in channels},
        noise={channels[c]: v for c, v in trial.noise.items() if c in channels},
        muscle_names=names.named_muscles,
        turned=frozenset(channels[c] for c in trial.turned if c in channels),
    ), tuple(notes)


def _order(trial: Trial, names: SignalNames, rig: str) -> list[int]:
    """Columns of the trial's command in the rig's order."""
    have, where = ", ".join(names.muscles), f"{trial.name!r}: rig {rig!r}"
    if trial.muscles != len(names.muscles):
        raise InputError(
            f"{trial.name!r} is of {trial.muscles} muscles, rig {rig!r} has {len(names.muscles)}"
            f" ({have})"
        )
    own = trial.muscle_names
    order = replace(trial.drives, names=own or trial.drives.names).order(names.muscles, where)
    if not own and order != sorted(order):
        raise InputError(
            f"{trial.name!r}: numbered columns are in the order of the muscles of rig {rig!r};"
            f" write the drive in the same order: {have}"
        )
    return order


def _channels(trial: Trial, names: SignalNames, order: list[int]) -> Mapping[str, str]:
    """The trial's channel -> the rig's."""
    channels = {f"{j}.{kind}": names.joint_channel(j) for j, kind in names.joints.items()}
    for joint in trial.drives.imposed:
        effort = names.effort_channel(joint)
        channels |= {effort: effort, f"{joint}.{EFFORTS[names.joints[joint]]}": effort}
    if names.short:
        channels["angle"] = "angle"
    for kind in ("pressure", "force"):
        own = muscle_channels(kind, trial.muscle_names, trial.muscles)
        channels |= {own[i]: c for i, c in zip(order, names.of_muscles(kind), strict=True)}
    return channels
