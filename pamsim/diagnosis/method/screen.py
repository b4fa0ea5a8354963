"""Screen the effects: compare their signatures with what the refitted base model misses."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.candidate import Candidate, Probe
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.diagnosis.method.signature import Signature, TangentSpace, signature

VISIBLE = 0.02
"""Excess over the noise that an effect must leave at one of its probes to be called visible."""

_FARTHEST = 5.0
"""Largest start of a fit, in sizes of the probe: beyond, a signature means little."""

_NEAREST = 0.05
"""Smallest start, in sizes of the probe: nearer to neutral, friction and backlash have no slope."""

_AS_GOOD = 0.8
"""Share of the best probe's gain from which a probe of another shape is a start as well."""


_FAR_MORE = 1.25
"""Factor on the gain that the usual form promises, from which another form is tried first."""

_PARALLEL = 0.01
"""Share of a signature's square that another must leave unexplained for the two to be a pair."""


@dataclass(frozen=True, kw_only=True)
class Trace:
    """A probe and the signature that it left.

    Attributes:
        probe: values of the effect's parameters.
        change: (f,) of the weighted residual that it made.
        signature: after projection by the nuisance parameters.
    """

    probe: Probe
    change: FloatArray
    signature: Signature


@dataclass(frozen=True, kw_only=True)
class Screened:
    """What the data can show of one effect, before it is fitted.

    Attributes:
        candidate: the effect.
        traces: one per probe that the simulation came through; those that moved nothing too.
        similarity: largest cosine with the misfit over the probes, without sign where the effect
            may have either.
        gain: largest fall of the mean loss that a probe promises.
    """

    candidate: Candidate
    traces: tuple[Trace, ...]
    similarity: float
    gain: float

    @property
    def visible(self) -> bool:
        """Whether the data would show it at any of its probes."""
        return any(t.signature.visible > VISIBLE for t in self.traces)

    def starts(self, misfit: FloatArray) -> list[dict[str, float]]:
        """Where a fit of the effect begins: at the sizes that the best probes point to.

        Args:
            misfit: (f,) that it is to explain, see `Signature.share`.
        """
        ranked = sorted(self.traces, key=lambda t: -_gain(self.candidate, t.signature, misfit))
        chosen = [ranked[0]]
        best = _gain(self.candidate, ranked[0].signature, misfit)
        for other in ranked[1:]:
            new = all(not other.probe.same_shape(t.probe) for t in chosen)
            if new and _gain(self.candidate, other.signature, misfit) >= _AS_GOOD * best:
                chosen.append(other)
        return [
            self.candidate.moved(t.probe, _clipped(t.signature.share(misfit))) for t in chosen[:2]
        ]


def _clipped(share: float) -> float:
    size = min(max(abs(share), _NEAREST), _FARTHEST)
    return size if share >= 0.0 else -size


def _gain(candidate: Candidate, trace: Signature, misfit: FloatArray) -> float:
    """Promised gain; none where the effect would need the sign that it cannot have."""
    gain = trace.gain(misfit)
    return gain if candidate.two_sided or trace.share(misfit) > 0.0 else 0.0


def screen(fitter: Fitter, base: Refit, candidates: Sequence[Candidate]) -> tuple[Screened, ...]:
    """Compare every effect's signatures with the misfit, all probes in one call.

    Args:
        fitter: of the trials.
        base: fit of the base model.
        candidates: effects.

    Returns:
        The effects, the most promising first.
    """
    jobs = [(c, probe) for c in candidates for probe in c.probes]
    space, misfit = fitter.unexplained(base)
    here = fitter.weighted(base.residual)
    changes = fitter.changes([{**base.values, **probe.values} for _, probe in jobs], here)
    traces: dict[str, list[Trace]] = {c.label: [] for c in candidates}
    for (candidate, probe), change in zip(jobs, changes, strict=True):
        if change is not None:
            own = signature(space, change, probe.size)
            traces[candidate.label].append(Trace(probe=probe, change=change, signature=own))
    return _ranked(candidates, traces, misfit)


def _ranked(
    candidates: Sequence[Candidate],
    traces: Mapping[str, Sequence[Trace]],
    misfit: FloatArray,
) -> tuple[Screened, ...]:
    """Effects by what they promise to explain of a misfit, the most promising first.

    Args:
        candidates: effects.
        traces: of each, by its label.
        misfit: (f,) measured minus simulated, projected, in units of noise.
    """
    screened: list[Screened] = []
    for candidate in candidates:
        own = tuple(traces[candidate.label])
        cosines = [t.signature.similarity(misfit) for t in own]
        if candidate.two_sided:
            cosines = [abs(c) for c in cosines]
        screened.append(
            Screened(
                candidate=candidate,
                traces=own,
                similarity=max(cosines, default=0.0),
                gain=max((_gain(candidate, t.signature, misfit) for t in own), default=0.0),
            )
        )
    return tuple(sorted(screened, key=lambda s: -s.gain))


def screen_again(
    screened: Sequence[Screened], space: TangentSpace, misfit: FloatArray
) -> tuple[Screened, ...]:
    """Compare the same signatures with what a larger model misses.

    Args:
        screened: before.
        space: tangent space of the larger model.
        misfit: (f,) projected by it.
    """
    traces = {
        s.candidate.label: [replace(t, signature=t.signature.within(space)) for t in s.traces]
        for s in screened
    }
    return _ranked([s.candidate for s in screened], traces, misfit)


def leading(screened: Sequence[Screened]) -> tuple[Screened, ...]:
    """The form of each effect that is tried first: the usual one unless another promises far more.

    Args:
        screened: effects in all of their forms, the most promising first.

    Returns:
        One form of each effect, the most promising first.
    """
    forms: dict[str, list[Screened]] = {}
    for one in screened:
        forms.setdefault(one.candidate.name, []).append(one)
    chosen: list[Screened] = []
    for own in forms.values():
        usual = next((s for s in own if s.candidate.usual), own[0])
        chosen.append(own[0] if own[0].gain > _FAR_MORE * usual.gain else usual)
    return tuple(sorted(chosen, key=lambda s: -s.gain))


def forms_beside(
    screened: Sequence[Screened],
    labels: Collection[str],
    name: str,
    space: TangentSpace,
    misfit: FloatArray,
) -> tuple[tuple[float, Screened], ...]:
    """What further forms of one effect promise to explain beside the form in a model.

    The model has taken most of the misfit already. What another form would add to it or take from
    it may have either sign.

    Args:
        screened: effects in all of their forms.
        labels: of the effects in the model.
        name: of the effect.
        space: tangent space of the model.
        misfit: (f,) projected by it.

    Returns:
        What each promises and the form, the most promising first.
    """
    promised: list[tuple[float, Screened]] = []
    for one in screened:
        if one.candidate.name == name and one.candidate.label not in labels:
            gains = [t.signature.within(space).gain(misfit) for t in one.traces]
            promised.append((max(gains, default=0.0), one))
    return tuple(sorted(promised, key=lambda pair: -pair[0]))


def signature_similarity(a: Screened, b: Screened) -> float:
    """Largest cosine between the signatures of two effects, without sign."""
    return max(
        (abs(s.signature.similarity(t.signature.projected)) for s in a.traces for t in b.traces),
        default=0.0,
    )


@dataclass(frozen=True, kw_only=True)
class PromisedPair:
    """Two effects whose signatures explain a misfit together.

    Attributes:
        effects: both, each in one of its forms.
        gain: fall of the mean loss that they promise.
        start: where their fit begins [SI].
    """

    effects: tuple[Screened, Screened]
    gain: float
    start: Mapping[str, float]


def promised_pairs(screened: Sequence[Screened], misfit: FloatArray) -> tuple[PromisedPair, ...]:
    """What any two effects promise together, which may be far more than either does alone.

    Args:
        screened: effects in all of their forms.
        misfit: (f,) measured minus simulated, projected, in units of noise.

    Returns:
        The best forms of every two effects with a size of their own, the most promising first.
    """
    traces = [(s, t) for s in screened for t in s.traces if t.signature.visible > 0.0]
    if not traces:
        return ()
    projected = np.stack([t.signature.projected for _, t in traces])
    products, along = projected @ projected.T, projected @ misfit
    squares = np.diag(products)
    best: dict[frozenset[str], PromisedPair] = {}
    for i, (one, first) in enumerate(traces):
        # Least squares of two columns: their shares, and by how much the mean loss falls.
        rest = squares[i] * squares - products[i] ** 2
        apart = rest > _PARALLEL * squares[i] * squares
        safe = np.where(apart, rest, np.inf)
        own = (along[i] * squares - along * products[i]) / safe
        others = (along * squares[i] - along[i] * products[i]) / safe
        gains = np.where(apart, own * along[i] + others * along, 0.0)
        for j in range(i + 1, len(traces)):
            two, second = traces[j]
            key = frozenset({one.candidate.name, two.candidate.name})
            known = best.get(key)
            if gains[j] <= (0.0 if known is None else known.gain):
                continue
            signs = ((one, own[j]), (two, others[j]))
            if len(key) < 2 or any(x < 0.0 and not s.candidate.two_sided for s, x in signs):
                continue
            sizes = [{p.name for p in s.candidate.parameters} for s in (one, two)]
            if not sizes[0] & sizes[1]:
                start = {
                    **one.candidate.moved(first.probe, _clipped(float(own[j]))),
                    **two.candidate.moved(second.probe, _clipped(float(others[j]))),
                }
                best[key] = PromisedPair(effects=(one, two), gain=float(gains[j]), start=start)
    return tuple(sorted(best.values(), key=lambda pair: -pair.gain))


def shortlist(
    screened: Sequence[Screened], count: int, least: float, share: float
) -> tuple[Screened, ...]:
    """Effects to refit: the most promising, and those that resemble one of the first two.

    Args:
        screened: the most promising first.
        count: most of them, look-alikes not counted.
        least: gain below which an effect cannot be claimed anyhow.
        share: of the best gain that an effect must promise; look-alikes half of it.
    """
    if not screened:
        return ()
    best = screened[0].gain
    threshold = max(least, share * best)
    chosen = [s.candidate.name for s in screened if s.gain >= threshold][:count]
    families = {s.candidate.family for s in screened[:2]}
    wanted = {name for s in screened[:2] for name in s.candidate.effect.look_alikes}
    return tuple(
        s
        for s in screened
        if s.candidate.name in chosen
        or (
            (s.candidate.effect.name in wanted or s.candidate.family in families)
            and s.gain >= max(least, 0.5 * share * best)
        )
    )
