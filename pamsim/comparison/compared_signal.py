"""One measured signal beside its simulations, and the unit in which it is shown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.recordings.signals import KINDS, kind_of
from pamsim.recordings.static_table import StaticTable
from pamsim.recordings.trial import Trial


def shown_unit(channel: str) -> tuple[str, float]:
    """Unit in which a channel is shown, and the factor on its SI values."""
    kind = KINDS[kind_of(channel)]
    return kind.shown, kind.scale


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One channel of one trial, or a static table, with its simulations."""

    trial: str  # name of the trial or table
    protocol: str  # of the trial
    channel: str  # such as ``pressure_1`` or ``knee.angle``
    held_out: bool  # whether it was held out of the fit
    time: FloatArray  # (n,) [s]; of a static table, the numbers of its rows
    measured: FloatArray  # (n,) [SI]
    before: FloatArray | None  # (n,) simulated with the rig as it was; None if a run broke down
    after: FloatArray | None  # (n,) simulated with the calibrated rig; None if a run broke down
    table: StaticTable | None = None  # the static table, or None

    def rms(self, simulated: FloatArray | None) -> float | None:
        """Root mean square of simulated minus measured, in the written unit."""
        if simulated is None:
            return None
        return shown_unit(self.channel)[1] * float(
            np.sqrt(np.mean((simulated - self.measured) ** 2))
        )

    def to_dict(self) -> dict[str, Any]:
        """JSON-safe form without the signals over time."""
        entry: dict[str, Any] = {
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
            entry["rows"] = [
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
        return entry


def pooled_rms(parts: Sequence[Comparison], simulated: str) -> float | None:
    """RMS of simulated minus measured over all samples of a channel, in the written unit.

    ``simulated`` is ``before`` or ``after``. None if a part does not have it, or there is no part.
    """
    levels = [part.rms(getattr(part, simulated)) for part in parts]
    known = [level**2 for level in levels if level is not None]
    if not known or len(known) < len(levels):
        return None
    return float(np.average(known, weights=[part.measured.size for part in parts])) ** 0.5


def comparisons_of(
    trial: Trial,
    channels: Iterable[str],
    before: Mapping[str, FloatArray] | None,
    after: Mapping[str, FloatArray] | None,
    *,
    held_out: bool,
) -> list[Comparison]:
    """Some channels of a trial beside simulations [SI], None of a run that broke down."""
    return [
        Comparison(
            trial=trial.name,
            protocol=trial.protocol,
            channel=channel,
            held_out=held_out,
            time=trial.time,
            measured=trial.measured[channel],
            before=None if before is None else before.get(channel),
            after=None if after is None else after.get(channel),
        )
        for channel in channels
    ]
