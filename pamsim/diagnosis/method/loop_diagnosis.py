"""Diagnose a loop: whether a reversible curve is enough for it, and if not, what opens it.

The base model is the best reversible curve there is: one free value per input level, whatever its
shape. It cannot differ between rising and falling input. Where there is no memory, the two readings
at a level may be exchanged: every p-value here counts such exchanges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.evidence import Share
from pamsim.diagnosis.method.loop_effects import LOOP_EFFECTS, LoopEffect
from pamsim.diagnosis.method.loop_fit import Loop, LoopFitter, LoopModel
from pamsim.diagnosis.method.verdict import Evidence, Verdict, decide
from pamsim.diagnosis.method.verdict_thresholds import SIGNIFICANCE


@dataclass(frozen=True, kw_only=True)
class LoopDiagnosis:
    """What opens a loop.

    Attributes:
        verdict: see `Verdict`.
        base: the reversible curve.
        best: model of the effect that predicts unseen readings significantly better; None without
            one.
        nearest: the best model, or else the one that predicts unseen readings best; None where no
            effect was tried.
        tied: models of other effects that predict unseen readings as well.
        forms: models of other forms of the best effect that do.
        attempts: all models with an effect, the best at unseen readings first.
        level: (m,) inputs at which both branches were read.
        measured: (2, m) rising and falling output there [unit of the output].
        reversible: (m,) the curve there [unit of the output].
        fitted: (2, m) rising and falling output there of `nearest` [unit of the output];
            None without one.
        error: (m,) standard error of `difference` [unit of the output]; None if it is not known.
        p_value: that the residual does not depend on the direction.
        floor: root mean square standard error of the readings [unit of the output], or None.
        explained: share of the mean square at unseen readings that the best model removes.
    """

    verdict: Verdict
    base: LoopModel
    best: LoopModel | None
    nearest: LoopModel | None
    tied: tuple[LoopModel, ...]
    forms: tuple[LoopModel, ...]
    attempts: tuple[LoopModel, ...]
    level: FloatArray
    measured: FloatArray
    reversible: FloatArray
    fitted: FloatArray | None
    error: FloatArray | None
    p_value: float
    floor: float | None
    explained: Share

    @property
    def difference(self) -> FloatArray:
        """(m,) rising minus falling output [unit of the output]."""
        rising, falling = self.measured
        return rising - falling


def diagnose_loop(
    loop: Loop, effects: Sequence[LoopEffect] = LOOP_EFFECTS, *, seed: int = 0
) -> LoopDiagnosis:
    """Find out what opens a loop.

    Args:
        loop: readings at the same levels up and down.
        effects: what may open it.
        seed: random seed of exchanges and sign flips.

    Raises:
        InputError: if fewer than five levels were read on both branches.
    """
    fitter = LoopFitter(loop, effects, seed)
    base = fitter.base()
    models = sorted(fitter.models(base), key=fitter.loss)
    accepted = [m for m in models if m.accepted]
    best = min(accepted, key=fitter.loss) if accepted else None
    p_value = fitter.direction()
    as_good: list[LoopModel] = []
    explained, remainder = Share(value=0.0, interval95=None), False
    if best is not None:
        as_good = [m for m in models if m is not best and fitter.tied(m, best, base)]
        explained = fitter.share(best, base)
        others = [m for m in models if m is not best]
        remainder = fitter.remainder(best, others) < SIGNIFICANCE
    tied = tuple(m for m in as_good if _name(m) != _name(best))
    verdict = decide(
        Evidence(
            claimed=best is not None,
            gap=p_value < SIGNIFICANCE,
            explained=explained.value,
            remainder=remainder,
            large_remainder=remainder,
            tied=bool(tied),
        )
    )
    nearest = best or next(iter(models), None)
    return LoopDiagnosis(
        verdict=verdict,
        base=base,
        best=best,
        nearest=nearest,
        tied=tied,
        forms=tuple(m for m in as_good if _name(m) == _name(best)),
        attempts=tuple(models),
        level=fitter.levels[fitter.both],
        measured=fitter.branches(loop.output),
        reversible=fitter.branches(loop.output + base.residual)[0],
        fitted=None if nearest is None else fitter.branches(loop.output + nearest.residual),
        error=fitter.difference_error(),
        p_value=p_value,
        floor=None if loop.error is None else float(np.sqrt(np.mean(loop.error**2))),
        explained=explained,
    )


def _name(model: LoopModel | None) -> str | None:
    """Name of a model's effect; its forms are one effect."""
    return None if model is None or model.effect is None else model.effect.name
