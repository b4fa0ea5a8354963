"""Forward, backward and sideways through sets of effects, judged by rows left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pamsim.core.errors import InputError
from pamsim.diagnosis.method.row_fit import RowFit
from pamsim.diagnosis.method.row_held_out import linearised_reach95
from pamsim.diagnosis.method.row_model import SIGNIFICANCE, RowEffect, RowModel, RowModels
from pamsim.diagnosis.method.row_permutation import luck
from pamsim.diagnosis.method.verdict import TIE_ERRORS

_BEAM = (2, 1, 1, 1)  # models that are carried on from each round, one effect more in each
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


class RowSearch:
    """Finds the set of effects that predicts unseen rows best, and what could stand in for it.

    Args:
        models: makes models from one another.
        effects: that may be missing.
        say: is told what is being tried.

    Attributes:
        tried: every effect that was added to a model.
    """

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
        for width in _BEAM:
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
                try:
                    settled = self.models.settled(model, parent)
                except InputError:  # it has a balance of torques where it does not come to rest
                    continue
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
