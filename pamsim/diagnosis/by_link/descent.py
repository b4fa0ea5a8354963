"""A fit: descents to the least squares of some links' rows, which end in short time steps."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_runs import Values
from pamsim.comparison.links import Link
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.link_model import LinkModel
from pamsim.inference.bounded_least_squares import BreakdownError, Fit, bounded_least_squares
from pamsim.inference.difference_jacobian import secant_updated

if TYPE_CHECKING:
    from pamsim.diagnosis.by_link.link_fit import LinkFitter

PRIOR = 0.3
"""Standard deviation of a nuisance parameter about what the rig states, as a share of that. It
keeps where it is what the rows of a link do not show; what they show is free of it."""

_REACH = 5.0  # factor either way within which a nuisance parameter is sought
_TOLERANCE = 1e-3  # relative change of the sum of squares that ends a descent
_STEPS = 15  # of one descent
_FAR = 0.02  # relative fall of the sum of squares from which a fit goes on with fresh sensitivities
_DESCENTS = 4  # after the first


class Descent:
    """A fit of what acts in some links; its parameters are in units of `LinkFitter.scale`.

    Args:
        fitter: of the rows.
        begin: model with the values that the fit begins with.
        effects: of the model that is fitted.
        start: values of parameters that begin elsewhere [SI].
        links: whose rows are fitted, see `LinkFitter.fit`.
    """

    def __init__(
        self,
        fitter: LinkFitter,
        begin: LinkModel,
        effects: Sequence[Candidate],
        start: Values,
        links: Collection[Link],
    ) -> None:
        self._fitter, self._begin, self._effects = fitter, begin, tuple(effects)
        nuisance, acts_in = fitter.nuisance, fitter.simulator.acts_in
        own = {p.name: p for effect in effects for p in effect.parameters}
        values = {k: v for k, v in begin.values.items() if k in nuisance or k in own}
        self._values = {**values, **start}
        acts = {name: acts_in([name]) for name in self._values}
        seen = {name: fitter.seen_in(begin, name) for name in own if name not in start}
        wanted = frozenset(links)
        moved = [n for n in own if (acts[n] & wanted if n in start else seen[n] & wanted)]
        self._links = wanted.union(*(seen[n] for n in moved if n in seen))
        self._free = [
            n for n in self._values if n in moved or (n in nuisance and acts[n] <= self._links)
        ]
        self._scale = np.array([fitter.scale(name, effects) for name in self._free])
        ends = [
            sorted((nuisance[n] / _REACH, nuisance[n] * _REACH))
            if n in nuisance
            else (own[n].low, own[n].high)
            for n in self._free
        ]
        self._low, self._high = (np.array([e[k] for e in ends]) / self._scale for k in (0, 1))
        self._stated = np.array([nuisance.get(name, 0.0) for name in self._free]) / self._scale
        self._weight = np.array([1.0 / PRIOR if n in nuisance else 0.0 for n in self._free])
        self._known = {
            k: v for k, v in begin.sensitivities.items() if k in self._free and k not in start
        }
        self._about = begin  # the model in whose time steps rows are
        self._residuals: dict[bytes, FloatArray | None] = {}

    def fitted(self) -> LinkModel | None:
        """The model, or None if the simulation breaks down where it begins."""
        start = np.array([self._values[name] for name in self._free]) / self._scale
        fit = self._descended(start, self._known)
        # Those of another model, and those that only followed the steps, end a fit too soon.
        for _ in range(_DESCENTS):
            if fit is None or not _far(fit):
                break
            fit = self._descended(fit.x, {}) or fit
        model = None if fit is None else self._model_at(fit.x)
        if fit is None or model is None:
            return None
        columns = fit.jacobian[: self._fitter.link_of.size]
        known = {name: columns[:, i] for i, name in enumerate(self._free)}
        place = fit.x
        for _ in range(_DESCENTS):
            short = self._fitter.in_short_steps(model, self._links)
            if short is None:
                return None
            self._about = short
            # What shorter steps change may itself change on the way: a lag as short as a step.
            again = self._descended(place, known)
            place = place if again is None else again.x
            model = self._model_at(place)
            if model is None:
                return None
            if again is None or not _far(again):
                break
        return replace(model, sensitivities={**model.sensitivities, **known})

    def _descended(self, place: FloatArray, known: Mapping[str, FloatArray]) -> Fit | None:
        try:
            return bounded_least_squares(
                self._rows_at,
                [np.clip(place, self._low, self._high)],
                lower=self._low,
                upper=self._high,
                jacobian=secant_updated(lambda at, _: self._columns(at, known)),
                x_scale=1.0,
                tolerance=_TOLERANCE,
                max_steps=_STEPS,
            )
        except BreakdownError:
            return None

    def _values_at(self, place: FloatArray) -> dict[str, float]:
        return self._values | dict(zip(self._free, (place * self._scale).tolist(), strict=True))

    def _residuals_at(self, places: Sequence[FloatArray]) -> list[FloatArray | None]:
        # A further descent begins where the last one has ended.
        new = [place for place in places if place.tobytes() not in self._residuals]
        sets = [self._values_at(place) for place in new]
        found = self._fitter.simulate(sets, [self._links] * len(new), self._begin)
        self._residuals.update((p.tobytes(), r) for p, r in zip(new, found, strict=True))
        beyond = self._about.offset - self._begin.offset
        known = [self._residuals[place.tobytes()] for place in places]
        return [None if r is None else r + beyond for r in known]

    def _rows_at(self, places: FloatArray) -> list[FloatArray | None]:
        return [
            None
            if r is None
            else np.append(self._fitter.whiten(r), self._weight * (place - self._stated))
            for place, r in zip(places, self._residuals_at(list(places)), strict=True)
        ]

    def _columns(self, place: FloatArray, known: Mapping[str, FloatArray]) -> FloatArray:
        fresh = [name for name in self._free if name not in known]
        at = self._model_at(place) if fresh else None
        if at is not None:
            known = {**known, **self._fitter.sensitivities(at, fresh, self._links)}
        none = np.zeros(self._fitter.link_of.size)
        own = [known.get(name, none) for name in self._free]
        return np.vstack([np.stack(own, axis=1), np.diag(self._weight)])

    def _model_at(self, place: FloatArray) -> LinkModel | None:
        (residual,) = self._residuals_at([place])
        if residual is None:
            return None
        begun = self._begin.sensitivities
        return LinkModel(
            effects=self._effects,
            values=self._values_at(place),
            residual=residual,
            offset=self._about.offset,
            rows=self._fitter.whiten(residual),
            sensitivities={k: v for k, v in begun.items() if k in self._values},
        )


def _far(fit: Fit) -> bool:
    """Whether a descent has fallen so far that another may fall further."""
    return fit.start_cost - fit.cost > _FAR * fit.cost
