"""What ``pamsim calibrate`` hands back: parameters before and after, and how well they fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.comparison.free_parameters import FreedParameter
from pamsim.core.versions import versions
from pamsim.inference.fit_result import Calibration
from pamsim.inference.profile_likelihood import Profile

FloatArray = NDArray[np.float64]
SCHEMA = "pamsim-calibrate/1"


@dataclass(frozen=True, kw_only=True)
class CalibrationReport:
    """A calibrated rig.

    Attributes:
        rig: name of the rig it started from.
        sources: of the measurements, as given.
        notes: what a reader should know, one sentence each.
        freed: the free parameters.
        calibration: numbers, intervals, doubts.
        profiles: of the parameters asked for.
        comparisons: every channel of every trial and table.
        seed: of the starts.
        simulations: run in all.
        seconds: wall time.
        folder: of the calibrated rig, or None if it was not written.
    """

    rig: str
    sources: tuple[str, ...]
    notes: tuple[str, ...]
    freed: tuple[FreedParameter, ...]
    calibration: Calibration
    profiles: tuple[Profile, ...]
    comparisons: tuple[Comparison, ...]
    seed: int
    simulations: int
    seconds: float
    folder: Path | None

    def misfit(self) -> list[dict[str, Any]]:
        """RMS per channel over all its samples, fitted and held out, before and after."""
        rows: list[dict[str, Any]] = []
        for channel in dict.fromkeys(c.channel for c in self.comparisons):
            row: dict[str, Any] = {"channel": channel, "unit": shown_unit(channel)[0]}
            for held, prefix in ((False, ""), (True, "held_out_")):
                parts = [c for c in self.comparisons if c.channel == channel and c.held_out == held]
                row[f"{prefix}before"] = _pooled([(c, c.before) for c in parts])
                row[f"{prefix}after"] = _pooled([(c, c.after) for c in parts])
            rows.append(row)
        return rows

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe form, SI but for what carries its unit."""
        found = self.calibration.as_dict()
        parameters = [
            _parameter(freed, entry)
            for freed, entry in zip(self.freed, found.pop("parameters"), strict=True)
        ]
        return {
            "schema": SCHEMA,
            "rig": self.rig,
            "data": list(self.sources),
            "notes": list(self.notes),
            "status": found.pop("status"),
            "sentence": found.pop("sentence"),
            "parameters": parameters,
            "misfit": self.misfit(),
            "trials": [comparison.as_dict() for comparison in self.comparisons],
            "profiles": [profile.as_dict() for profile in self.profiles],
            "calibrated_rig": None if self.folder is None else str(self.folder),
            "calibration": found,
            "seed": self.seed,
            "simulations": self.simulations,
            "seconds": self.seconds,
            "versions": versions("scipy"),
        }


def _pooled(parts: list[tuple[Comparison, FloatArray | None]]) -> float | None:
    """RMS over all samples of some comparisons, in the written unit; None if one is missing."""
    squares, count = 0.0, 0
    for comparison, simulated in parts:
        rms = comparison.rms(simulated)
        if rms is None:
            return None
        squares += rms**2 * comparison.measured.size
        count += comparison.measured.size
    return (squares / count) ** 0.5 if count else None


def _parameter(freed: FreedParameter, entry: Mapping[str, Any]) -> dict[str, Any]:
    interval = entry["interval95"]
    return {
        **entry,
        "tied": list(freed.names[1:]),
        "before": freed.before.value,
        "scale": freed.free.scale,
        "range_source": freed.range_source,
        "written": {
            "unit": freed.written_unit,
            "value": freed.written(entry["value"]),
            "before": freed.written(freed.before.value),
            "interval95": None if interval is None else [freed.written(end) for end in interval],
            "bounds": [freed.written(end) for end in entry["bounds"]],
        },
    }
