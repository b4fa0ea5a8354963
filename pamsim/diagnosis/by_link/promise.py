"""What an effect promises: by how much its signature would lower the misfit, to first order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.candidate import Candidate, Probe
from pamsim.comparison.links import Link
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.inference.projection import as_columns, orthonormal, project_out

_NONE_LEFT = 1e-8
"""Share of a signature's squares below which nothing is left of it beside a model: finite
differences are that accurate."""

_FARTHEST = 8.0  # factor on a probe that a fit begins with at most: a promise is of first order


@dataclass(frozen=True, kw_only=True)
class Signature:
    """Change of the whitened rows (f,) with an effect in one of its forms, at a probe."""

    effect: Candidate
    probe: Probe
    rows: FloatArray


@dataclass(frozen=True, kw_only=True)
class Promise:
    """What an effect would do beside a model."""

    signature: Signature
    gain: float  # fall of the sum of squares
    factor: float  # on its probe
    rows: FloatArray  # change of the whitened rows that is its own, (f,)

    @property
    def effect(self) -> Candidate:
        """Which effect it is."""
        return self.signature.effect

    def start(self, share: float = 1.0) -> dict[str, float]:
        """Values of the effect's parameters that a fit begins with: a share of the promise [SI]."""
        factor = share * float(np.clip(self.factor, -_FARTHEST, _FARTHEST))
        return self.effect.moved(self.signature.probe, factor)


def signatures(
    fitter: LinkFitter, model: LinkModel, probes: Sequence[tuple[Candidate, Probe]]
) -> list[Signature]:
    """Signatures about a model; none of probes with which the simulation breaks down."""
    found = fitter.simulate(
        [{**model.values, **probe.values} for _, probe in probes],
        [fitter.simulator.acts_in(probe.values) for _, probe in probes],
        model,
    )
    return [
        Signature(effect=effect, probe=probe, rows=fitter.whiten(residual) - model.rows)
        for (effect, probe), residual in zip(probes, found, strict=True)
        if residual is not None
    ]


def first_probe(effect: Candidate) -> Probe:
    """The middle one of the sizes of an effect with a threshold; else the first."""
    sizes = [p for p in effect.probes if p.same_shape(effect.probes[0])]
    return sizes[len(sizes) // 2]


def left_beside(model: LinkModel, forms: FloatArray | None = None) -> FloatArray:
    """Rows (f,) that neither a model's parameters nor some forms (f, k) can take away."""
    return project_out(_free(model, forms), model.rows)


def _free(model: LinkModel, forms: FloatArray | None) -> FloatArray:
    own = model.jacobian()
    return orthonormal(own if forms is None else np.hstack([own, forms]))


def promises(
    model: LinkModel, known: Iterable[Signature], forms: FloatArray | None = None
) -> tuple[FloatArray, list[Promise]]:
    """What effects promise beside a model whose parameters, and other forms, are free.

    That is the rows (f,) that neither the model's parameters nor the forms (f, k), see `forms_of`,
    can take away, and the best promise of each probe, the largest gain first. Effects that the
    model has, or whose parameters it has freed, are left out.
    """
    basis = _free(model, forms)
    left = project_out(basis, model.rows)
    found: list[Promise] = []
    for signature in known:
        effect = signature.effect
        if effect.name in model.names or model.freed & {p.name for p in effect.parameters}:
            continue
        kept = project_out(basis, signature.rows)
        square = float(kept @ kept)
        if square <= _NONE_LEFT * float(signature.rows @ signature.rows):
            continue
        factor = -float(kept @ left) / square
        if factor > 0.0 or effect.two_sided:
            gain, change = factor**2 * square, factor * kept
            found.append(Promise(signature=signature, gain=gain, factor=factor, rows=change))
    return left, sorted(found, key=lambda promise: -promise.gain)


def forms_of(fitter: LinkFitter, model: LinkModel, known: Iterable[Signature]) -> FloatArray:
    """What errors of the formulas of a model's effects may look like, as columns (f, k).

    What other formulas look like (`of_families`), and each effect with a size of its own in every
    input and link: a formula that is not exact is off by another share in each. What is in the span
    of these cannot be distinguished from such an error, whatever its size.

    Source: M. Plumlee, Journal of the American Statistical Association 112 (2017) (discrepancy
    orthogonal to the model).
    """
    columns = [of_families(model, known)]
    rows = fitter.units.fitted
    places = rows.group_of * len(fitter.simulator.links) + rows.link_of
    inputs = np.unique(places)
    if inputs.size < places.size:  # of rows at rest each is an input of its own
        for name in sorted(model.freed & model.sensitivities.keys()):
            own = model.sensitivities[name]
            here = [places == place for place in inputs if np.any(own[places == place])]
            columns += [(own * at)[:, np.newaxis] for at in here]
    return np.hstack(columns)


def of_families(model: LinkModel, known: Iterable[Signature]) -> FloatArray:
    """Signatures of all effects, in all forms, of the families of a model's effects, (f, k)."""
    families = {effect.family for effect in model.effects}
    return as_columns([s.rows for s in known if s.effect.family in families], model.rows.size)


def seen_in(fitter: LinkFitter, known: Iterable[Signature], name: str) -> frozenset[Link]:
    """Links whose rows an effect changes by a share that counts."""
    return fitter.shown_in(shares_by_link(fitter, known, name))


def shares_by_link(fitter: LinkFitter, known: Iterable[Signature], name: str) -> FloatArray:
    """Squares of an effect's signatures in each link, each signature's over its sum, (links,)."""
    squares = np.zeros(len(fitter.simulator.links))
    for signature in known:
        if signature.effect.name == name:
            own = fitter.by_link(signature.rows**2)
            squares += own / max(float(own.sum()), np.finfo(float).tiny)
    return squares
