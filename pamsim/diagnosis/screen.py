"""Which effects are worth a refit: their signatures against what the refitted base model misses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.diagnosis.candidate import Candidate
from pamsim.diagnosis.refit import Fitter, Refit
from pamsim.diagnosis.signature import Signature, TangentSpace, signature

FloatArray = NDArray[np.float64]

VISIBLE = 0.02
"""Excess that an effect must leave at one of its probes to be called visible in the data."""


@dataclass(frozen=True, kw_only=True)
class Screened:
    """What the data can say of one effect, before it is fitted.

    Attributes:
        candidate: the effect.
        signatures: one per probe that the simulation came through; those that moved nothing too.
        likeness: largest cosine with the misfit over the probes, sign included where the effect has
            one sign only.
        best: the probe at which it is largest.
    """

    candidate: Candidate
    signatures: tuple[Signature, ...]
    likeness: float
    best: float

    @property
    def visible(self) -> bool:
        """Whether the data would show it at any of its probes."""
        return any(s.visible > VISIBLE for s in self.signatures)


def screen(
    fitter: Fitter, base: Refit, space: TangentSpace, candidates: Sequence[Candidate]
) -> tuple[Screened, ...]:
    """Compare every effect's signatures with the misfit, all probes in one call.

    Args:
        fitter: of the trials.
        base: fit of the model without effects.
        space: of its ordinary parameters.
        candidates: effects.

    Returns:
        The effects, the most alike first.
    """
    jobs = [(c, size, {**base.values, **values}) for c in candidates for size, values in c.probes]
    found = fitter.simulator.many([values for _, _, values in jobs])
    here = fitter.weighted(base.residual)
    misfit = space.across(-here)
    signatures: dict[str, list[Signature]] = {c.name: [] for c in candidates}
    for (candidate, size, _), residual in zip(jobs, found, strict=True):
        if residual is not None:
            change = fitter.weighted(residual) - here
            signatures[candidate.name].append(signature(space, change, size))
    screened: list[Screened] = []
    for candidate in candidates:
        own = signatures[candidate.name]
        scores = [(s.likeness(misfit), s.size) for s in own]
        likeness, best = max(scores, default=(0.0, 1.0))
        screened.append(
            Screened(candidate=candidate, signatures=tuple(own), likeness=likeness, best=best)
        )
    return tuple(sorted(screened, key=lambda s: -s.likeness))


def alike(one: Screened, other: Screened) -> float:
    """Largest cosine between the signatures of two effects, without sign."""
    return max(
        (abs(a.likeness(b.across)) for a in one.signatures for b in other.signatures), default=0.0
    )


def shortlist(
    screened: Sequence[Screened], count: int, look_alikes: Mapping[str, Sequence[str]]
) -> tuple[Screened, ...]:
    """The effects to refit: the most alike, their families, and what could not be screened.

    Args:
        screened: the most alike first.
        count: of them that are taken for their likeness.
        look_alikes: effect -> names of effects that must compete if it does.
    """
    chosen = [s.candidate.name for s in screened[:count]]
    families = {s.candidate.family for s in screened[: max(count // 2, 1)]}
    wanted = {other for name in chosen[:3] for other in look_alikes.get(name, ())}
    unmoved = {s.candidate.name for s in screened if not s.visible and s.signatures}
    return tuple(
        s
        for s in screened
        if s.candidate.name in wanted.union(chosen)
        or (s.candidate.family in families and s.visible)
        or (s.candidate.name in unmoved and s.likeness > 0.5)
    )
