"""Fits of effects to the residuals of links, in whitened rows of the units that are fitted.

A fit is a series of descents to the least squares of some links' rows, and ends in short time
steps.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_runs import MIDDLE, Values, in_link
from pamsim.comparison.links import Link
from pamsim.comparison.rest_simulator import LinkSimulator
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.units import Units
from pamsim.inference.bounded_least_squares import BreakdownError, Fit, bounded_least_squares
from pamsim.inference.difference_jacobian import secant_updated
from pamsim.inference.projection import as_columns

_SEEN = 0.05
"""Share of a signature's squares from which an effect is seen in a link. Below, its rows are not
fitted with it: hysteresis of a muscle changes pressures by some thousandths of its squares."""

_OF_RANGE = 0.1  # typical change of a parameter whose probe changes it by nothing
_STEP, _NUISANCE_STEP = 0.1, 0.02
"""Finite differences, in typical sizes of an effect and as a share of a nuisance parameter: large,
since residuals of sticking friction and of sampled delays are not smooth below."""

PRIOR = 0.3
"""Standard deviation of a nuisance parameter about what the rig states, as a share of that. It
keeps where it is what the rows of a link do not show; what they show is free of it."""

_REACH = 5.0  # factor either way within which a nuisance parameter is sought
_TOLERANCE = 1e-3  # relative change of the sum of squares that ends a descent
_STEPS = 15  # of one descent
_FAR = 0.02  # relative fall of the sum of squares from which a fit goes on with fresh sensitivities
_DESCENTS = 4  # after the first


@dataclass(frozen=True, kw_only=True)
class LinkModel:
    """A rig with some effects, after their fit."""

    effects: tuple[Candidate, ...]  # that it has
    # Of nuisance parameters in each link, and of the effects' parameters [SI]
    values: Mapping[str, float]
    # Of all links and trials, (n,) [SI]; of trials that no fit needs it is that of the rig as it is
    residual: FloatArray
    # Of the residual, by which it is that of shorter time steps, (n,) [SI]. Simulations about this
    # model have the same added: long steps get right what parameters change, not what a large
    # effect does
    offset: FloatArray
    rows: FloatArray  # of the fitted units, whitened, (f,)
    # Change of the rows with each parameter, in units of its `LinkFitter.scale`, (f,)
    sensitivities: Mapping[str, FloatArray]

    @property
    def cost(self) -> float:
        """Sum of squares of the whitened rows."""
        return float(self.rows @ self.rows)

    @property
    def criterion(self) -> float:
        """Of two models that with the smaller is preferred (Schwarz, Annals of Statistics 6, 1978).

        Every parameter of an effect costs the logarithm of the number of rows: of two formulas that
        fit as well the one with fewer parameters is taken.
        """
        return self.cost + len(self.freed) * float(np.log(self.rows.size))

    @property
    def names(self) -> frozenset[str]:
        """Names of the effects, with their places."""
        return frozenset(effect.name for effect in self.effects)

    @property
    def labels(self) -> frozenset[str]:
        """The effects, with their forms."""
        return frozenset(effect.label for effect in self.effects)

    @property
    def freed(self) -> frozenset[str]:
        """Parameters of the effects."""
        return frozenset(p.name for effect in self.effects for p in effect.parameters)

    def jacobian(self) -> FloatArray:
        """Sensitivities as columns, (f, p)."""
        return as_columns(self.sensitivities.values(), self.rows.size)


class LinkFitter:
    """Fits to the units that are not judged; nuisance parameters have a value in every link.

    ``finer`` is a factor on the steps of finite differences, below 1 for residuals that are smooth,
    ``short`` the number of fine time steps in one of those that a fit ends in.

    Attributes:
        stated: the rig as it is, with the sensitivities of its nuisance parameters.
        link_of: number of the link of each whitened row, (f,).
        counts: whitened rows of each link, (links,).
        material: fall of each link's sum of squares from which an effect is material, (links,).
    """

    def __init__(
        self,
        simulator: LinkSimulator,
        nuisance: Sequence[str],
        units: Units,
        *,
        finer: float = 1.0,
        short: int = MIDDLE,
    ) -> None:
        self.simulator, self.units = simulator, units
        self._finer, self.short = finer, short
        self.link_of = units.fitted.link_of
        self.counts = self.by_link(np.ones(self.link_of.size))
        self.material = units.limits.material * self.counts
        self.nuisance = {
            in_link(name, link): simulator.own_value(name)
            for name in nuisance
            for link in simulator.links
            if link in simulator.acts_in([name])
        }
        rows = self.whiten(simulator.stated)
        start = LinkModel(
            effects=(),
            values=self.nuisance,
            residual=simulator.stated,
            offset=np.zeros_like(simulator.stated),
            rows=rows,
            sensitivities={},
        )
        own = self.sensitivities(start, list(self.nuisance))
        self.stated = replace(start, sensitivities=own)

    def whiten(self, residual: FloatArray) -> FloatArray:
        """Whitened rows (f,) of the fitted units out of a residual (n,) [SI]."""
        return self.units.fitted.whiten(residual)

    def in_links(self, links: Collection[Link]) -> NDArray[np.bool_]:
        """Mask (f,) of the whitened rows of some links."""
        numbers = [i for i, link in enumerate(self.simulator.links) if link in links]
        return np.isin(self.link_of, numbers)

    def by_link(self, rows: FloatArray) -> FloatArray:
        """Sums of values of the whitened rows (f,) over each link, (links,)."""
        count = len(self.simulator.links)
        return np.bincount(self.link_of, weights=rows, minlength=count).astype(float)

    def shown_in(self, squares: FloatArray) -> frozenset[Link]:
        """Links that hold a share of a signature's squares (links,) that counts."""
        least = _SEEN * float(squares.sum())
        pairs = zip(self.simulator.links, squares.tolist(), strict=True)
        return frozenset(link for link, square in pairs if square >= least and square > 0.0)

    def scale(self, name: str, effects: Sequence[Candidate]) -> float:
        """Typical change of a parameter [SI]: of its effect; of a nuisance parameter, its value."""
        if name in self.nuisance:
            return abs(self.nuisance[name])
        effect = next(e for e in effects if any(p.name == name for p in e.parameters))
        parameter = next(p for p in effect.parameters if p.name == name)
        typical = abs(effect.probes[0].values[name] - effect.neutral.get(name, 0.0))
        return typical or _OF_RANGE * (parameter.high - parameter.low)

    def simulate(
        self, sets: Sequence[Values], links: Sequence[Collection[Link]], about: LinkModel
    ) -> list[FloatArray | None]:
        """Residuals (n,) [SI] of parameter sets in the trials that fits need, about a model.

        The links of each set are simulated; the rows of the others are the model's.
        """
        others = about.residual - about.offset
        found = self.simulator.residuals(sets, links, others, only=self.units.fitted.groups)
        return [None if residual is None else residual + about.offset for residual in found]

    def fit(
        self,
        begin: LinkModel,
        effects: Sequence[Candidate],
        start: Values,
        links: Collection[Link],
    ) -> LinkModel | None:
        """Fit what acts in some links; what acts elsewhere stays.

        Args:
            begin: model with the values that the fit begins with.
            effects: of the model that is fitted.
            start: values of parameters that begin elsewhere [SI].
            links: whose rows are fitted; with them go the other links in which effects are seen
                that are seen in one of these. Effects that are seen in none keep their values.

        Returns:
            The model, or None if the simulation breaks down where it begins.
        """
        return _Descent(self, begin, effects, start, links).fitted()

    def in_short_steps(self, model: LinkModel, links: Collection[Link]) -> LinkModel | None:
        """A model whose residual is that of shorter time steps; None if it breaks down in them."""
        (residual,) = self.in_steps(model, [model.values], self.short, links)
        if residual is None:
            return None
        offset = model.offset + residual - model.residual
        return replace(model, residual=residual, offset=offset, rows=self.whiten(residual))

    def in_steps(
        self,
        model: LinkModel,
        sets: Sequence[Values],
        steps: int,
        links: Collection[Link] | None = None,
    ) -> list[FloatArray | None]:
        """Residuals (n,) [SI] of parameter sets, in steps of so many fine time steps.

        All links are simulated if none are named; the rows of the others are the model's.
        """
        wanted = [self.simulator.links if links is None else links] * len(sets)
        only = self.units.fitted.groups
        return self.simulator.residuals(sets, wanted, model.residual, only=only, steps=steps)

    def everywhere(self, model: LinkModel) -> LinkModel:
        """A model with the residual of all links, those included that no fit of it has simulated.

        Effects of the muscle change pressures along an imposed motion a little. Where a nuisance
        parameter has stood in for one, the link gets worse with both, by more than the scatter of
        a sum of squares: the link's own parameters are fitted again.
        """
        links = frozenset(self.simulator.links)
        (residual,) = self.simulate([model.values], [links], model)
        if residual is None:
            return model
        whole = replace(model, residual=residual, rows=self.whiten(residual))
        rise = self.by_link(whole.rows**2) - self.by_link(model.rows**2)
        for worse in np.flatnonzero(rise > np.sqrt(2.0 * self.counts)):
            link = self.simulator.links[int(worse)]
            whole = self.fit(whole, whole.effects, {}, {link}) or whole
        return whole

    def seen_in(self, model: LinkModel, name: str) -> frozenset[Link]:
        """Links that hold more than a little of what a parameter of an effect changes."""
        own = model.sensitivities.get(name)
        if own is None or not np.any(own):
            return self.simulator.acts_in([name])
        return self.shown_in(self.by_link(own**2))

    def sensitivities(
        self,
        at: LinkModel,
        names: Sequence[str],
        links: frozenset[Link] | None = None,
    ) -> dict[str, FloatArray]:
        """Change of the rows with parameters, in units of their scale."""
        sets, steps = self.moved(at, names)
        acts = [self.simulator.acts_in([name]) for name in names]
        inside = [own & links if links is not None else own for own in acts]
        found = self.simulate(sets, inside, at)
        return {
            name: np.zeros_like(at.rows) if r is None else (self.whiten(r) - at.rows) / step
            for name, step, r in zip(names, steps, found, strict=True)
        }

    def moved(self, at: LinkModel, names: Sequence[str]) -> tuple[list[Values], list[float]]:
        """Values with each parameter moved, and by how much, in units of its scale."""
        own = {p.name: p for effect in at.effects for p in effect.parameters}
        steps: list[float] = []
        sets: list[Values] = []
        for name in names:
            scale = self.scale(name, at.effects)
            step = scale * self._finer * (_NUISANCE_STEP if name in self.nuisance else _STEP)
            if name in own and at.values[name] + step > own[name].high:
                step = -step
            steps.append(step / scale)
            sets.append({**at.values, name: at.values[name] + step})
        return sets, steps


class _Descent:
    """What `LinkFitter.fit` does; its parameters are in units of `LinkFitter.scale`."""

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
                lambda place: self._rows_at(place[np.newaxis])[0],
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
