"""Rows that are left out in turn, where they are too few to hold some out.

Half of ten rows would show nothing, and no row is unseen by the search. So

* an effect is there if it fits better than the best of all effects and forms that were tried on the
  same rows would by chance (exchanges of the rows), agrees over the rows (flips of their scores),
  and predicts rows that are left out better (flips of their losses). Noise alone passes the first
  two tests in 7 % of toy tables at a level of 5 %, and all three in 0.5 %.
* more than noise is left if rows with near inputs miss something together
  (`pamsim.inference.row_tests`).
* a rival is worse if the parameters of the effect add something to the model with the rival, and
  not the other way round (encompassing, Mizon and Richard, Econometrica 54 (1986); exchanges of the
  rows). Where each adds to the other neither formula is exact, and flips of the losses decide: they
  need more rows, since a few rows hold the difference. A rival that is worse by less than what is
  left may be so by its formula alone: it ties.

All is linear about a fit to all rows, and in the size of an effect
(`pamsim.inference.row_tests`); numbers of its shape stay as all rows have fitted them.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.candidate import INSIDE
from pamsim.comparison.links import Link
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.limits import Difference, Remainder
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.promise import Signature
from pamsim.inference.model_comparison import compare_paired
from pamsim.inference.projection import as_columns, orthonormal, project_out
from pamsim.inference.row_tests import UnseenRows, best_of_many_p_values, missed_together

_DETERMINED = 1e-9  # share of a row's variance below which a fit passes through the row


class LeftOut:
    """Rows of a fitter, each a unit of its own, each predicted by a fit to the others.

    ``known`` are signatures of all that was tried on them, ``near`` the weights of each row's
    neighbours (`pamsim.inference.row_tests.nearest_units`).

    Raises:
        InputError: for units of several rows.
    """

    def __init__(
        self,
        fitter: LinkFitter,
        known: Collection[Signature],
        near: FloatArray,
        *,
        seed: int = 0,
    ) -> None:
        if any(block.size > 1 for block in fitter.units.fitted.blocks):
            raise InputError("rows are exchanged one by one; give each as a unit of its own")
        self._fitter, self._known = fitter, tuple(known)
        self._near, self._seed = near, seed
        self._limits = fitter.units.limits

    def losses(self, model: LinkModel) -> dict[Link, FloatArray]:
        """Loss of each row of each link, (n,); 1 is noise."""
        return {link: self._beside(model, {link}).losses for link in self._fitter.simulator.links}

    def errors(self, model: LinkModel) -> FloatArray:
        """Simulated minus measured of each row by a fit to the others, (n,) [SI]."""
        basis = orthonormal(_free_columns(model))
        free = np.maximum(1.0 - np.sum(basis**2, axis=1), _DETERMINED)
        variance = [block.noise.variance for block in self._fitter.units.fitted.blocks]
        return project_out(basis, model.rows) / free * np.sqrt(variance)

    def beyond_noise(self, model: LinkModel) -> dict[Link, float]:
        """What a model leaves in every link beyond the noise, a mean square [noise variance]."""
        return {link: float(np.mean(loss)) - 1.0 for link, loss in self.losses(model).items()}

    def better(self, model: LinkModel, rest: LinkModel, links: Collection[Link]) -> Difference:
        """How much better a model predicts some links than the same without one effect."""
        rows, beside = self._fitter.in_links(links), self._beside(rest, links)
        step = beside.effect((model.rows - rest.rows)[rows])
        gain, by_losses = compare_paired(beside.losses - step.losses, seed=self._seed)
        p_value = max(self._by_chance(model, rest, rows), step.p_value(self._seed), by_losses)
        return Difference(gain=gain, p_value=p_value, limits=self._limits)

    def worse(
        self, rival: LinkModel, model: LinkModel, rest: LinkModel, links: Collection[Link]
    ) -> Difference:
        """How much worse a rival predicts some links; ``rest`` is without either effect."""
        rows, beside = self._fitter.in_links(links), self._beside(rest, links)
        mine, theirs = (
            beside.effect((one.rows - rest.rows)[rows]).losses for one in (model, rival)
        )
        gain, p_value = compare_paired(theirs - mine, seed=self._seed)
        left = [one for link, one in self.remainders(model).items() if link in links]
        if gain <= max(one.certain for one in left):
            p_value = 1.0
        elif self._adds(rival, model, rest, rows) > self._limits.alpha:
            p_value = self._adds(model, rival, rest, rows)
        return Difference(gain=gain, p_value=p_value, limits=self._limits)

    def remainders(self, model: LinkModel) -> dict[Link, Remainder]:
        """What near rows of every link miss together."""
        found: dict[Link, Remainder] = {}
        for link in self._fitter.simulator.links:
            rows = self._fitter.in_links({link})
            near = self._near[np.ix_(rows, rows)]
            excess, p_value = missed_together(
                model.rows[rows], _free_columns(model)[rows], near, seed=self._seed
            )
            found[link] = Remainder(excess=excess, p_value=p_value, limits=self._limits)
        return found

    def _beside(self, model: LinkModel, links: Collection[Link]) -> UnseenRows:
        """Rows of some links, each predicted from the others, about a model."""
        rows = self._fitter.in_links(links)
        return UnseenRows(model.rows[rows], _free_columns(model)[rows])

    def _by_chance(self, model: LinkModel, rest: LinkModel, rows: NDArray[np.bool_]) -> float:
        """p-value of a model, among the best of all that was tried beside the rest."""
        own = rest.jacobian()[rows]
        extended = [(model.rows[rows], model.jacobian()[rows])]
        for other in self._known:
            taken = rest.freed & {p.name for p in other.effect.parameters}
            if other.effect.name not in rest.names and not taken:
                extended.append(_wider(rest.rows[rows], own, other.rows[rows, np.newaxis]))
        return best_of_many_p_values(rest.rows[rows], own, extended, seed=self._seed)[0]

    def _adds(
        self, one: LinkModel, other: LinkModel, rest: LinkModel, rows: NDArray[np.bool_]
    ) -> float:
        """p-value of an effect whose parameters add nothing to another beside the same rest."""
        own, further = _free_columns(other)[rows], _free_columns(one, rest)[rows]
        extended = _wider(other.rows[rows], own, further)
        return best_of_many_p_values(other.rows[rows], own, [extended], seed=self._seed)[0]


def _wider(rows: FloatArray, own: FloatArray, further: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What further columns (n, k) leave of rows (n,) beside a model's own, and all of them."""
    basis = orthonormal(np.column_stack([own, further]))
    return project_out(basis, rows), basis


def _free_columns(model: LinkModel, without: LinkModel | None = None) -> FloatArray:
    """Sensitivities as columns, (n, p), without those of parameters at an end of their range.

    Those that another model has as well are left out, too.
    """
    ends = {
        p.name
        for effect in model.effects
        for p in effect.parameters
        if min(model.values[p.name] - p.low, p.high - model.values[p.name])
        < INSIDE * (p.high - p.low)
    }
    if without is not None:
        ends |= without.sensitivities.keys()
    columns = [column for name, column in model.sensitivities.items() if name not in ends]
    return as_columns(columns, model.rows.size)
