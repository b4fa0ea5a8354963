"""Fits to rows at rest: many predictions cost little there, and one start does not find the best.

A braid that locks moves an arm with the exponential of its number times a stiffness: along the
valley of the two a fit from one start ends early.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_runs import Values
from pamsim.comparison.link_simulator import LinkSimulator
from pamsim.comparison.links import Link
from pamsim.diagnosis.by_link.link_fit import LinkFitter
from pamsim.diagnosis.by_link.link_model import LinkModel
from pamsim.diagnosis.by_link.units import whole_trials

_FINER = 0.01
"""Steps of finite differences beside those of recordings: balances are solved to 1e-9 rad."""

_FACTORS = (1 / 3, 1.0, 2.0)
"""On the size at which an effect's signature is taken: further starts of effects of several
numbers, the same that tables at rest were fitted from before."""


class RestFitter(LinkFitter):
    """Fits to all units."""

    def __init__(self, simulator: LinkSimulator, nuisance: Sequence[str]) -> None:
        super().__init__(simulator, nuisance, whole_trials(simulator, ()), finer=_FINER)

    def fit(
        self,
        begin: LinkModel,
        effects: Sequence[Candidate],
        start: Values,
        links: Collection[Link],
    ) -> LinkModel | None:
        """The best fit from several starts of each effect of several numbers, see `LinkFitter`."""
        starts = [start]
        for own in effects:
            if len(own.parameters) > 1:
                sizes = [own.moved(own.probes[0], factor) for factor in _FACTORS]
                starts += [{**start, **size} for size in sizes]
        fits = [super(RestFitter, self).fit(begin, effects, one, links) for one in starts]
        if all(fit is None for fit in fits):
            # Nuisance parameters fitted with an effect may have no prediction without it.
            stated = {**self.nuisance, **start}
            fits = [super().fit(begin, effects, stated, links)]
        return min((fit for fit in fits if fit is not None), key=lambda f: f.cost, default=None)
