"""Which effects a model lacks that predicts rows of a table: angles at rest, without repeats.

Effects are added one at a time, as long as the errors at rows left out get smaller by more than
luck, and taken away again if others do as well without them. There is no noise floor: without
repeats nobody knows what a perfect model would still miss.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.diagnosis.method.row_fit import RowSimulator
from pamsim.diagnosis.method.row_model import SIGNIFICANCE, RowEffect, RowModel, RowModels
from pamsim.diagnosis.method.row_search import RowSearch, Tried
from pamsim.diagnosis.method.row_where import RowMap, row_maps
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.inference.free_parameter import FreeParameter

FloatArray = NDArray[np.float64]

NAMED, PARTLY = 0.9, 0.5
"""Shares of the base model's misfit that a name must explain: without a remainder, and at all."""

FEWEST_ROWS = 10
"""Rows below which no number of signs can be surprising enough to name one of twenty effects."""


@dataclass(frozen=True, kw_only=True)
class StaticDiagnosis:
    """All that a diagnosis of rows found.

    Attributes:
        verdict: see `pamsim.diagnosis.method.verdict.Verdict`.
        base: the refitted model without effects.
        best: the model with the claimed effects; None if nothing is claimed.
        tied: models with another effect in place of one, that predict unseen rows as well.
        sure: names of the claimed effects that no effect of another family can stand in for.
        explained: share of the base model's mean square at unseen rows that the best one removes.
        before: maps of what the base model misses, the surest first.
        after: the same of the best model; empty without one.
        tried: every effect that was added to a model.
        moving: names of effects that move a row at all.
        absent: effect -> (parameter, largest distance from neutral that the rows allow [SI]).
        evaluations: parameter sets predicted.
    """

    verdict: Verdict
    base: RowModel
    best: RowModel | None
    tied: tuple[RowModel, ...]
    sure: tuple[str, ...]
    explained: float
    before: tuple[RowMap, ...]
    after: tuple[RowMap, ...]
    tried: tuple[Tried, ...]
    moving: tuple[str, ...]
    absent: Mapping[str, tuple[str, float]]
    evaluations: int


def diagnose_rows(
    simulator: RowSimulator,
    ordinary: Sequence[FreeParameter],
    effects: Sequence[RowEffect],
    quantities: Mapping[str, FloatArray],
    names: Sequence[str],
    *,
    along: FloatArray | None = None,
    seed: int = 0,
    told: Callable[[str], None] | None = None,
) -> StaticDiagnosis:
    """Find where a model misses rows of a table and name the missing effects.

    Args:
        simulator: of the rows.
        ordinary: parameters that any effect must beat: they are refitted with every one.
        effects: that may be missing.
        quantities: over which the misfit is mapped, each (n,) [SI].
        names: of the rows.
        along: (n,) sign with which a row's misfit is mapped, such as that of the angle, so that
            falling short in either direction is one thing; 1 if left out.
        seed: of sign flips and exchanges.
        told: is told what is being tried.

    Raises:
        InputError: if the base model predicts nothing, or the rows are fewer than its parameters.
    """
    say = told or (lambda _: None)
    say("base model")
    models = RowModels(simulator, ordinary, seed)
    base = models.base()
    if base is None:
        raise InputError(
            "the base model has no angle at rest for some row; check the rig's parameters and the"
            " table's units"
        )
    sign = np.ones(len(names)) if along is None else along

    def mapped(model: RowModel) -> tuple[RowMap, ...]:
        return row_maps(-model.fit.residual * sign, quantities, tuple(names), seed=seed)

    moving = [effect for effect in effects if models.moves(base, effect)]
    search = RowSearch(models, moving, say)
    best = search.forward(base)
    if best.effects:
        best = search.backward(best)
    tied = search.rivals(best, base) if best.effects else ()
    before, after = mapped(base), mapped(best) if best.effects else ()
    explained = 1.0 - (best.left.rms / base.left.rms) ** 2 if best.effects else 0.0
    verdict = _verdict(best, tied, explained, _systematic(before), _systematic(after))
    if len(names) < FEWEST_ROWS and verdict is not Verdict.NO_GAP:
        verdict = Verdict.NOT_IDENTIFIABLE
    return StaticDiagnosis(
        verdict=verdict,
        base=base,
        best=best if best.effects else None,
        tied=tied,
        sure=tuple(n for n in best.names if (n, True) not in _rivalled(best, tied)),
        explained=explained,
        before=before,
        after=after,
        tried=tuple(search.tried),
        moving=tuple(effect.name for effect in moving),
        absent=search.absent(best),
        evaluations=simulator.evaluations,
    )


def _systematic(maps: Sequence[RowMap]) -> bool:
    """Whether a misfit follows one of its quantities."""
    return any(m.p_value * len(maps) < SIGNIFICANCE for m in maps)


def _verdict(
    best: RowModel, tied: Sequence[RowModel], explained: float, gap: bool, remainder: bool
) -> Verdict:
    if not best.effects:
        return Verdict.UNEXPLAINED if gap else Verdict.NO_GAP
    if remainder and explained < PARTLY:
        return Verdict.UNEXPLAINED
    doubtful = {name for name, family in _rivalled(best, tied) if family}
    if len(doubtful) == len(best.effects):
        return Verdict.AMBIGUOUS
    rest = bool(doubtful) or (remainder and explained < NAMED)
    return Verdict.NAMED_WITH_REMAINDER if rest else Verdict.NAMED


def _rivalled(best: RowModel, tied: Sequence[RowModel]) -> list[tuple[str, bool]]:
    """Effects with a rival, and whether it is of another family."""
    found: list[tuple[str, bool]] = []
    for other in tied:
        (given_up,) = (e for e in best.effects if e.name not in other.names)
        (instead,) = (e for e in other.effects if e.name not in best.names)
        found.append((given_up.name, given_up.family != instead.family))
    return found
