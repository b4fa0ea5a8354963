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
from pamsim.diagnosis.row_fit import RowFit, RowSimulator, linearised_reach95
from pamsim.diagnosis.row_luck import luck
from pamsim.diagnosis.row_model import SIGNIFICANCE, RowEffect, RowModel, RowModels
from pamsim.diagnosis.row_where import RowMap, row_maps
from pamsim.diagnosis.verdict import NAMED, PARTLY, TIE_ERRORS, Verdict
from pamsim.sysid.free_parameter import FreeParameter

FloatArray = NDArray[np.float64]

FEWEST_ROWS = 10
"""Rows below which no number of signs can be surprising enough to name one of twenty effects."""

MOST_EFFECTS = 4
_BEAM = (2, 1, 1, 1)  # models that are carried on from each round
_REFITTED = 5  # models of a round that are refitted without each row


@dataclass(frozen=True, kw_only=True)
class Tried:
    """An effect that was added to a model.

    Attributes:
        beside: names of the effects that the model had.
        name: of the effect.
        rms: over the rows [SI].
        left_out_rms: over rows left out [SI]; linearised where ``p_value`` is None.
        p_value: of no gain at rows left out.
        luck: chance that the best of all effects would fit as well on rows in any other order.
        earned: whether it may be claimed.
    """

    beside: tuple[str, ...]
    name: str
    rms: float
    left_out_rms: float
    p_value: float | None
    luck: float
    earned: bool


@dataclass(frozen=True, kw_only=True)
class StaticDiagnosis:
    """All that a diagnosis of rows found.

    Attributes:
        verdict: see `pamsim.diagnosis.verdict.Verdict`.
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
    search = _Search(models, moving, say)
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


class _Search:
    """Forward, backward and sideways through sets of effects."""

    def __init__(
        self, models: RowModels, effects: Sequence[RowEffect], say: Callable[[str], None]
    ) -> None:
        self.models = models
        self.effects = tuple(effects)
        self.say = say
        self.tried: list[Tried] = []
        self._fits: dict[tuple[str, ...], list[tuple[RowEffect, RowFit, float]]] = {}

    def forward(self, base: RowModel) -> RowModel:
        """Add effects while they earn their place over their parent and over the best so far."""
        best, beam = base, [base]
        for width in _BEAM[:MOST_EFFECTS]:
            earned: dict[frozenset[str], tuple[RowModel, RowModel]] = {}
            for parent in beam:
                self.models.anchor(parent.fit.values)
                for model in self._extended(parent):
                    key = frozenset(model.names)
                    if key not in earned or model.left.rms < earned[key][0].left.rms:
                        earned[key] = model, parent
            beam = []
            able = sorted(earned.values(), key=lambda pair: pair[0].left.rms)
            for model, parent in able[:width]:
                settled = self.models.settled(model, parent)
                better = self.models.compare(best, settled).p_value < SIGNIFICANCE
                if settled.earned and better:
                    beam.append(settled)
            if not beam:
                break
            best = min(beam, key=lambda m: m.left.rms)
        return best

    def backward(self, best: RowModel) -> RowModel:
        """Take away effects that the others make superfluous."""
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
        found: list[RowModel] = []
        whole = self.models.compare(base, best).gain
        self.models.anchor(best.fit.values)
        for number, given_up in enumerate(best.effects):
            self.say(f"in place of {given_up.name}")
            rest = self._without(best, number)
            fits = self._beside(rest)
            chances = luck(rest.fit, [fit for _, fit, _ in fits], seed=self.models.seed)
            for (effect, fit, error), chance in zip(fits, chances, strict=True):
                near = error < 2.0 * best.left.rms and effect.name not in best.names
                if not near or chance > SIGNIFICANCE:
                    continue
                model = self.models.with_effect(rest, effect, fit, chance)
                if model is None:
                    continue
                behind = self.models.compare(model, best)
                gain = self.models.compare(base, model).gain
                if behind.in_errors < TIE_ERRORS and gain > 0.5 * whole:
                    found.append(model)
        return tuple(sorted(found, key=lambda m: m.left.rms))

    def absent(self, best: RowModel) -> dict[str, tuple[str, float]]:
        """What of every other effect the rows allow beside the best model."""
        self.models.anchor(best.fit.values)
        self.say("what is absent")
        found: dict[str, tuple[str, float]] = {}
        for effect, fit, _ in self._beside(best):
            size = effect.parameters[0]
            reach = linearised_reach95(fit)[len(best.fit.parameters)]
            low = max(fit.values[size.name] - reach, size.low)
            high = min(fit.values[size.name] + reach, size.high)
            neutral = effect.neutral[size.name]
            found[effect.name] = size.name, max(abs(low - neutral), abs(high - neutral))
        return found

    def _beside(self, parent: RowModel) -> list[tuple[RowEffect, RowFit, float]]:
        """The model fitted with each further effect, best first; fits are made once."""
        if parent.names not in self._fits:
            others = [e for e in self.effects if e.name not in parent.names]
            self._fits[parent.names] = self.models.fits(parent, others)
        return self._fits[parent.names]

    def _extended(self, parent: RowModel) -> list[RowModel]:
        """Models with one effect more that have earned it."""
        self.say(" + ".join((*parent.names, "another effect")))
        found: list[RowModel] = []
        fits = self._beside(parent)
        chances = luck(parent.fit, [fit for _, fit, _ in fits], seed=self.models.seed)
        for number, ((effect, fit, error), chance) in enumerate(zip(fits, chances, strict=True)):
            model = None
            if number < _REFITTED:
                model = self.models.with_effect(parent, effect, fit, chance)
                if model is not None and model.earned:
                    found.append(model)
            self.tried.append(
                Tried(
                    beside=parent.names,
                    name=effect.name,
                    rms=fit.rms,
                    left_out_rms=error if model is None else model.left.rms,
                    p_value=None if model is None or model.gain is None else model.gain.p_value,
                    luck=chance,
                    earned=bool(found) and found[-1] is model,
                )
            )
        return found

    def _without(self, model: RowModel, number: int) -> RowModel:
        """The model refitted without one of its effects."""
        effects = [e for i, e in enumerate(model.effects) if i != number]
        found = self.models.refit(effects, model)
        assert found is not None  # nested in one that predicts
        return found
