"""What a diagnosis of a length-pressure loop says, to a person and to a file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_KPA
from pamsim.diagnosis.method.loop_diagnosis import LoopDiagnosis
from pamsim.diagnosis.method.loop_model import Loop, LoopModel
from pamsim.diagnosis.method.row_evidence import rms_interval95
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.report import SCHEMA

CHANNEL = "length"

_MM_PER_M = 1e3


@dataclass(frozen=True, kw_only=True)
class LoopReport:
    """A diagnosis of a loop with what it was made from.

    Attributes:
        source: what the readings are, in words.
        loop: the readings.
        found: the diagnosis.
        notes: what a reader should know, one sentence each.
        seed: of exchanges and sign flips.
        seconds: it took.
    """

    source: str
    loop: Loop
    found: LoopDiagnosis
    notes: tuple[str, ...]
    seed: int
    seconds: float

    def sentence(self) -> str:
        """The verdict for a person."""
        found, best = self.found, self.found.best
        base = found.base.unseen_rms * _MM_PER_M
        if best is None or best.effect is None:
            like = found.tried[0]
            return (
                f"Nothing is claimed to open this loop: a reversible curve misses unseen readings"
                f" by {base:.2f} mm RMS; the best resemblance, {like.name}, by"
                f" {like.unseen_rms * _MM_PER_M:.2f} mm, which luck does in"
                f" {100.0 * like.luck:.0f} % of cases."
            )
        others = sorted({m.effect.missing for m in found.tied if m.effect is not None})
        rivals = [missing for missing in others if missing != best.effect.missing]
        doubt = f" ({' or '.join(rivals)} would do as well)" if rivals else ""
        return (
            f"A reversible curve lacks {best.effect.missing}{doubt}: error at unseen readings"
            f" {base:.2f} mm RMS before, {best.unseen_rms * _MM_PER_M:.2f} mm after."
        )

    def as_dict(self) -> dict[str, Any]:
        """The content of ``diagnosis.json``, units in the key names."""
        found = self.found
        worst = int(np.argmax(np.abs(found.difference)))
        return {
            "schema": SCHEMA,
            "kind": "length_pressure_loop",
            "source": self.source,
            "verdict": str(found.verdict),
            "sentence": self.sentence(),
            "effects": [] if found.best is None else [_effect(found.best, found.explained)],
            "alternatives": [_effect(model, None) for model in found.tied],
            "where": [
                {
                    "channel": CHANNEL,
                    "protocol": "loop",
                    "quantity": "direction",
                    "region": [float(found.level[worst]) / PA_PER_KPA] * 2,
                    "unit": "kPa",
                    "mean_difference_mm": float(np.mean(found.difference)) * _MM_PER_M,
                    "largest_difference_mm": float(found.difference[worst]) * _MM_PER_M,
                    "p_value": found.p_value,
                    "levels_kpa": (found.level / PA_PER_KPA).tolist(),
                    "rising_less_falling_mm": (found.difference * _MM_PER_M).tolist(),
                }
            ],
            "gap": {
                CHANNEL: {
                    "held_out": "each reading from the other at its pressure and all others",
                    "floor_mm": None if found.floor is None else found.floor * _MM_PER_M,
                    "before": self._scored(found.base),
                    "after": None if found.best is None else self._scored(found.best),
                }
            },
            "tried": [
                {
                    **_effect(model, None),
                    "loop_rms_mm": model.rms * _MM_PER_M,
                    "unseen_rms_mm": model.unseen_rms * _MM_PER_M,
                    "p_value_unseen": None if model.gain is None else model.gain.p_value,
                    "p_value_luck": model.luck,
                    "earned": model.earned,
                }
                for model in found.tried
            ],
            "next_experiment": self.next_experiment(),
            "notes": list(self.notes),
            "seed": self.seed,
            "seconds": self.seconds,
        }

    def next_experiment(self) -> str | None:
        """What to measure next; None if the question is settled."""
        if self.found.verdict is Verdict.NO_GAP:
            return "more runs of the same loop, each reading recorded, not their mean alone"
        if self.found.verdict is Verdict.AMBIGUOUS:
            return "the same loop at a tenth of the rate: creep closes it, hysteresis does not"
        return None

    def _scored(self, model: LoopModel) -> dict[str, Any]:
        ends = rms_interval95(model.unseen, seed=self.seed)
        return {
            "value_mm": model.unseen_rms * _MM_PER_M,
            "interval95_mm": [end * _MM_PER_M for end in ends],
            "in_sample_mm": model.rms * _MM_PER_M,
        }


def _effect(model: LoopModel, explained: float | None) -> dict[str, Any]:
    assert model.effect is not None
    return {
        "name": model.effect.family,
        "family": model.effect.family,
        "operator": model.effect.name,
        "missing": model.effect.missing,
        "parameters": {
            "opening": {
                "value": model.opening * _MM_PER_M,
                "unit": "mm",
                "interval95": [end * _MM_PER_M for end in model.interval95],
            },
            **(
                {model.effect.shape: {"value": model.shape, "unit": "1", "interval95": None}}
                if model.effect.shape
                else {}
            ),
        },
        "explained": explained,
        "p_value": model.luck,
    }
