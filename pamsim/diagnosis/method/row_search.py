"""Search for sets of effects in a table's rows: forward, backward, and rivals of the result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.computation import Steps
from pamsim.core.errors import InputError
from pamsim.diagnosis.method.absent_limits import (
    NOT_SHOWN,
    OUT_OF_RANGE,
    AbsentLimit,
    farthest,
)
from pamsim.diagnosis.method.row_fit import RowFit
from pamsim.diagnosis.method.row_leave_one_out import linearised_reach95
from pamsim.diagnosis.method.row_model import RowEffect, RowModel, RowModels
from pamsim.diagnosis.method.verdict_thresholds import SIGNIFICANCE, TIE_ERRORS, TIE_SHARE
from pamsim.inference.permutation import best_of_many_p_values

_BEAM = (2, 1, 1, 1)  # models that are carried on from each round, one effect more in each
MOST_STEPS = 1 + sum(_BEAM[:-1]) + len(_BEAM) + 1
"""Steps that a search announces at most: models beside which further effects are tried, effects in
whose place others are, and limits."""
_REFITTED = 5  # models of a round that are refitted without each row
_NEAR = 2.0  # times the best model's error, up to which an effect may be a rival


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """An effect that was added to a model.

    Attributes:
        beside: names of the effects that the model had.
        name: of the effect.
        rms: over the rows [SI].
        left_out_rms: over rows left out [SI]; linearised where ``p_value_unseen`` is None.
        p_value_unseen: of no improvement at rows left out, by sign flips.
        p_value: that the best of all effects would fit as well by chance.
        accepted: whether it may be claimed.
    """

    beside: tuple[str, ...]
    name: str
    rms: float
    left_out_rms: float
    p_value_unseen: float | None
    p_value: float
    accepted: bool


class RowSearch:
    """Finds the set of effects that predicts unseen rows best, and its rivals.

    Args:
        models: fits models from one another.
        effects: that may be missing.
        steps: each model beside which all further effects are tried is one.

    Attributes:
        attempts: every effect that was added to a model.
    """

    def __init__(self, models: RowModels, effects: Sequence[RowEffect], steps: Steps) -> None:
        self.models = models
        self.effects = tuple(effects)
        self.steps = steps
        self.attempts: list[Attempt] = []
        self._fits: dict[tuple[str, ...], list[tuple[RowEffect, RowFit, float]]] = {}

    def forward(self, base: RowModel) -> RowModel:
        """Add effects while they improve on their parent and on the best model so far."""
        best, beam = base, [base]
        for width in _BEAM:
            accepted: dict[frozenset[str], tuple[RowModel, RowModel]] = {}
            for parent in beam:
                self.models.anchor(parent.fit.values)
                for model in self._extended(parent):
                    key = frozenset(model.names)
                    known = accepted.get(key)
                    if known is None or model.left_out.rms < known[0].left_out.rms:
                        accepted[key] = model, parent
            beam = []
            ranked = sorted(accepted.values(), key=lambda pair: pair[0].left_out.rms)
            for model, parent in ranked[:width]:
                try:
                    settled = self.models.settled(model, parent)
                except InputError:  # it has a balance of torques where it does not come to rest
                    continue
                better = self.models.compare(best, settled).p_value < SIGNIFICANCE
                if settled.accepted and better:
                    beam.append(settled)
            if not beam:
                break
            best = min(beam, key=lambda m: m.left_out.rms)
        return best

    def backward(self, best: RowModel) -> RowModel:
        """Remove effects that the others make superfluous."""
        number = 0
        while len(best.effects) > 1 and number < len(best.effects):
            fewer = self._without(best, number)
            if self.models.compare(fewer, best).p_value < SIGNIFICANCE:
                number += 1
            else:
                best, number = self.models.settled(fewer, None), 0
        return best

    def rivals(self, best: RowModel, base: RowModel) -> tuple[RowModel, ...]:
        """Models with another effect in place of one that predict unseen rows as well."""
        rivals: list[RowModel] = []
        whole = self.models.compare(base, best).gain
        self.models.anchor(best.fit.values)
        for number, removed in enumerate(best.effects):
            self.steps.begin(f"in place of {removed.name}")
            rest = self._without(best, number)
            fits = self._beside(rest)
            for (effect, fit, error), p_value in zip(fits, self._p_values(rest, fits), strict=True):
                near = error < _NEAR * best.left_out.rms and effect.name not in best.names
                if not near or p_value > SIGNIFICANCE:
                    continue
                model = self.models.with_effect(rest, effect, fit, p_value)
                if model is None:
                    continue
                behind = self.models.compare(model, best)
                gain = self.models.compare(base, model).gain
                if behind.standard_errors < TIE_ERRORS and gain > TIE_SHARE * whole:
                    rivals.append(model)
        return tuple(sorted(rivals, key=lambda m: m.left_out.rms))

    def absent(self, best: RowModel) -> tuple[AbsentLimit, ...]:
        """What of every other effect the rows allow beside the best model."""
        self.models.anchor(best.fit.values)
        self.steps.begin("limits of absent effects")
        limits: list[AbsentLimit] = []
        for effect, fit, _ in self._beside(best):
            size = effect.parameters[0]
            reach = linearised_reach95(fit)[len(best.fit.parameters)]
            low = max(fit.values[size.name] - reach, size.low)
            high = min(fit.values[size.name] + reach, size.high)
            neutral = effect.neutral[size.name]
            limit = max(abs(low - neutral), abs(high - neutral))
            cannot_tell = None if np.isfinite(reach) else NOT_SHOWN
            if cannot_tell is None and limit >= farthest(size, neutral):
                cannot_tell = OUT_OF_RANGE
            limits.append(
                AbsentLimit(
                    effect=effect.name,
                    parameter=size.name,
                    size=np.nan,
                    limit=limit,
                    cannot_tell=cannot_tell,
                )
            )
        return tuple(limits)

    def _beside(self, parent: RowModel) -> list[tuple[RowEffect, RowFit, float]]:
        """The model fitted with each further effect, best first; fits are made once."""
        if parent.names not in self._fits:
            others = [e for e in self.effects if e.name not in parent.names]
            self._fits[parent.names] = self.models.fits(parent, others)
        return self._fits[parent.names]

    def _p_values(
        self, parent: RowModel, fits: Sequence[tuple[RowEffect, RowFit, float]]
    ) -> list[float]:
        return best_of_many_p_values(
            parent.fit.residual,
            parent.fit.jacobian,
            [(fit.residual, fit.jacobian) for _, fit, _ in fits],
            seed=self.models.seed,
        )

    def _extended(self, parent: RowModel) -> list[RowModel]:
        """Models with one effect more that may be claimed."""
        self.steps.begin(" + ".join((*parent.names, "another effect")))
        accepted: list[RowModel] = []
        fits = self._beside(parent)
        p_values = self._p_values(parent, fits)
        for number, ((effect, fit, error), p_value) in enumerate(zip(fits, p_values, strict=True)):
            model = None
            if number < _REFITTED:
                model = self.models.with_effect(parent, effect, fit, p_value)
            unseen = None if model is None else model.improvement
            if model is not None and model.accepted:
                accepted.append(model)
            self.attempts.append(
                Attempt(
                    beside=parent.names,
                    name=effect.name,
                    rms=fit.rms,
                    left_out_rms=error if model is None else model.left_out.rms,
                    p_value_unseen=None if unseen is None else unseen.p_value,
                    p_value=p_value,
                    accepted=model is not None and model.accepted,
                )
            )
        return accepted

    def _without(self, model: RowModel, number: int) -> RowModel:
        """The model refitted without one of its effects."""
        effects = [e for i, e in enumerate(model.effects) if i != number]
        fewer = self.models.refit(effects, model)
        assert fewer is not None  # nested in one that predicts
        return fewer
