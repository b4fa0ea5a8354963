"""A recording: what a rig did, sampled in time, and its folder of one CSV file per trial."""

from __future__ import annotations

import csv
import enum
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.encoding import to_dict
from pamsim.core.errors import SimulationError
from pamsim.core.files import complete_file
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA

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
        angle: (n,) output angle beta [rad].
        velocity: (n,) its rate [rad/s].
        pressure: (n, m) gauge pressures [Pa], one column per muscle.
        tension: (n, m) muscle tensions [N].
        command: (n, m) command held from each sample on.
        command_kind: ``valve``, ``pulse`` or ``pressure``.
        load: mass on the arm [kg].
        muscles: names of the muscles, in column order.
        outcome: how the run ended; anything but COMPLETED means the signals stop early.
        message: the outcome as a sentence.
        final_state: the engine's whole state at the last sample, to continue from; of a run that
            broke down, the state it started from.
        meta: what else is worth keeping: rig, time step, versions, name.
    """

    time: NDArray[np.float64]
    angle: NDArray[np.float64]
    velocity: NDArray[np.float64]
    pressure: NDArray[np.float64]
    tension: NDArray[np.float64]
    command: NDArray[np.float64]
    command_kind: str
    load: float
    muscles: tuple[str, ...]
    outcome: Outcome
    message: str
    final_state: NDArray[np.float64]
    meta: Mapping[str, str | float] = field(default_factory=dict[str, str | float])

    def completed(self) -> Recording:
        """Return the recording itself if the run completed.

        Raises:
            SimulationError: otherwise, carrying this partial recording.
        """
        if self.outcome is not Outcome.COMPLETED:
            raise SimulationError(self.message, recording=self)
        return self

    def columns(self) -> dict[str, NDArray[np.float64]]:
        """The signals in the units of the CSV format.

        Returns:
            Name -> (n,): ``time_s``, commands, then pressures [kPa], angle [deg], forces [N].
        """
        result = {"time_s": self.time}
        for i, value in enumerate(self.command.T, start=1):
            if self.command_kind == "pressure":
                result[f"p{i}_set_kpa"] = value / PA_PER_KPA
            else:
                result[f"u{i}"] = value
        for i, value in enumerate(self.pressure.T, start=1):
            result[f"p{i}_kpa"] = value / PA_PER_KPA
        result["angle_deg"] = self.angle * DEG_PER_RAD
        for i, value in enumerate(self.tension.T, start=1):
            result[f"force{i}_n"] = value
        return result

    def summary(self) -> str:
        """One sentence: rig, length, how angle and pressures changed, and the outcome."""
        rig = self.meta.get("rig", "recording")
        if not len(self.time):
            return f"{rig}: no samples; {self.message or self.outcome.value}"
        first, last = self.pressure[[0, -1]] / PA_PER_KPA
        changes = ", ".join(
            f"{name} {before:.1f} -> {after:.1f} kPa"
            for name, before, after in zip(self.muscles, first, last, strict=True)
        )
        start, end = self.angle[[0, -1]] * DEG_PER_RAD
        return (
            f"{rig}: {self.time[-1]:g} s, load {self.load:g} kg,"
            f" angle {start:.2f} -> {end:.2f} deg, {changes};"
            f" {self.message or self.outcome.value}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Signals with their unit in the key, as in the CSV format, and what else is known.

        Returns:
            JSON-safe dict: ``rig``, ``load_kg``, ``muscles``, ``command_kind``, ``outcome``,
            ``message``, ``signals`` (name -> list of n numbers), ``meta``.
        """
        return to_dict(
            {
                "rig": self.meta.get("rig"),
                "load_kg": self.load,
                "muscles": self.muscles,
                "command_kind": self.command_kind,
                "outcome": self.outcome,
                "message": self.message,
                "signals": self.columns(),
                "meta": self.meta,
            }
        )

    def save(self, folder: str | Path, rig: str | None = None) -> list[Path]:
        """Write a folder that `pamsim.read_recordings` reads: ``recording.toml`` and one CSV.

        Args:
            folder: created if need be.
            rig: name of a shipped rig or path of a rig folder; the recording's own if left out.

        Returns:
            The paths written.

        Raises:
            InputError: if the folder cannot be written.
        """
        name = re.sub(r"[^\w.-]+", "_", str(self.meta.get("experiment") or "trial"))
        return write_recording(Path(folder), rig or str(self.meta.get("rig", "")), {name: self})


def write_recording(
    folder: Path,
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
    index = folder / "recording.toml"
    lines = [f'schema = "{SCHEMA}"', f"rig = {_quoted(_reference(folder, rig))}"]
    written = [index]
    for stem, recording in trials.items():
        path = folder / f"{stem}.csv"
        _write_csv(path, recording, forces)
        written.append(path)
        protocol = (protocols or {}).get(stem) or re.sub(r"_?\d+$", "", stem) or stem
        lines += [
            "",
            "[[trial]]",
            f"file = {_quoted(path.name)}",
            f"protocol = {_quoted(protocol)}",
            f'command = "{recording.command_kind}"',
            f"load_kg = {recording.load:.9g}",
        ]
    with complete_file(index) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return written


def _quoted(text: str) -> str:
    # A JSON string is a TOML basic string.
    return json.dumps(text, ensure_ascii=False)


def _reference(folder: Path, rig: str) -> str:
    """A rig as a reader of the folder finds it: by name, or by a path relative to the folder."""
    if not (Path(rig) / "params.toml").is_file():
        return rig
    try:
        return Path(os.path.relpath(rig, folder)).as_posix()
    except ValueError:  # on another drive there is no relative path
        return Path(rig).resolve().as_posix()


def _write_csv(path: Path, recording: Recording, forces: bool) -> None:
    named = recording.columns()
    if not forces:
        named = {name: values for name, values in named.items() if not name.startswith("force")}
    with complete_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(named)
        for row in zip(*named.values(), strict=True):
            writer.writerow([f"{value:.9g}" for value in row])
