"""A model of a table's rows with some effects freed, judged by rows it has not seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.errors import InputError
from pamsim.diagnosis.method.evidence import Improvement, compare_rows
from pamsim.diagnosis.method.row_fit import RowFit, RowSimulator, fit_rows
from pamsim.diagnosis.method.row_leave_one_out import left_out, linearised_left_out
from pamsim.diagnosis.method.verdict_thresholds import SIGNIFICANCE
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.leave_one_out import LeftOut, jackknife_reach95

_ANCHORS = 2  # fits to predictions that are exact at the end of the one before
_INVISIBLE = 1e-7  # rad, change of a row that counts as none


@dataclass(frozen=True, kw_only=True)
class RowEffect:
    """An effect that may be missing.

    Attributes:
        name: of the effect.
        family: effects of one family have similar signatures in most data.
        parameters: what it frees, the one that measures its size first.
        neutral: values at which it is absent [SI]; none for numbers that mean nothing then.
        starts: values that a fit begins from.
    """

    name: str
    family: str
    parameters: tuple[FreeParameter, ...]
    neutral: Mapping[str, float]
    starts: tuple[Mapping[str, float], ...]


@dataclass(frozen=True, kw_only=True)
class RowModel:
    """A fitted model.

    Attributes:
        effects: that were freed beside the nuisance parameters.
        fit: to all rows.
        left_out: errors at rows, each by the fit without it.
        improvement: over the model that it was made from; None for the base model.
        p_value: that the best of all effects that were tried would fit as well by chance, see
            `pamsim.inference.permutation.best_of_many_p_values`; 1 for the base model.
    """

    effects: tuple[RowEffect, ...]
    fit: RowFit
    left_out: LeftOut
    improvement: Improvement | None = None
    p_value: float = 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect in self.effects)

    @property
    def family(self) -> str:
        """Families of the effects, joined by ``+``."""
        return "+".join(dict.fromkeys(effect.family for effect in self.effects))

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """Parameter -> 95 % interval [SI]."""
        reach = jackknife_reach95(self.left_out.values).tolist()
        return {
            p.name: (self.fit.values[p.name] - r, self.fit.values[p.name] + r)
            for p, r in zip(self.fit.parameters, reach, strict=True)
        }

    def sizes_known(self) -> bool:
        """Whether the size of every effect is inside its range and its interval off neutral."""
        intervals, ends = self.intervals, self.fit.at_bound
        for effect in self.effects:
            size = effect.parameters[0].name
            low, high = intervals[size]
            if low <= effect.neutral[size] <= high or size in ends:
                return False
        return True

    @property
    def accepted(self) -> bool:
        """Whether its last effect may be claimed.

        It must predict unseen rows better, and fit better than the best of so many effects would
        by chance.
        """
        better = self.improvement is not None and self.improvement.p_value < SIGNIFICANCE
        return better and self.p_value < SIGNIFICANCE and self.sizes_known()


class RowModels:
    """Fits models of rows, each from another.

    Args:
        simulator: of the rows.
        nuisance: parameters that are refitted with every effect.
        seed: random seed of the sign flips.
    """

    def __init__(
        self, simulator: RowSimulator, nuisance: Sequence[FreeParameter], seed: int
    ) -> None:
        self.simulator = simulator
        self.nuisance = tuple(nuisance)
        self.seed = seed

    def base(self) -> RowModel | None:
        """The model without effects; None if it predicts nothing."""
        start = {p.name: p.start for p in self.nuisance}
        self.anchor(start)
        fit = fit_rows(self.simulator, self.nuisance, [start])
        if fit is None:
            return None
        model = RowModel(effects=(), fit=fit, left_out=left_out(self.simulator, fit))
        return self.settled(model, None)

    def settled(self, model: RowModel, parent: RowModel | None) -> RowModel:
        """A model fitted again with predictions that are exact where it ends."""
        fit = model.fit
        if self.simulator.anchor is None:
            return self._judged(model.effects, fit, parent, model.p_value)
        for _ in range(_ANCHORS):
            self.anchor(fit.values)
            fit = fit_rows(self.simulator, fit.parameters, [fit.values]) or fit
        return self._judged(model.effects, fit, parent, model.p_value)

    def fits(
        self, parent: RowModel, effects: Sequence[RowEffect]
    ) -> list[tuple[RowEffect, RowFit, float]]:
        """A model fitted with each effect added, best first by linearised left-out error.

        Args:
            parent: what they are added to.
            effects: to add, one at a time.

        Returns:
            Effect, fit and that error [SI]; effects without a prediction are left out.
        """
        fits: list[tuple[RowEffect, RowFit, float]] = []
        for effect in effects:
            parameters = (*parent.fit.parameters, *effect.parameters)
            if len({p.name for p in parameters}) < len(parameters):
                continue
            starts = [{**parent.fit.values, **start} for start in effect.starts]
            fit = fit_rows(self.simulator, parameters, starts)
            if fit is not None and fit.residual.size > len(parameters) + 1:
                error = float(np.sqrt(np.mean(linearised_left_out(fit) ** 2)))
                fits.append((effect, fit, error))
        return sorted(fits, key=lambda entry: entry[2])

    def refit(self, effects: Sequence[RowEffect], near: RowModel) -> RowModel | None:
        """The model with these effects, begun from another that has some of them."""
        parameters = (*self.nuisance, *(p for e in effects for p in e.parameters))
        if len({p.name for p in parameters}) < len(parameters):
            return None
        known = {**{p.name: p.start for p in self.nuisance}, **near.fit.values}
        starts: list[dict[str, float]] = []
        for number in range(max((len(e.starts) for e in effects), default=1)):
            start = dict(known)
            for effect in effects:
                fresh = effect.starts[number % len(effect.starts)]
                start = {**fresh, **start} if effect.name in near.names else {**start, **fresh}
            starts.append(start)
        fit = fit_rows(self.simulator, parameters, starts)
        return None if fit is None else self._judged(tuple(effects), fit, near, 1.0)

    def with_effect(
        self, parent: RowModel, effect: RowEffect, fit: RowFit, p_value: float
    ) -> RowModel | None:
        """A fit of `fits` as a model; None if without some row there is no prediction."""
        try:
            return self._judged((*parent.effects, effect), fit, parent, p_value)
        except InputError:
            return None

    def compare(self, before: RowModel, after: RowModel) -> Improvement:
        """By how much one model predicts unseen rows better than another."""
        return compare_rows(before.left_out.residual, after.left_out.residual, seed=self.seed)

    def moves(self, base: RowModel, effect: RowEffect) -> bool:
        """Whether an effect moves any row at one of its starts."""
        sets = [{**base.fit.values, **start} for start in effect.starts]
        return any(
            residual is None or float(np.max(np.abs(residual - base.fit.residual))) > _INVISIBLE
            for residual in self.simulator.many(sets)
        )

    def anchor(self, values: Mapping[str, float]) -> None:
        """Make predictions exact at these values [SI]."""
        if self.simulator.anchor is not None:
            self.simulator.anchor(values)

    def _judged(
        self, effects: tuple[RowEffect, ...], fit: RowFit, parent: RowModel | None, p_value: float
    ) -> RowModel:
        left = left_out(self.simulator, fit)
        improvement = None
        if parent is not None:
            improvement = compare_rows(parent.left_out.residual, left.residual, seed=self.seed)
        return RowModel(
            effects=effects, fit=fit, left_out=left, improvement=improvement, p_value=p_value
        )
