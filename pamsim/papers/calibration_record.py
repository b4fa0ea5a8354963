"""How a rig's static model was chosen: the models compared and their scores, from its folder.

``calibration.json`` beside ``params.toml`` is written by the script that calibrated the rig. Its
errors at held-out rows took many refits and are quoted, not recomputed; that it belongs to the
present parameters is checked by simulating the rows again.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pamsim.core.encoding import read_json
from pamsim.core.errors import InputError
from pamsim.core.parameters import Sourced
from pamsim.engine.rig import Rig
from pamsim.inference.leave_one_out import FittedForm, nested_leave_one_out
from pamsim.papers.numerics import rms
from pamsim.recordings.rig_file import RigFile

SCHEMA = "pamsim-rig-calibration/1"
FILE = "calibration.json"

SMALL_STEPS = "small steps"
"""Block of rows that every model is fitted without, the other blocks only by accepted models."""

SAME_RMS_DEG = 0.02
"""Largest difference between recorded and simulated RMS that rounding of the parameters explains
[deg]."""


@dataclass(frozen=True)
class NestedLeaveOneOut:
    """Error at rows for which neither the form nor its parameters were chosen."""

    rms_deg: float
    selected: Mapping[str, int]  # form -> rows without which it was the best one, most first


@dataclass(frozen=True, kw_only=True)
class CalibrationRecord:
    """The record of a rig, and the command that wrote it.

    The static models go from the published law to the one used, then those not accepted, each with
    ``name``, ``accepted``, ``rms_deg``, ``leave_one_out_rms_deg``, ``left_out_block_rms_deg``,
    ``parameters``, and row by row ``residual_deg``, ``leave_one_out_residual_deg`` and
    ``jacobian_deg``.
    """

    static_models: tuple[Mapping[str, Any], ...]
    command: str

    @property
    def used(self) -> Mapping[str, Any]:
        """The model that the rig uses: the last one accepted."""
        return [model for model in self.static_models if model["accepted"]][-1]

    @property
    def small_steps_rms_deg(self) -> float:
        """Error of the model used at the small steps, fitted without them [deg]."""
        return float(self.used["left_out_block_rms_deg"][SMALL_STEPS])

    @cached_property
    def nested(self) -> NestedLeaveOneOut:
        """Leave-one-out error with the form chosen among all of the record without the row, too."""
        errors, chosen = nested_leave_one_out(
            [
                FittedForm(
                    residual=np.array(model["residual_deg"], dtype=float),
                    jacobian=np.array(model["jacobian_deg"], dtype=float),
                    left_out=np.array(model["leave_one_out_residual_deg"], dtype=float),
                )
                for model in self.static_models
            ]
        )
        names = (self.static_models[form]["name"] for form in chosen)
        return NestedLeaveOneOut(rms(errors), dict(Counter(names).most_common()))

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
        rows = len(record.used["residual_deg"])
        for model in record.static_models:
            _check(model, rows)
        figures = (float(record.used["rms_deg"]), record.small_steps_rms_deg, record.nested.rms_deg)
        if not all(map(math.isfinite, figures)):
            raise ValueError(f"errors of the model used: {figures}")
    except (KeyError, IndexError, TypeError, ValueError, ArithmeticError) as error:
        raise InputError(f"{path}: not a calibration record: {error!r}") from None
    return record


def _check(model: Mapping[str, Any], rows: int) -> None:
    """Refuse a model whose errors are not those of its rows; `ValueError`."""
    for errors, stated in (
        ("residual_deg", "rms_deg"),
        ("leave_one_out_residual_deg", "leave_one_out_rms_deg"),
    ):
        found = np.array(model[errors], dtype=float)
        same = math.isclose(rms(found), float(model[stated]), rel_tol=1e-6)
        if found.shape != (rows,) or not same:
            raise ValueError(f"{model['name']}: {errors} of {rows} rows do not give {stated}")
    free = len(model["parameters"])
    if np.shape(model["jacobian_deg"]) != (rows, free):
        raise ValueError(f"{model['name']}: jacobian_deg is not {rows} rows of {free} numbers")


def stated_parameters(file: RigFile) -> list[dict[str, Any]]:
    """Every number of a rig as written: name, value, unit, source, 95 % interval and note."""
    own = [(f"{muscle}:", groups) for muscle, groups in file.overrides.items()]
    sections = [("", file.muscle), *own]
    content = {
        f"{prefix}{group}.{name}": entry
        for prefix, groups in sections
        for group, section in groups.items()
        for name, entry in section.items()
    }
    return [
        {
            "name": name,
            "value": entry.value,
            "unit": entry.unit,
            "source": entry.source,
            "interval95": list(entry.interval95) if entry.interval95 else None,
            "note": entry.note,
        }
        for name, entry in {**content, **file.native, **file.sensor}.items()
        if isinstance(entry, Sourced)
    ]
