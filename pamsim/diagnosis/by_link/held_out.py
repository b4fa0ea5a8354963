"""Units that no fit has seen: what models leave of them, and what of that repeats miss together.

Which of two models predicts them better is decided by flips of the signs of whole units
(`pamsim.inference.model_comparison`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from pamsim.comparison.chain_runs import MIDDLE
from pamsim.comparison.links import Link
from pamsim.comparison.repeated_misfit import repeated_misfit, shared_p_values
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.limits import USUAL, Difference, Limits, Remainder
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.units import Rows
from pamsim.inference.model_comparison import compare_paired


class HeldOut:
    """Losses on the units that a fitter has not seen; the seed is that of the sign flips.

    A model that cannot be simulated there, as an unseen input may break down what the others do
    not, predicts what the rig as it is does.
    """

    def __init__(self, fitter: LinkFitter, *, seed: int = 0) -> None:
        self._simulator, self._units = fitter.simulator, fitter.units
        self._seed, self.links = seed, fitter.simulator.links
        self._known: dict[tuple[tuple[str, float], ...], FloatArray] = {}

    def losses(self, model: LinkModel) -> dict[Link, FloatArray]:
        """Mean square of the whitened rows of every link in its units, (u,); 1 is noise."""
        return {link: loss[~np.isnan(loss)] for link, loss in self._by_unit(model).items()}

    def beyond_noise(self, model: LinkModel) -> dict[Link, float]:
        """What a model leaves in every link beyond the noise, a mean square [noise variance]."""
        return {link: one.excess for link, one in self.remainders(model).items()}

    def better(self, model: LinkModel, rest: LinkModel, links: Collection[Link]) -> Difference:
        """How much better a model predicts some links than another, in units that measure any."""
        own, other = (_mean_loss(self._by_unit(m), links) for m in (model, rest))
        gain, p_value = compare_paired(other - own, seed=self._seed)
        return Difference(gain=gain, p_value=p_value, limits=self._units.limits)

    def worse(
        self, rival: LinkModel, model: LinkModel, rest: LinkModel, links: Collection[Link]
    ) -> Difference:
        """How much worse a rival predicts some links; ``rest`` is without meaning here."""
        del rest
        return self.better(model, rival, links)

    def remainders(self, model: LinkModel) -> dict[Link, Remainder]:
        """What a model leaves in every link that repeats share."""
        rows, losses = self.rows(model), self.losses(model)
        return remainders(rows, losses, limits=self._units.limits, seed=self._seed)

    def rows(self, model: LinkModel) -> dict[Link, list[dict[str, FloatArray]]]:
        """Whitened rows of every link: for each input and channel, trial that repeats it -> (n,).

        Where no two judged trials repeat each other, a fitted one stands beside each. What a fit
        takes from that one's noise it adds to the other, so that their mean product is free of it.
        Parts of trials repeat nothing.
        """
        residual = self._residual(model)
        found: dict[Link, list[dict[str, FloatArray]]] = {link: [] for link in self.links}
        if self._units.in_parts:
            return found
        grouped = self._by_input(self._units.judged, self._units.judged.whiten(residual))
        if all(len(rows) == 1 for rows in grouped.values()):
            fitted = self._by_input(self._units.fitted, model.rows)
            for key in grouped.keys() & fitted.keys():
                name, rows = next(iter(fitted[key].items()))
                grouped[key] = {**grouped[key], name: rows}
        for (link, _, _), rows in grouped.items():
            found.setdefault(link, []).append(rows)
        return found

    def _by_unit(self, model: LinkModel) -> dict[Link, FloatArray]:
        """Loss of every link in every unit, (u,); NaN in those that do not measure the link."""
        residual, judged = self._residual(model), self._units.judged
        count = len(judged.units)
        squares = judged.whiten(residual) ** 2
        found: dict[Link, FloatArray] = {}
        for number, link in enumerate(self.links):
            own = judged.link_of == number
            units = judged.unit_of[own]
            sums = np.bincount(units, weights=squares[own], minlength=count)
            there = np.unique(units)
            if there.size:
                found[link] = np.full(count, np.nan)
                found[link][there] = sums[there] / np.bincount(units, minlength=count)[there]
        return found

    def _by_input(
        self, side: Rows, whitened: FloatArray
    ) -> dict[tuple[Link, str, str], dict[str, FloatArray]]:
        """Link, input and channel -> trial -> its rows."""
        grouped: dict[tuple[Link, str, str], dict[str, FloatArray]] = {}
        at = 0
        for block in side.blocks:
            link = self.links[int(side.link_of[at])]
            key = link, self._units.input(block.unit), block.channel
            grouped.setdefault(key, {})[block.unit] = whitened[at : at + block.size]
            at += block.size
        return grouped

    def _residual(self, model: LinkModel) -> FloatArray:
        key = tuple(sorted(model.values.items()))
        if key not in self._known:
            (residual,) = self._simulator.residuals(
                [model.values],
                [frozenset(self.links)],
                self._simulator.stated,
                only=self._units.judged.groups,
                steps=MIDDLE,
            )
            self._known[key] = self._simulator.stated if residual is None else residual
        return self._known[key]


def refuse_unjudged(fitter: LinkFitter) -> None:
    """Refuse links that no judged unit measures: what is missing there would be fitted unjudged.

    Raises:
        InputError: naming the first, and a trial of it.
    """
    simulator, judged = fitter.simulator, fitter.units.judged
    for number, link in enumerate(simulator.links):
        if number not in judged.link_of:
            blocks = zip(simulator.blocks, simulator.link_of, strict=True)
            trials = list(dict.fromkeys(block.unit for block, of in blocks if of == number))
            raise InputError(
                f"{link.name} ({' to '.join(link.ends)}): {len(trials)} trials measure it, such as"
                f" {trials[0]}, and none of them is judged; name some of them in `hold_out`, or"
                " leave out what only they measure"
            )


def _mean_loss(losses: Mapping[Link, FloatArray], links: Collection[Link]) -> FloatArray:
    """Loss over those of some links that a unit measures, for each unit that does, (u,)."""
    own = np.array([losses[link] for link in losses if link in links])
    return np.nanmean(own[:, ~np.all(np.isnan(own), axis=0)], axis=0)


def remainders(
    rows: Mapping[Link, Sequence[Mapping[str, FloatArray]]],
    losses: Mapping[Link, FloatArray],
    *,
    limits: Limits = USUAL,
    seed: int = 0,
) -> dict[Link, Remainder]:
    """What a model leaves in the held-out units of every link.

    ``rows`` are the whitened ones of every link: for each group of repeats and channel, trial ->
    (n,); ``losses`` (u,) the mean square of the rows of every link in every unit.
    """
    misfits = {
        link: [repeated_misfit(one) for one in groups if len(one) > 1]
        for link, groups in rows.items()
    }
    repeated = {link: own for link, own in misfits.items() if own}
    p_values = shared_p_values(list(repeated.values()), seed=seed) if repeated else []
    found = {
        link: Remainder(excess=float(np.mean(loss)) - 1.0, p_value=1.0, known=False, limits=limits)
        for link, loss in losses.items()
    }
    for (link, own), p_value in zip(repeated.items(), p_values, strict=True):
        excess = float(np.mean([one.shared for one in own]))
        found[link] = Remainder(excess=excess, p_value=p_value, limits=limits)
    return found
