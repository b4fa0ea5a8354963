"""Fits of effects to the residuals of links, in whitened rows of the units that are fitted."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_runs import MIDDLE, Values, in_link
from pamsim.comparison.link_simulator import LinkSimulator
from pamsim.comparison.links import Link
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.descent import Descent
from pamsim.diagnosis.by_link.link_model import LinkModel
from pamsim.diagnosis.by_link.units import Units

_SEEN = 0.05
"""Share of a signature's squares from which an effect is seen in a link. Below, its rows are not
fitted with it: hysteresis of a muscle changes pressures by some thousandths of its squares."""

_OF_RANGE = 0.1  # typical change of a parameter whose probe changes it by nothing
_STEP, _NUISANCE_STEP = 0.1, 0.02
"""Finite differences, in typical sizes of an effect and as a share of a nuisance parameter: large,
since residuals of sticking friction and of sampled delays are not smooth below."""


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
        own = self.sensitivities(start, list(self.nuisance))
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
        return Descent(self, begin, effects, start, links).fitted()

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
