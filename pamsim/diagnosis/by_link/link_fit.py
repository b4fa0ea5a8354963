"""Fits of effects to the residuals of links, in whitened rows of the units that are fitted."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_runs import MIDDLE, Values, in_link
from pamsim.comparison.link_simulator import LinkSimulator
from pamsim.comparison.links import Link
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.units import Units
from pamsim.inference.bounded_least_squares import BreakdownError, Fit, bounded_least_squares
from pamsim.inference.difference_jacobian import secant_updated

PRIOR = 0.3
"""Standard deviation of a nuisance parameter about what the rig states, as a share of that. It
keeps where it is what the rows of a link do not show; what they show is free of it."""

_SEEN = 0.05
"""Share of a signature's squares from which an effect is seen in a link. Below, its rows are not
fitted with it: hysteresis of a muscle changes pressures by some thousandths of its squares."""

_OF_RANGE = 0.1  # typical change of a parameter whose probe changes it by nothing
_REACH = 5.0  # factor either way within which a nuisance parameter is sought
_STEP, _NUISANCE_STEP = 0.1, 0.02
"""Finite differences, in typical sizes of an effect and as a share of a nuisance parameter: large,
since residuals of sticking friction and of sampled delays are not smooth below."""

_TOLERANCE = 1e-3  # relative change of the sum of squares that ends a fit
_STEPS = 15  # of one descent
_FAR = 0.02  # relative fall of the sum of squares from which a fit goes on with fresh sensitivities
_DESCENTS = 4  # after the first


@dataclass(frozen=True, kw_only=True)
class LinkModel:
    """A rig with some effects, after their fit.

    Attributes:
        effects: that it has.
        values: of nuisance parameters in each link, and of the effects' parameters [SI].
        residual: of all links and trials, (n,) [SI]; of trials that no fit needs it is that of the
            rig as it is.
        offset: of the residual, by which it is that of shorter time steps, (n,) [SI]. Simulations
            about this model have the same added: long steps get right what parameters change, not
            what a large effect does.
        rows: of the fitted units, whitened, (f,).
        sensitivities: change of the rows with each parameter, in units of its `LinkFitter.scale`,
            (f,).
    """

    effects: tuple[Candidate, ...]
    values: Mapping[str, float]
    residual: FloatArray
    offset: FloatArray
    rows: FloatArray
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
        return np.column_stack([np.empty((self.rows.size, 0)), *self.sensitivities.values()])


class LinkFitter:
    """Fits to the units that are not judged.

    Args:
        simulator: of the links.
        nuisance: rig parameters that have a value of their own in every link.
        units: rows that are fitted.
        finer: factor on the steps of finite differences, below 1 for residuals that are smooth.
        short: fine time steps in one of those that a fit ends in.

    Attributes:
        stated: the rig as it is, with the sensitivities of its nuisance parameters.
        short: fine time steps in one of those that a fit ends in.
        link_of: number of the link of each whitened row, (f,).
        counts: whitened rows of each link, (links,).
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
        own = self._sensitivities(start, list(self.nuisance))
        self.stated = replace(start, sensitivities=own)

    def whiten(self, residual: FloatArray) -> FloatArray:
        """Whitened rows (f,) of the fitted units out of a residual (n,) [SI]."""
        return self.units.whiten(residual)

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
        probed, neutral = effect.probes[0].values[name], effect.neutral.get(name)
        if neutral is None:
            return abs(probed) or _OF_RANGE * (parameter.high - parameter.low)
        return abs(probed - neutral) or _OF_RANGE * (parameter.high - parameter.low)

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
        own = {p.name: p for effect in effects for p in effect.parameters}
        values = {k: v for k, v in begin.values.items() if k in self.nuisance or k in own}
        values |= start
        wanted = frozenset(links)
        acts = {name: self.simulator.acts_in([name]) for name in values}
        seen = {n: self._seen_in(begin, n) for n in own if n not in start}
        moved = [n for n in own if (acts[n] & wanted if n in start else seen[n] & wanted)]
        wanted = wanted.union(*(seen[n] for n in moved if n in seen))
        free = [n for n in values if n in moved or (n in self.nuisance and acts[n] <= wanted)]
        scale = np.array([self.scale(name, effects) for name in free])
        low = np.array([self._low(n) if n in self.nuisance else own[n].low for n in free]) / scale
        high = np.array([self._high(n) if n in self.nuisance else own[n].high for n in free])
        high = high / scale
        stated = np.array([self.nuisance.get(name, 0.0) for name in free]) / scale
        weight = np.array([1.0 / PRIOR if name in self.nuisance else 0.0 for name in free])
        about = begin
        residuals: dict[bytes, FloatArray | None] = {}

        def values_at(place: FloatArray) -> dict[str, float]:
            return values | dict(zip(free, (place * scale).tolist(), strict=True))

        def residuals_at(places: Sequence[FloatArray]) -> list[FloatArray | None]:
            # A further descent begins where the last one has ended.
            new = [place for place in places if place.tobytes() not in residuals]
            found = self.simulate([values_at(p) for p in new], [wanted] * len(new), begin)
            residuals.update((p.tobytes(), r) for p, r in zip(new, found, strict=True))
            beyond = about.offset - begin.offset
            known = [residuals[place.tobytes()] for place in places]
            return [None if r is None else r + beyond for r in known]

        def rows_at(places: FloatArray) -> list[FloatArray | None]:
            return [
                None if r is None else np.append(self.whiten(r), weight * (place - stated))
                for place, r in zip(places, residuals_at(list(places)), strict=True)
            ]

        def columns(place: FloatArray, known: Mapping[str, FloatArray]) -> FloatArray:
            fresh = [name for name in free if name not in known]
            at = model_at(place) if fresh else None
            if at is not None:
                known = {**known, **self._sensitivities(at, fresh, wanted)}
            none = np.zeros(self.link_of.size)
            own = [known.get(name, none) for name in free]
            return np.vstack([np.stack(own, axis=1), np.diag(weight)])

        def model_at(place: FloatArray) -> LinkModel | None:
            (residual,) = residuals_at([place])
            if residual is None:
                return None
            return LinkModel(
                effects=tuple(effects),
                values=values_at(place),
                residual=residual,
                offset=about.offset,
                rows=self.whiten(residual),
                sensitivities={k: v for k, v in begin.sensitivities.items() if k in values},
            )

        def descended(place: FloatArray, known: Mapping[str, FloatArray]) -> Fit | None:
            try:
                return bounded_least_squares(
                    rows_at,
                    [np.clip(place, low, high)],
                    lower=low,
                    upper=high,
                    jacobian=secant_updated(lambda at, _: columns(at, known)),
                    x_scale=1.0,
                    tolerance=_TOLERANCE,
                    max_steps=_STEPS,
                )
            except BreakdownError:
                return None

        known = {k: v for k, v in begin.sensitivities.items() if k in free and k not in start}
        fit = descended(np.array([values[name] for name in free]) / scale, known)
        # Those of another model, and those that only followed the steps, end a fit too soon.
        for _ in range(_DESCENTS):
            if fit is None or fit.start_cost - fit.cost <= _FAR * fit.cost:
                break
            fit = descended(fit.x, {}) or fit
        model = None if fit is None else model_at(fit.x)
        if fit is None or model is None:
            return None
        own_columns = fit.jacobian[: self.link_of.size]
        known = {name: own_columns[:, i] for i, name in enumerate(free)}
        place = fit.x
        for _ in range(_DESCENTS):
            short = self._in_short_steps(model, wanted)
            if short is None:
                return None
            about = short
            # What shorter steps change may itself change on the way: a lag as short as a step.
            again = descended(place, known)
            place = place if again is None else again.x
            model = model_at(place)
            if model is None:
                return None
            if again is None or again.start_cost - again.cost <= _FAR * again.cost:
                break
        return replace(model, sensitivities={**model.sensitivities, **known})

    def _in_short_steps(self, model: LinkModel, links: Collection[Link]) -> LinkModel | None:
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
        """Residuals (n,) [SI] of parameter sets, in time steps of a length.

        Args:
            model: whose residual the rows of the other links have.
            sets: values by name.
            steps: fine time steps in one.
            links: that are simulated; all if left out.
        """
        wanted = self.simulator.links if links is None else links
        return self.simulator.residuals(
            sets,
            [wanted] * len(sets),
            model.residual,
            only=self.units.fitted.groups,
            steps=steps,
        )

    def everywhere(self, model: LinkModel) -> LinkModel:
        """A model with the residual of all links, those included that no fit of it has simulated.

        Effects of the muscle change pressures along an imposed motion a little.
        """
        links = frozenset(self.simulator.links)
        (residual,) = self.simulate([model.values], [links], model)
        if residual is None:
            return model
        return replace(model, residual=residual, rows=self.whiten(residual))

    def _seen_in(self, model: LinkModel, name: str) -> frozenset[Link]:
        """Links that hold more than a little of what a parameter of an effect changes."""
        own = model.sensitivities.get(name)
        if own is None or not np.any(own):
            return self.simulator.acts_in([name])
        return self.shown_in(self.by_link(own**2))

    def _low(self, name: str) -> float:
        return min(self.nuisance[name] / _REACH, self.nuisance[name] * _REACH)

    def _high(self, name: str) -> float:
        return max(self.nuisance[name] / _REACH, self.nuisance[name] * _REACH)

    def _sensitivities(
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
