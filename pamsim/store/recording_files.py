"""Write recordings: a folder with ``recording.toml`` and one CSV per trial."""

from __future__ import annotations

import csv
import json
import os
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.recording import Recording
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA

SCHEMA = "pamsim-recording/1"


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
    try:
        folder.mkdir(parents=True, exist_ok=True)
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
        index.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {folder}: {error.strerror}") from None
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


def columns(recording: Recording) -> dict[str, np.ndarray]:
    """A recording as named columns in the units of the CSV format.

    Returns:
        Name -> (n,): ``time_s``, commands, then measured pressures [kPa], angle [deg], forces [N].
    """
    muscles = range(1, recording.pressure.shape[1] + 1)
    found: dict[str, np.ndarray] = {"time_s": recording.time}
    for i in muscles:
        value = recording.command[:, i - 1]
        if recording.command_kind == "pressure":
            found[f"p{i}_set_kpa"] = value / PA_PER_KPA
        else:
            found[f"u{i}"] = value
    for i in muscles:
        found[f"p{i}_kpa"] = recording.pressure[:, i - 1] / PA_PER_KPA
    found["angle_deg"] = recording.angle * DEG_PER_RAD
    for i in muscles:
        found[f"force{i}_n"] = recording.tension[:, i - 1]
    return found


def _write_csv(path: Path, recording: Recording, forces: bool) -> None:
    named = columns(recording)
    if not forces:
        named = {name: values for name, values in named.items() if not name.startswith("force")}
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(named)
        for row in zip(*named.values(), strict=True):
            writer.writerow([f"{value:.9g}" for value in row])
