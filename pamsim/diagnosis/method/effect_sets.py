"""Sets of effects: grown one effect at a time from the best, and cut back to what is needed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.diagnosis.method.evidence import compare
from pamsim.diagnosis.method.judge import EFFECT_FLOOR, Trialled, trial
from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.diagnosis.method.screen import Screened, screened_again
from pamsim.diagnosis.method.signature import TangentSpace

Told = Callable[[str], None]
"""Is told what is being tried."""


@dataclass(frozen=True, kw_only=True)
class Growth:
    """How one more effect is added.

    Attributes:
        beam: models that are grown, the best first.
        others: effects tried beside each.
        significance: share of false claims allowed over all that is tried.
        floor: gain, in noise floors, that the further effect must bring.
    """

    beam: int
    others: int
    significance: float
    floor: float = 2.0 * EFFECT_FLOOR


_LEEWAY = 1.5

PAIRS = Growth(beam=2, others=4, significance=0.01)
TRIPLES = Growth(beam=1, others=3, significance=0.001)


class SetSearch:
    """Search among sets of effects.

    Args:
        fitter: of the trials.
        base: fit of the base model.
        base_loss: its loss on the held-out trials.
        screened: effects with their signatures.
        told: is told what is being tried.
    """

    def __init__(
        self,
        fitter: Fitter,
        base: Refit,
        base_loss: Mapping[str, float],
        screened: Sequence[Screened],
        told: Told,
    ) -> None:
        self._fitter = fitter
        self._base = base
        self._base_loss = base_loss
        self._screened = screened
        self._told = told
        self._known: dict[frozenset[str], Trialled | None] = {}

    def single(self, one: Screened) -> Trialled | None:
        """Fit the base model with one effect."""
        space = TangentSpace(self._base.slopes)
        misfit = space.across(-self._fitter.weighted(self._base.residual))
        return self._fitted(None, one, one.starts(misfit))

    def promise_left(self, model: Trialled) -> float:
        """Largest fall of the mean loss that an effect promises beside those of a model."""
        space = TangentSpace(model.fit.slopes)
        misfit = space.across(-self._fitter.weighted(model.fit.residual))
        others = [s for s in self._screened if s.candidate.name not in model.names]
        return max((s.gain for s in screened_again(others, space, misfit)), default=0.0)

    def grown(self, able: Sequence[Trialled], growth: Growth) -> list[Trialled]:
        """Models with one effect more that predict better than what they grew from and the best.

        Args:
            able: models whose effects may be claimed, the best first.
            growth: how.

        Returns:
            The accepted ones, the best first.
        """
        protocol_of = self._fitter.simulator.layout.protocol_of
        least = min((m.fit.cost for m in able), default=np.inf)
        jobs = [job for parent in able[: growth.beam] for job in self._jobs(parent, growth, least)]
        found: dict[frozenset[str], Trialled] = {}
        for parent, other, starts in jobs:
            names = frozenset({*parent.names, other.candidate.name})
            larger = self._known.get(names) or self._fitted(parent, other, starts)
            if larger is None or not larger.size_known():
                continue
            over = [compare(m.loss, larger.loss, protocol_of) for m in (able[0], parent)]
            if all(
                c.p_value * len(jobs) < growth.significance and c.gain > growth.floor for c in over
            ):
                found[names] = larger
        return sorted(found.values(), key=lambda m: m.mean_loss)

    def cut_back(self, model: Trialled, growth: Growth) -> Trialled:
        """Leave out every effect without which the held-out trials are predicted as well.

        Args:
            model: with two effects or more.
            growth: how it was grown: the same is asked of what stays.
        """
        protocol_of = self._fitter.simulator.layout.protocol_of
        by_name = {s.candidate.name: s for s in self._screened}
        for name in model.names:
            if len(model.candidates) == 1:
                break
            kept = [c for c in model.candidates if c.name != name]
            key = frozenset(c.name for c in kept)
            if key not in self._known:
                start = {p.name: model.fit.values[p.name] for c in kept for p in c.parameters}
                self._told(" + ".join(sorted(key)))
                self._known[key] = trial(self._fitter, self._base, self._base_loss, kept, [start])
            smaller = self._known[key]
            if smaller is None or name not in by_name:
                continue
            gain = compare(smaller.loss, model.loss, protocol_of)
            if gain.p_value < growth.significance and gain.gain > growth.floor:
                continue
            model = smaller
        return model

    def _jobs(
        self, parent: Trialled, growth: Growth, least: float
    ) -> list[tuple[Trialled, Screened, list[dict[str, float]]]]:
        """Effects that promise most beside a model's own, and where their fits begin.

        Those that could not get below the least cost so far by what must be gained are left out,
        with leeway for promises being of first order.
        """
        space = TangentSpace(parent.fit.slopes)
        misfit = space.across(-self._fitter.weighted(parent.fit.residual))
        taken = {p.name for p in parent.fit.parameters}
        others = [
            s
            for s in screened_again(self._screened, space, misfit)
            if not taken & {p.name for p in s.candidate.parameters}
            and s.gain >= growth.floor
            and parent.fit.cost - _LEEWAY * s.gain < least - growth.floor
        ]
        return [(parent, s, s.starts(misfit)) for s in others[: growth.others]]

    def _fitted(
        self, parent: Trialled | None, other: Screened, starts: Sequence[Mapping[str, float]]
    ) -> Trialled | None:
        members = () if parent is None else parent.candidates
        names = frozenset({*(c.name for c in members), other.candidate.name})
        self._told(" + ".join(sorted(names)))
        began = (
            {}
            if parent is None
            else {p.name: parent.fit.values[p.name] for p in parent.fit.parameters}
        )
        found = trial(
            self._fitter,
            self._base,
            self._base_loss,
            [*members, other.candidate],
            [{**began, **start} for start in starts],
        )
        self._known[names] = found
        return found
