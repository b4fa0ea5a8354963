"""Diagnose a table of angles at rest, whose rows have no repeats.

Effects are added one at a time, as long as the errors at rows left out fall significantly, and
removed again if others predict as well without them. There is no noise floor: without repeats it is
not known what a perfect model would still miss.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.computation import Progress, Steps
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.absent_limits import AbsentLimit, supported
from pamsim.diagnosis.method.evidence import Share, share_of_rows
from pamsim.diagnosis.method.row_fit import RowSimulator
from pamsim.diagnosis.method.row_model import RowEffect, RowModel, RowModels
from pamsim.diagnosis.method.row_search import MOST_STEPS, Attempt, RowSearch
from pamsim.diagnosis.method.verdict import Evidence, Verdict, decide
from pamsim.diagnosis.method.verdict_thresholds import FEWEST_ROWS
from pamsim.diagnosis.method.where import ResidualMap, row_maps, systematic
from pamsim.inference.free_parameter import FreeParameter


@dataclass(frozen=True, kw_only=True)
class RowDiagnosis:
    """The result of a diagnosis of rows.

    Attributes:
        verdict: see `Verdict`.
        base: the refitted model without effects.
        best: the model with the effects that predict unseen rows better; None without any.
        tied: models with another effect in place of one, that predict unseen rows as well.
        explained: share of the base model's mean square at unseen rows that the best one removes.
        before: maps of what the base model misses, the most significant first.
        after: the same of the best model; empty without one.
        attempts: every effect that was added to a model.
        moving: names of effects that move a row at all.
        absent: how large the other effects could be.
        evaluations: parameter sets predicted.
    """

    verdict: Verdict
    base: RowModel
    best: RowModel | None
    tied: tuple[RowModel, ...]
    explained: Share
    before: tuple[ResidualMap, ...]
    after: tuple[ResidualMap, ...]
    attempts: tuple[Attempt, ...]
    moving: tuple[str, ...]
    absent: tuple[AbsentLimit, ...]
    evaluations: int


def diagnose_rows(
    simulator: RowSimulator,
    nuisance: Sequence[FreeParameter],
    effects: Sequence[RowEffect],
    quantities: Mapping[str, FloatArray],
    names: Sequence[str],
    *,
    channel: str = "angle_at_rest",
    along: FloatArray | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> RowDiagnosis:
    """Find where a model misses rows of a table and name the missing effects.

    Args:
        simulator: of the rows.
        nuisance: parameters that are refitted with every effect, which must do better.
        effects: that may be missing.
        quantities: over which the misfit is mapped, each (n,) [SI].
        names: of the rows.
        channel: what the table measures.
        along: (n,) sign with which a row's misfit is mapped, such as that of the angle, so that
            falling short in either direction counts the same; 1 if left out.
        seed: random seed of sign flips and exchanges.
        progress: called as each round of fits begins; how many there will be is an upper estimate.

    Raises:
        InputError: if the base model predicts nothing, or the rows are fewer than its parameters.
    """
    steps = Steps(progress, 1 + MOST_STEPS)
    steps.begin("base model")
    models = RowModels(simulator, nuisance, seed)
    base = models.base()
    if base is None:
        raise InputError(
            "the base model has no angle at rest for some row; check the rig's parameters and the"
            " table's units"
        )
    sign = np.ones(len(names)) if along is None else along

    def mapped(model: RowModel) -> tuple[ResidualMap, ...]:
        misfit = -model.fit.residual * sign
        return row_maps(misfit, quantities, tuple(names), channel=channel, seed=seed)

    moving = [effect for effect in effects if models.moves(base, effect)]
    search = RowSearch(models, moving, steps)
    best = search.forward(base)
    steps.expect(1 + len(best.effects))
    if best.effects:
        best = search.backward(best)
    tied = search.rivals(best, base) if best.effects else ()
    before, after = mapped(base), mapped(best) if best.effects else ()
    explained = Share(value=0.0, interval95=None)
    if best.effects:
        explained = share_of_rows(base.left_out.residual, best.left_out.residual)
    remainder = systematic(after)
    verdict = decide(
        Evidence(
            claimed=bool(best.effects),
            gap=systematic(before),
            conclusive=len(names) >= FEWEST_ROWS,
            explained=explained.value,
            remainder=remainder,
            large_remainder=remainder,
            tied=bool(tied),
        )
    )
    return RowDiagnosis(
        verdict=verdict,
        base=base,
        best=best if best.effects else None,
        tied=tied,
        explained=explained,
        before=before,
        after=after,
        attempts=tuple(search.attempts),
        moving=tuple(effect.name for effect in moving),
        absent=supported(
            search.absent(best),
            verdict,
            {effect.name: effect.family for effect in effects},
            [model.names for model in (best, *tied)],
        ),
        evaluations=simulator.evaluations,
    )
