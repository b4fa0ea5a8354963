"""A recording: what a rig did, sampled in time, and its folder of one CSV file per trial."""

from __future__ import annotations

import csv
import enum
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError, SimulationError, refuse_unknown
from pamsim.core.files import complete_file
from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.recordings.signals import (
    DRIVES,
    KINDS,
    Drive,
    DriveLike,
    SignalNames,
    column_of,
    command_columns,
    in_toml,
)

SCHEMA = "pamsim-recording/1"
"""Of ``recording.toml``."""


class Outcome(enum.Enum):
    """How a simulation ended."""

    COMPLETED = "completed"
    NOT_FINITE = "not_finite"
    ENGINE_WARNING = "engine_warning"
    TIME_STALLED = "time_stalled"


@dataclass(frozen=True, kw_only=True)
class Recording:
    """Sampled signals of one run, in SI.

    Attributes:
        time: (n,) [s], uniform, from 0.
        joints: recorded joint -> ``angle`` or ``position``, in column order.
        positions: (n, j) of the joints [rad or m].
        velocities: (n, j) their rates [rad/s or m/s].
        pressure: (n, m) gauge pressures [Pa], one column per muscle.
        tension: (n, m) muscle tensions [N].
        command: (n, m + j) of each muscle, then of each driven joint, as in an experiment.
        drive: one kind for all muscles, or name -> kind, see `pamsim.recordings.signals`.
        load: mass on the arm [kg].
        muscles: names of the muscles, in column order.
        outcome: how the run ended; anything but COMPLETED means the signals stop early.
        message: the outcome as a sentence.
        final_state: the engine's at the last sample, to continue from; its start if it broke down.
        meta: what else is worth keeping: rig, time step, versions, name.
        effort: driven joint -> (n,) torque [N m] or force [N] on it, as given or as it takes.
    """

    time: FloatArray
    joints: Mapping[str, str]
    positions: FloatArray
    velocities: FloatArray
    pressure: FloatArray
    tension: FloatArray
    command: FloatArray
    drive: DriveLike
    load: float
    muscles: tuple[str, ...]
    outcome: Outcome
    message: str
    final_state: FloatArray
    meta: Mapping[str, str | float] = field(default_factory=dict[str, str | float])
    effort: Mapping[str, FloatArray] = field(default_factory=dict[str, FloatArray])

    @property
    def drives(self) -> Drive:
        """``drive`` of every column of the command."""
        return Drive.of(self.drive, self.command.shape[1])

    @property
    def names(self) -> SignalNames:
        """Names of the signals."""
        return SignalNames(joints=self.joints, muscles=self.muscles)

    @property
    def angle(self) -> FloatArray:
        """Position (n,) of the only joint [rad, of one that slides m]; of several, InputError."""
        return self.positions[:, self._only("angle")]

    @property
    def velocity(self) -> FloatArray:
        """Rate (n,) of the only joint [rad/s, of one that slides m/s]; of several, InputError."""
        return self.velocities[:, self._only("velocity")]

    def with_angle(self, angle: FloatArray) -> Recording:
        """The recording with another position (n,) of its only joint [rad or m]."""
        self._only("angle")
        return replace(self, positions=angle[:, np.newaxis])

    def _only(self, what: str) -> int:
        if len(self.joints) != 1:
            raise InputError(
                f"`{what}` is of a rig with one joint, this one has {', '.join(self.joints)}: take"
                f" a joint's signal, such as signal({self.names.joint_channels[0]!r})"
            )
        return 0

    def signals(self) -> dict[str, FloatArray]:
        """Channel -> (n,) [SI]: of the joints, then each muscle's pressure and force.

        A rig with one joint that turns has ``angle``, ``pressure_1``, ``force_1`` ...; any other
        ``knee.angle``, ``flexor.pressure``, ``flexor.force`` ... A driven joint has ``torque`` or
        ``force``, too.
        """
        names = self.names
        found = dict(zip(names.joint_channels, self.positions.T, strict=True))
        found |= {names.effort_channel(joint): values for joint, values in self.effort.items()}
        for i, pair in enumerate(zip(*map(names.of_muscles, ("pressure", "force")), strict=True)):
            found |= zip(pair, (self.pressure[:, i], self.tension[:, i]), strict=True)
        return found

    def signal(self, channel: str) -> FloatArray:
        """One of `signals`, shape (n,) [SI]; InputError with the nearest if there is none."""
        signals = self.signals()
        refuse_unknown(channel, signals, f"no signal {channel!r}")
        return signals[channel]

    def completed(self) -> Recording:
        """The recording itself; SimulationError, which carries it, if the run did not complete."""
        if self.outcome is not Outcome.COMPLETED:
            raise SimulationError(self.message, recording=self)
        return self

    def columns(self) -> dict[str, FloatArray]:
        """Name -> (n,) of a CSV: time, commands, pressures [kPa], joints [deg, mm], forces [N]."""
        names, drives = self.names, self.drives
        columns = command_columns(drives, names.named_muscles)
        commands = zip(columns, drives.muscles, self.command.T, strict=False)  # less the joints'
        placed = map(column_of, names.joint_channels)
        joints = zip(placed, self.joints.values(), self.positions.T, strict=True)
        pressures = (self.pressure / PA_PER_KPA).T
        return {
            "time_s": self.time,
            **{c: v / PA_PER_KPA if DRIVES[k].unit == "Pa" else v for c, k, v in commands if c},
            **dict(zip(map(column_of, names.of_muscles("pressure")), pressures, strict=True)),
            **{column: values * KINDS[kind].scale for column, kind, values in joints},
            **{column_of(names.effort_channel(j)): v for j, v in self.effort.items()},
            **dict(zip(map(column_of, names.of_muscles("force")), self.tension.T, strict=True)),
        }

    def summary(self) -> str:
        """One sentence: rig, length, how angle and pressures changed, and the outcome."""
        rig, ending = self.meta.get("rig", "recording"), self.message or self.outcome.value
        if not len(self.time):
            return f"{rig}: no samples; {ending}"
        names = ("angle",) if self.names.short else tuple(self.joints)
        parts = [f"{self.time[-1]:g} s", f"load {self.load:g} kg"]
        for name, kind, x in zip(names, self.joints.values(), self.positions.T, strict=True):
            first, last = x[[0, -1]] * KINDS[kind].scale
            parts.append(f"{name} {first:.2f} -> {last:.2f} {KINDS[kind].shown}")
        for name, p in zip(self.muscles, self.pressure.T / PA_PER_KPA, strict=True):
            parts.append(f"{name} {p[0]:.1f} -> {p[-1]:.1f} kPa")
        return f"{rig}: {', '.join(parts)}; {ending}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-safe dict of ``signals``, in the units of the CSV format, and what else is known."""
        return to_dict(
            {
                "rig": self.meta.get("rig"),
                "load_kg": self.load,
                "muscles": self.muscles,
                "drive": self.drive,
                "outcome": self.outcome,
                "message": self.message,
                "signals": self.columns(),
                "meta": self.meta,
            }
        )

    def save(self, folder: str | Path, rig: str | None = None) -> list[Path]:
        """Write a folder that `pamsim.read_recordings` reads, as `write_recording` does.

        ``rig`` is the name of a shipped rig or the path of a rig folder; if left out, its own.
        """
        name = re.sub(r"[^\w.-]+", "_", str(self.meta.get("experiment") or "trial"))
        return write_recording(Path(folder), rig or str(self.meta.get("rig", "")), {name: self})


def write_recording(
    folder: str | os.PathLike[str],
    rig: str,
    trials: Mapping[str, Recording],
    protocols: Mapping[str, str] | None = None,
    *,
    forces: bool = True,
) -> list[Path]:
    """Write trials of one rig.

    Args:
        folder: created if need be.
        rig: name or path of the rig; the path of a rig folder is written relative to ``folder``.
        trials: file stem -> recording.
        protocols: file stem -> protocol, where that is not the stem without its trailing number.
        forces: False leaves the muscles' forces out, as most rigs do.

    Returns:
        The paths written, ``recording.toml`` first.

    Raises:
        InputError: if the folder cannot be written.
    """
    folder = Path(folder)
    index = folder / "recording.toml"
    lines = [f'schema = "{SCHEMA}"', f"rig = {in_toml(_reference(folder, rig))}"]
    written = [index]
    for stem, recording in trials.items():
        path = folder / f"{stem}.csv"
        columns = recording.columns()
        if not forces:
            for name in map(column_of, recording.names.of_muscles("force")):
                del columns[name]
        with complete_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerow(columns)
            rows = np.column_stack(list(columns.values()))
            np.savetxt(file, rows, fmt="%.9g", delimiter=",", newline="\r\n")
        written.append(path)
        protocol = (protocols or {}).get(stem) or re.sub(r"_?\d+$", "", stem) or stem
        lines += [
            "",
            "[[trial]]",
            f"file = {in_toml(path.name)}",
            f"protocol = {in_toml(protocol)}",
            f"drive = {in_toml(recording.drives.stated(recording.muscles))}",
            f"load_kg = {recording.load:.9g}",
        ]
    with complete_file(index) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return written


def _reference(folder: Path, rig: str) -> str:
    """A rig as a reader of the folder finds it: by name, or by a path relative to the folder."""
    if not (Path(rig) / "params.toml").is_file():
        return rig
    try:
        return Path(os.path.relpath(rig, folder)).as_posix()
    except ValueError:  # on another drive there is no relative path
        return Path(rig).resolve().as_posix()
