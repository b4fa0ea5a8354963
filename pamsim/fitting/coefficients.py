"""Coefficients of a curve: ranges, what is held, and which enter linearly with their best values.

A search over all coefficients of a force law fails easily: exponentials make narrow curved valleys.
Given the non-linear ones, the linear ones have a closed-form optimum, so only the non-linear few
are searched (variable projection: Golub and Pereyra, SIAM Journal on Numerical Analysis 10, 1973,
413-432). The six-parameter law so becomes a search over one number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import scipy.optimize

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray

Curve = Callable[[FloatArray], FloatArray]
"""All coefficients, shape (k,), to the predictions, shape (n,)."""

_PROBES = 3  # random points at which a term must be linear
_ROUNDING = 1e-8  # relative


@dataclass(frozen=True, kw_only=True)
class Coefficient:
    """What a fit may do with a coefficient."""

    name: str  # of the coefficient
    unit: str  # SI
    low: float  # smallest value
    high: float  # largest value
    default: float | None = None  # neutral value if there is one; a start of the search
    held: float | None = None  # the value to hold, or None to fit it


def held_coefficients(
    coefficients: tuple[Coefficient, ...], held: Mapping[str, float]
) -> tuple[Coefficient, ...]:
    """The coefficients of a curve, those named in ``held`` at its values [SI].

    Raises:
        InputError: for a name that is not among them, or a value outside the range.
    """
    names = [c.name for c in coefficients]
    for name in held:
        if name not in names:
            raise InputError(f"no coefficient {name!r} to hold; {nearest(name, names)}")
    for c in coefficients:
        if c.name in held and not c.low <= held[c.name] <= c.high:
            raise InputError(
                f"`held` {c.name} = {held[c.name]:g} is outside [{c.low:.4g}, {c.high:.4g}]"
                f"{'' if c.unit == '1' else f' {c.unit}'}"
            )
    return tuple(replace(c, held=held.get(c.name)) for c in coefficients)


def linear_coefficients(
    curve: Curve, coefficients: Sequence[Coefficient], start: FloatArray
) -> tuple[int, ...]:
    """Find free coefficients in which the curve is jointly affine.

    Second differences over steps as wide as a quarter of the allowed range must vanish to
    rounding at a few random places. Of conflicting coefficients (a scale and what it multiplies)
    those are kept that are in conflict with the fewest others. Held ones have their value in
    ``start`` (k,) [SI]. The result are indices, increasing.
    """
    free = [i for i, c in enumerate(coefficients) if c.held is None]
    low = np.array([c.low for c in coefficients])
    step = 0.25 * (np.array([c.high for c in coefficients]) - low)
    rng = np.random.default_rng(20)
    conflicts: dict[int, set[int]] = {i: set() for i in free}
    for _ in range(_PROBES):
        place = start.copy()
        place[free] = (low + rng.uniform(0.1, 1.9, low.size) * step)[free]

        def at(*moved: int, place: FloatArray = place) -> FloatArray:
            there = place.copy()
            for i in moved:
                there[i] += step[i]
            return curve(there)

        origin, once = at(), {i: at(i) for i in free}
        for i in free:
            if not _vanishes(at(i, i) - 2.0 * once[i] + origin, once[i], origin):
                conflicts[i].add(i)
        for i, j in combinations(free, 2):
            if not _vanishes(at(i, j) - once[i] - once[j] + origin, once[i], once[j], origin):
                conflicts[i].add(j)
                conflicts[j].add(i)
    kept: list[int] = []
    for i in sorted(free, key=lambda i: (len(conflicts[i]), i)):
        if i not in conflicts[i] and conflicts[i].isdisjoint(kept):
            kept.append(i)
    return tuple(sorted(kept))


def best_linear(
    curve: Curve,
    measured: FloatArray,
    place: FloatArray,
    linear: Sequence[int],
    coefficients: Sequence[Coefficient],
) -> tuple[FloatArray, FloatArray]:
    """A place (k,) [SI] with the best values, within their ranges, of its linear coefficients.

    Those are ``linear``, from `linear_coefficients`. With it go the predictions there, (n,). Where
    the curve has no value, the place is unchanged.
    """
    full, chosen = place.copy(), list(linear)
    if not chosen:
        return full, curve(full)
    full[chosen] = 0.0
    base = curve(full)
    matrix = np.empty((measured.size, len(chosen)))
    for column, i in enumerate(chosen):
        full[i] = 1.0
        matrix[:, column] = curve(full) - base
        full[i] = 0.0
    if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(base))):
        return place.copy(), curve(place)
    norms = np.linalg.norm(matrix, axis=0)
    norms[norms == 0.0] = 1.0
    low = np.array([coefficients[i].low for i in chosen]) * norms
    high = np.array([coefficients[i].high for i in chosen]) * norms
    target = measured - base
    scaled: FloatArray = np.linalg.lstsq(matrix / norms, target, rcond=1e-12)[0]
    if np.any(scaled < low) or np.any(scaled > high):
        # An exact active set: for a few coefficients twenty times as fast as an interior search. Of
        # itself it stops after as many steps as there are coefficients, which may be too few.
        options = {"method": "bvls", "max_iter": 100, "tol": 1e-12}
        scaled = scipy.optimize.lsq_linear(matrix / norms, target, bounds=(low, high), **options).x
    scaled = np.clip(scaled, low, high)
    full[chosen] = scaled / norms
    return full, base + (matrix / norms) @ scaled


def _vanishes(difference: FloatArray, *terms: FloatArray) -> bool:
    # A curve without a value there (NaN) counts as not linear: the search is then the safe way.
    size = max(float(np.max(np.abs(term))) for term in terms)
    return bool(np.all(np.abs(difference) <= _ROUNDING * size))
