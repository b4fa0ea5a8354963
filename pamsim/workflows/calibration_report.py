"""What ``pamsim calibrate`` hands back: parameters before and after, and how well they fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.core.versions import versions
from pamsim.store.static_table import StaticTable
from pamsim.sysid.calibration_result import Calibration
from pamsim.sysid.profile_likelihood import Profile
from pamsim.workflows.calibration_parameters import FreedParameter

FloatArray = NDArray[np.float64]
SCHEMA = "pamsim-calibrate/1"

_SHOWN_UNIT = {"angle": ("deg", DEG_PER_RAD), "pressure": ("kPa", 1.0 / PA_PER_KPA)}


def shown_unit(channel: str) -> tuple[str, float]:
    """Unit in which a channel is written, and what to multiply its SI values by."""
    return _SHOWN_UNIT.get(channel.split("_")[0], ("N", 1.0))


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One channel of one trial, or a static table, with what the rig made of it.

    Attributes:
        trial: name of the trial or table.
        protocol: of the trial.
        channel: such as ``pressure_1``.
        held_out: whether it was kept from the fit.
        time: (n,) [s]; of a static table, the numbers of its rows.
        measured: (n,) [SI].
        before: (n,) simulated with the rig as it was; None if a run broke down.
        after: (n,) simulated with the calibrated rig; None if a run broke down.
        table: the static table, or None.
    """

    trial: str
    protocol: str
    channel: str
    held_out: bool
    time: FloatArray
    measured: FloatArray
    before: FloatArray | None
    after: FloatArray | None
    table: StaticTable | None = None

    def rms(self, simulated: FloatArray | None) -> float | None:
        """Root mean square of simulated minus measured, in the written unit."""
        if simulated is None:
            return None
        return shown_unit(self.channel)[1] * float(
            np.sqrt(np.mean((simulated - self.measured) ** 2))
        )

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe form without the signals over time."""
        found: dict[str, Any] = {
            "trial": self.trial,
            "protocol": self.protocol,
            "channel": self.channel,
            "held_out": self.held_out,
            "unit": shown_unit(self.channel)[0],
            "rms_before": self.rms(self.before),
            "rms_after": self.rms(self.after),
        }
        if self.table is not None:
            scale = shown_unit(self.channel)[1]
            found["rows"] = [
                {
                    "row": row,
                    "pressure_kpa": (self.table.pressure[i] / PA_PER_KPA).tolist(),
                    "load_kg": float(self.table.load[i]),
                    "measured_deg": float(self.measured[i]) * scale,
                    "before_deg": None if self.before is None else float(self.before[i]) * scale,
                    "after_deg": None if self.after is None else float(self.after[i]) * scale,
                }
                for i, row in enumerate(self.table.rows)
            ]
        return found


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
