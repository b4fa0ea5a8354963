"""Whether a reversible curve is enough for a loop, and if not, what opens it.

The base model is the best reversible curve there is: one free value per input level, whatever its
shape. What it cannot do is differ between rising and falling input. Where there is no memory, the
two readings at a level may be exchanged: that is what every p-value here is counted over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.diagnosis.method.loop_effects import CANDIDATES, LoopEffect
from pamsim.diagnosis.method.loop_fit import LoopFitter
from pamsim.diagnosis.method.loop_model import Loop, LoopModel
from pamsim.diagnosis.method.row_model import SIGNIFICANCE
from pamsim.diagnosis.method.static_diagnosis import NAMED
from pamsim.diagnosis.method.verdict import Verdict

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class LoopDiagnosis:
    """What opens a loop.

    Attributes:
        verdict: see `pamsim.diagnosis.method.verdict.Verdict`.
        base: the reversible curve.
        best: model of the claimed candidate; None if none is claimed.
        tied: others that predict unseen readings as well.
        tried: all of them, the best at unseen readings first.
        level: (m,) inputs at which both branches were read.
        difference: (m,) rising less falling there [unit of the output].
        p_value: that the sign of the residual does not follow the direction.
        floor: root mean square standard error of the readings [unit of the output], or None.
        explained: share of the mean square at unseen readings that the best model removes.
    """

    verdict: Verdict
    base: LoopModel
    best: LoopModel | None
    tied: tuple[LoopModel, ...]
    tried: tuple[LoopModel, ...]
    level: FloatArray
    difference: FloatArray
    p_value: float
    floor: float | None
    explained: float


def diagnose_loop(
    loop: Loop, candidates: Sequence[LoopEffect] = CANDIDATES, *, seed: int = 0
) -> LoopDiagnosis:
    """Find out what opens a loop.

    Args:
        loop: readings at the same levels up and down.
        candidates: what may open it.
        seed: of exchanges and sign flips.

    Raises:
        InputError: if fewer than five levels were read on both branches.
    """
    fitter = LoopFitter(loop, candidates, seed)
    base = fitter.base()
    models = sorted(fitter.models(base), key=fitter.loss)
    able = [m for m in models if m.earned]
    best = min(able, key=fitter.loss) if able else None
    p_value = fitter.direction()
    tied: tuple[LoopModel, ...] = ()
    explained = 0.0
    if best is not None:
        tied = tuple(m for m in models if m is not best and fitter.tied(m, best, base))
        explained = 1.0 - fitter.loss(best) / fitter.loss(base)
    return LoopDiagnosis(
        verdict=_verdict(best, tied, explained, p_value),
        base=base,
        best=best,
        tied=tied,
        tried=tuple(models),
        level=fitter.levels[fitter.both],
        difference=fitter.difference,
        p_value=p_value,
        floor=None if loop.error is None else float(np.sqrt(np.mean(loop.error**2))),
        explained=explained,
    )


def _verdict(
    best: LoopModel | None, tied: Sequence[LoopModel], explained: float, p_value: float
) -> Verdict:
    if best is None or best.effect is None:
        return Verdict.UNEXPLAINED if p_value < SIGNIFICANCE else Verdict.NO_GAP
    if any(m.effect is not None and m.effect.family != best.effect.family for m in tied):
        return Verdict.AMBIGUOUS
    return Verdict.NAMED if explained > NAMED else Verdict.NAMED_WITH_REMAINDER
