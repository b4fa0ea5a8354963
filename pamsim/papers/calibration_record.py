"""How a rig's static model was chosen: the models compared and their scores, from its folder.

``calibration.json`` beside ``params.toml`` is written by the script that calibrated the rig. Its
leave-one-out error took many refits and is quoted, not recomputed; that it belongs to the present
parameters is checked by simulating the rows again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pamsim.core.errors import InputError
from pamsim.core.parameters import Sourced
from pamsim.engine.rig import Rig
from pamsim.store.json_file import read_json
from pamsim.store.rig_file import RigFile

SCHEMA = "pamsim-rig-calibration/1"
FILE = "calibration.json"

SAME_RMS_DEG = 0.02
"""Largest difference between recorded and simulated RMS that rounding of the parameters explains
[deg]."""


@dataclass(frozen=True, kw_only=True)
class CalibrationRecord:
    """The record of a rig.

    Attributes:
        static_models: from the published law to the one used, and those that were not accepted,
            each with ``name``, ``accepted``, ``rms_deg``, ``leave_one_out_rms_deg``,
            ``parameters``.
        command: that wrote it.
    """

    static_models: tuple[Mapping[str, Any], ...]
    command: str

    @property
    def used(self) -> Mapping[str, Any]:
        """The model that the rig uses: the last one accepted."""
        return [model for model in self.static_models if model["accepted"]][-1]

    def belongs(self, rms_deg: float) -> bool:
        """Whether an RMS [deg] simulated now is the recorded one, up to rounded parameters."""
        return abs(rms_deg - float(self.used["rms_deg"])) <= SAME_RMS_DEG


def calibration_record(rig: Rig) -> CalibrationRecord | None:
    """The record in a rig's folder, or None if it has none.

    Raises:
        InputError: if the file is not such a record.
    """
    path = rig.file.folder / FILE
    if not path.is_file():
        return None
    content = read_json(path, SCHEMA)
    try:
        record = CalibrationRecord(
            static_models=tuple(content["static_models"]), command=str(content["command"])
        )
        _ = [float(record.used[key]) for key in ("rms_deg", "leave_one_out_rms_deg")]
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise InputError(f"{path}: not a calibration record: {error!r}") from None
    return record


def identified_parameters(file: RigFile) -> list[dict[str, Any]]:
    """The rig's identified numbers, as its folder states them.

    Returns:
        ``name``, ``value``, ``unit``, ``interval95``, ``source``, ``note`` of each.
    """
    return [entry for entry in stated_parameters(file) if entry["source"].startswith("identified")]


def stated_parameters(file: RigFile) -> list[dict[str, Any]]:
    """Every number of a rig with its unit, as written, and its source."""
    shared = {
        f"{group}.{name}": entry
        for group, section in file.muscle.items()
        for name, entry in section.items()
    }
    own = {
        f"{muscle}:{group}.{name}": entry
        for muscle, groups in file.overrides.items()
        for group, section in groups.items()
        for name, entry in section.items()
    }
    content = {**shared, **own, **file.native, **file.sensor}
    return [
        {
            "name": name,
            "value": entry.value,
            "unit": entry.unit,
            "source": entry.source,
            "interval95": list(entry.interval95) if entry.interval95 else None,
            "note": entry.note,
        }
        for name, entry in content.items()
        if isinstance(entry, Sourced)
    ]
