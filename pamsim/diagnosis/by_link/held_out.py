"""Trials that no fit has seen: what models leave of them.

Which of two models predicts them better is decided by flips of the signs of whole trials
(`pamsim.inference.model_comparison`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from pamsim.comparison.chain_simulator import MIDDLE
from pamsim.comparison.links import Link
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.judge import Difference
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.remainder import Remainder, remainders
from pamsim.inference.blocks import Block, unit_losses, unit_names
from pamsim.inference.model_comparison import compare_with_reference


class HeldOut:
    """Losses on the trials that no fit has seen.

    Args:
        fitter: that fitted the others.
        names: of these trials.
        seed: random seed of the sign flips, where they are drawn.
    """

    def __init__(self, fitter: LinkFitter, names: Collection[str], *, seed: int = 0) -> None:
        self._fitter, self._seed = fitter, seed
        simulator = fitter.simulator
        self._groups = frozenset(g.name for g in simulator.repeats if g.name in names)
        self._group_of = {t.name: g.name for g in simulator.repeats for t in g.trials}
        self._blocks: dict[Link, list[Block]] = {link: [] for link in simulator.links}
        for block, number in zip(simulator.blocks, simulator.link_of, strict=True):
            if block.unit in names:
                self._blocks[simulator.links[number]].append(block)
        self.trials = unit_names([b for blocks in self._blocks.values() for b in blocks])
        self.links = simulator.links
        self._known: dict[tuple[tuple[str, float], ...], FloatArray | None] = {}

    def losses(self, model: LinkModel) -> dict[Link, FloatArray]:
        """Mean square of the whitened rows of every link in every trial, (u,); 1 is noise."""
        residual = self._residual(model)
        if residual is None:  # a model that cannot be simulated predicts nothing
            return {link: np.full(len(self.trials), np.inf) for link in self.links}
        return {
            link: unit_losses(blocks, residual) for link, blocks in self._blocks.items() if blocks
        }

    def beyond_noise(self, model: LinkModel) -> dict[Link, float]:
        """What a model leaves in every link beyond the noise, a mean square [noise variance]."""
        return {link: one.excess for link, one in self.remainders(model).items()}

    def better(self, model: LinkModel, rest: LinkModel, links: Collection[Link]) -> Difference:
        """How much better a model predicts some links than another."""
        own, other = (_mean_loss(self.losses(m), links) for m in (model, rest))
        found = compare_with_reference(other, own[:, np.newaxis], seed=self._seed)
        return Difference(
            gain=float(found.gain[0]), p_value=float(found.p_value[0]), by_unit=other - own
        )

    def worse(
        self, rival: LinkModel, model: LinkModel, rest: LinkModel, links: Collection[Link]
    ) -> Difference:
        """How much worse a rival predicts some links; ``rest`` is without meaning here."""
        del rest
        return self.better(model, rival, links)

    def remainders(self, model: LinkModel) -> dict[Link, Remainder]:
        """What a model leaves in every link that repeats share."""
        return remainders(self.rows(model), self.losses(model), seed=self._seed)

    def rows(self, model: LinkModel) -> dict[Link, list[dict[str, FloatArray]]]:
        """Whitened rows of every link: for each group of repeats and channel, trial -> (n,)."""
        residual = self._residual(model)
        found: dict[Link, list[dict[str, FloatArray]]] = {link: [] for link in self.links}
        if residual is None:
            return found
        for link, blocks in self._blocks.items():
            grouped: dict[tuple[str, str], dict[str, FloatArray]] = {}
            for block in blocks:
                key = self._group_of[block.unit], block.channel
                grouped.setdefault(key, {})[block.unit] = block.whiten(residual)
            found[link] = list(grouped.values())
        return found

    def _residual(self, model: LinkModel) -> FloatArray | None:
        key = tuple(sorted(model.values.items()))
        if key not in self._known:
            simulator = self._fitter.simulator
            (self._known[key],) = simulator.residuals(
                [model.values],
                [frozenset(self.links)],
                simulator.stated,
                only=self._groups,
                steps=MIDDLE,
            )
        return self._known[key]


def _mean_loss(losses: Mapping[Link, FloatArray], links: Collection[Link]) -> FloatArray:
    """Loss of each trial over some links, (u,)."""
    return np.mean([losses[link] for link in losses if link in links], axis=0)
