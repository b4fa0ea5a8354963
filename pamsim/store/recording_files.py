"""Write recordings: a folder with ``recording.toml`` and one CSV per trial."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.recording import Recording
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA

SCHEMA = "pamsim-recording/1"


def write_recording(folder: Path, rig: str, trials: Mapping[str, Recording]) -> list[Path]:
    """Write trials of one rig.

    Args:
        folder: created if need be.
        rig: name or path of the rig.
        trials: file stem -> recording; the stem without a trailing number is the protocol.

    Returns:
        The paths written, ``recording.toml`` first.

    Raises:
        InputError: if the folder cannot be written.
    """
    index = folder / "recording.toml"
    lines = [f'schema = "{SCHEMA}"', f'rig = "{rig}"']
    written = [index]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for stem, recording in trials.items():
            path = folder / f"{stem}.csv"
            _write_csv(path, recording)
            written.append(path)
            lines += [
                "",
                "[[trial]]",
                f'file = "{path.name}"',
                f'protocol = "{stem.rstrip("0123456789_")}"',
                f'command = "{"pressure" if recording.command_kind == "pressure" else "valve"}"',
                f"load_kg = {recording.load:g}",
            ]
        index.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {folder}: {error.strerror}") from None
    return written


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


def _write_csv(path: Path, recording: Recording) -> None:
    named = columns(recording)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(named)
        for row in zip(*named.values(), strict=True):
            writer.writerow([f"{value:.9g}" for value in row])
