"""What a diagnosis of angles at rest says, to a person and to a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.trial_prediction import AT_REST
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.core.versions import versions
from pamsim.diagnosis.method.row_evidence import compare_rows, rms_interval95
from pamsim.diagnosis.method.row_model import RowModel
from pamsim.diagnosis.method.row_search import Tried
from pamsim.diagnosis.method.row_where import RowMap
from pamsim.diagnosis.method.static_diagnosis import StaticDiagnosis
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.report import SCHEMA
from pamsim.effects.catalog import effect
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.inference.free_parameter import FreeParameter
from pamsim.store.static_table import StaticTable

FloatArray = NDArray[np.float64]


_DISPLAY = {
    "common_pressure": (1.0 / PA_PER_KPA, "kPa"),
    "pressure_difference": (1.0 / PA_PER_KPA, "kPa"),
    "load": (1.0, "kg"),
    "direction": (1.0, "1"),
}
"""Quantity -> factor and unit in which files show it."""


@dataclass(frozen=True, kw_only=True)
class RestReport:
    """A diagnosis of angles at rest with what it was made from.

    Attributes:
        rig: without effects.
        repaired: with the claimed effects; None if nothing is claimed.
        table: the measurements.
        found: the diagnosis.
        published_rms: of the rig as it stands, nothing refitted [rad].
        resolution: of the angle: what the encoder cannot tell apart, as a standard deviation [rad].
        skipped: effect -> why it could not be tried.
        notes: what a reader should know, one sentence each.
        seed: of sign flips and exchanges.
        simulations: rows that were simulated in time.
        balances: rows that were solved for their balance of torques.
        seconds: it took.
    """

    rig: Rig
    repaired: Rig | None
    table: StaticTable
    found: StaticDiagnosis
    published_rms: float
    resolution: float
    skipped: dict[str, str]
    notes: tuple[str, ...]
    seed: int
    simulations: int
    balances: int
    seconds: float

    def as_dict(self) -> dict[str, Any]:
        """The content of ``diagnosis.json``, units in the key names; parameters in SI."""
        found = self.found
        best = found.best
        return {
            "schema": SCHEMA,
            "kind": "angles_at_rest",
            "rig": self.rig.name,
            "table": self.table.name,
            "verdict": str(found.verdict),
            "sentence": self.sentence(),
            "effects": [] if best is None else self._effects(best),
            "alternatives": [self._alternative(other) for other in found.tied],
            "where": [self._where(m) for m in found.before],
            "where_after": [self._where(m) for m in found.after],
            "gap": self._gap(),
            "rows": self._rows(),
            "tried": [
                {
                    "beside": list(t.beside),
                    "name": t.name,
                    "rms_deg": t.rms * DEG_PER_RAD,
                    "left_out_rms_deg": t.left_out_rms * DEG_PER_RAD,
                    "p_value_unseen": t.p_value,
                    "p_value_luck": t.luck,
                    "earned": t.earned,
                }
                for t in found.tried
            ],
            "ordinary": self._parameters(best or found.base, found.base.fit.parameters),
            "absent": {
                name: {
                    "parameter": parameter,
                    "unit": rig_parameter(self.rig, parameter).spec.unit,
                    "largest_distance_from_neutral": size,
                }
                for name, (parameter, size) in found.absent.items()
            },
            "skipped": dict(self.skipped),
            "next_experiment": self._next(),
            "notes": list(self.notes),
            "seed": self.seed,
            "versions": versions(),
            "rollouts": self.simulations,
            "balances": self.balances,
            "seconds": self.seconds,
        }

    def sentence(self) -> str:
        """The verdict for a person."""
        found, best = self.found, self.found.best
        before = f"{found.base.left.rms * DEG_PER_RAD:.2f} deg"
        if found.verdict is Verdict.NO_GAP:
            return (
                f"No effect of the library earns its place on these rows, and what is left of them"
                f" ({before} RMS at rows left out) follows no pressure and no load."
            )
        if best is None:
            return (
                f"The rows are missed by {before} RMS in a way that follows"
                f" {found.before[0].quantity.replace('_', ' ')}, and no effect explains it."
            )
        missing = " and ".join(effect(name).missing for name in best.names)
        after = f"{best.left.rms * DEG_PER_RAD:.2f} deg"
        return f"The model lacks {missing}: error at rows left out {before} before, {after} after."

    def repaired_rows(self) -> tuple[str, ...]:
        """Rows off by more than twice the rest's error after the repair before it, not after."""
        best = self.found.best
        if best is None:
            return ()
        before, after = np.abs(self.found.base.left.residual), np.abs(best.left.residual)
        limit = 2.0 * best.left.rms
        return tuple(
            row
            for row, b, a in zip(self.table.rows, before, after, strict=True)
            if b > limit and a < 0.5 * b
        )

    def _effects(self, best: RowModel) -> list[dict[str, Any]]:
        base = self.found.base.left.rms
        found: list[dict[str, Any]] = []
        for number, one in enumerate(best.effects):
            step = self._earned(one.name, best.names[:number])
            found.append(
                {
                    "name": one.name,
                    "family": one.family,
                    "missing": effect(one.name).missing,
                    "sure": one.name in self.found.sure,
                    "parameters": self._parameters(best, one.parameters),
                    "explained": self.found.explained,
                    "left_out_rms_before_deg": base * DEG_PER_RAD,
                    "p_value": None if step is None else step.luck,
                    "p_value_unseen": None if step is None else step.p_value,
                }
            )
        return found

    def _earned(self, name: str, beside: Sequence[str]) -> Tried | None:
        """The trial in which an effect earned its place."""
        for tried in self.found.tried:
            if tried.name == name and set(tried.beside) == set(beside) and tried.earned:
                return tried
        return None

    def _parameters(
        self, model: RowModel, parameters: Sequence[FreeParameter]
    ) -> dict[str, dict[str, Any]]:
        intervals = model.intervals
        return {
            p.name: {
                "value": model.fit.values[p.name],
                "unit": p.unit,
                "interval95": list(intervals[p.name]),
                "at_bound": p.name in model.fit.at_bound,
            }
            for p in parameters
        }

    def _alternative(self, other: RowModel) -> dict[str, Any]:
        best = self.found.best
        assert best is not None
        instead = [name for name in best.names if name not in other.names]
        new = next(e for e in other.effects if e.name not in best.names)
        behind = compare_rows(other.left.residual, best.left.residual, seed=self.seed)
        return {
            "name": new.name,
            "family": new.family,
            "instead_of": instead[0],
            "left_out_rms_deg": other.left.rms * DEG_PER_RAD,
            "loss_difference_in_standard_errors": behind.in_errors,
            "parameters": self._parameters(other, new.parameters),
        }

    def _where(self, found: RowMap) -> dict[str, Any]:
        scale, unit = _DISPLAY.get(found.quantity, (1.0, "1"))
        return {
            "channel": AT_REST,
            "protocol": self.table.name,
            "quantity": found.quantity,
            "unit": unit,
            "region": [scale * end for end in found.region],
            "rows": list(found.rows[found.worst]),
            "mean_deg": float(found.mean[found.worst]) * DEG_PER_RAD,
            "p_value": found.p_value,
            "bins": [
                {
                    "from": scale * float(low),
                    "to": scale * float(high),
                    "mean_deg": float(mean) * DEG_PER_RAD,
                    "rms_deg": float(spread) * DEG_PER_RAD,
                    "rows": list(rows),
                }
                for low, high, mean, spread, rows in zip(
                    found.edges[:-1], found.edges[1:], found.mean, found.spread, found.rows,
                    strict=True,
                )
            ],
        }  # fmt: skip

    def _gap(self) -> dict[str, Any]:
        def scored(model: RowModel | None) -> dict[str, Any] | None:
            if model is None:
                return None
            ends = rms_interval95(model.left.residual, seed=self.seed)
            return {
                "value_deg": model.left.rms * DEG_PER_RAD,
                "interval95_deg": [end * DEG_PER_RAD for end in ends],
                "in_sample_deg": model.fit.rms * DEG_PER_RAD,
            }

        return {
            AT_REST: {
                "held_out": "each row by the fit without it",
                "as_it_stands_deg": self.published_rms * DEG_PER_RAD,
                "floor": {
                    "value_deg": self.resolution * DEG_PER_RAD,
                    "meaning": "a lower bound, the resolution of the angle; there are no repeats",
                },
                "before": scored(self.found.base),
                "after": scored(self.found.best),
            }
        }

    def _rows(self) -> list[dict[str, Any]]:
        best, repaired = self.found.best, self.repaired_rows()
        base = self.found.base.left.residual
        after = base if best is None else best.left.residual
        return [
            {
                "row": row,
                **{
                    f"p{k + 1}_kpa": float(p) / PA_PER_KPA
                    for k, p in enumerate(self.table.pressure[i])
                },
                "load_kg": float(self.table.load[i]),
                "angle_deg": float(self.table.angle[i]) * DEG_PER_RAD,
                "before_deg": float(base[i]) * DEG_PER_RAD,
                "after_deg": None if best is None else float(after[i]) * DEG_PER_RAD,
                "repaired": row in repaired,
            }
            for i, row in enumerate(self.table.rows)
        ]

    def _next(self) -> str | None:
        best = self.found.best
        if best is None:
            return None
        doubtful = [n for other in self.found.tied for n in best.names if n not in other.names]
        return effect(doubtful[0] if doubtful else best.names[-1]).separating
