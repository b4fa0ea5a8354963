"""What data determine of fitted parameters, which not to quote, and what to quote instead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.inference.estimate import Flag
from pamsim.inference.free_parameter import FreeParameter

BoolArray = NDArray[np.bool_]

DEAD = 1e-6
"""Column norm of the Jacobian relative to the largest, up to which it counts as none."""

FLAT = 1e-3
"""Singular value of the column-scaled Jacobian relative to the largest, up to which it is flat."""

_MEMBER = 0.05  # share in a flat direction from which a parameter belongs to it
_CORRELATED = 0.95  # of two estimates: a pair that is pointed out
_AT_BOUND = 1e-6  # of the range
_ZERO = 1e-2  # coefficient of a combination, relative to its first, that is not written


@dataclass(frozen=True)
class Determined:
    """Directions of a parameter space, separated by how far they move the data."""

    # What is determined, one direction per column, shape (k, q). Columns of the Jacobian times
    # ``basis`` are orthogonal
    basis: FloatArray
    flat: FloatArray  # what is not, one direction per row, shape (f, k)
    members: BoolArray  # which parameters take part in a flat direction, shape (k,)


def determined(jacobian: FloatArray, singular: float) -> Determined:
    """Split the parameter space by the singular values of the column-scaled Jacobian, (n, k).

    Scaled columns, none of which may be zero, make the split independent of units and ranges: what
    counts is how similar the effects of parameters are, not how large. Directions below
    ``singular`` times the largest singular value are flat.
    """
    norms = np.linalg.norm(jacobian, axis=0)
    # The triangle has the same right singular vectors, all of them.
    _, values, vt = np.linalg.svd(np.linalg.qr(jacobian / norms, mode="r"))
    # Fewer rows than columns leave directions without a singular value: flat as well.
    good = np.zeros(norms.size, dtype=bool)
    good[: values.size] = values > singular * values[0]
    flat = vt[~good]
    return Determined((vt[good] / norms).T, flat / norms, members(flat.T))


def members(directions: FloatArray) -> BoolArray:
    """Which parameters take part in orthonormal directions (k, f) of a scaled space, (k,)."""
    return np.linalg.norm(directions, axis=1) > _MEMBER


def covariance_along(jacobian: FloatArray, basis: FloatArray) -> FloatArray:
    """Covariance (k, k) under unit white noise by a Jacobian (n, k), flat directions left out.

    ``basis`` (k, q) are the directions that are `determined`.
    """
    _, triangle = np.linalg.qr(jacobian @ basis)
    half = np.linalg.solve(triangle.T, basis.T)
    return half.T @ half


def trade_offs(covariance: FloatArray, i: int, excluded: BoolArray) -> list[int]:
    """Numbers of the parameters that one, i, is correlated with by more than 0.95.

    Those ``excluded`` (k,), such as members of flat directions, are not looked at.
    """
    spread = np.sqrt(np.diag(covariance))
    return [
        j
        for j in range(spread.size)
        if j != i
        and not excluded[j]
        and abs(covariance[i, j]) > _CORRELATED * spread[i] * spread[j]
    ]


@dataclass(frozen=True)
class Identified:
    """What data and priors determine."""

    basis: FloatArray  # determined directions, shape (p, q)
    dead: BoolArray  # parameters the data do not depend on, shape (p,)
    at_bound: BoolArray  # shape (p,)
    flat: BoolArray  # parameters in a direction that the data leave flat, shape (p,)
    open: BoolArray  # parameters that neither data nor priors determine, shape (p,)
    combinations: tuple[str, ...]  # what is determined of those, as text


def identified(
    parameters: Sequence[FreeParameter],
    place: FloatArray,
    jacobian: FloatArray,
    information: FloatArray,
) -> Identified:
    """Split the parameter space, p parameters, into what is determined and what is not.

    A prior determines a direction in which the data are flat if it is narrower than the range. The
    optimum is a place (p,) in the unit cube; the Jacobian (n, p) is in units of the noise per
    range, without priors; their information (p,) is per squared range.
    """
    count = len(parameters)
    norms = np.linalg.norm(jacobian, axis=0)
    dead = norms <= DEAD * np.max(norms)
    at_bound = ~dead & (np.minimum(place, 1.0 - place) < _AT_BOUND)
    inner = np.flatnonzero(~dead & ~at_bound)
    flat, open_ = np.zeros(count, dtype=bool), dead & (information < 1.0)
    held = np.flatnonzero(dead & ~open_)
    axes = np.eye(count)
    basis = [axes[:, held] / np.sqrt(information[held])]
    combinations: tuple[str, ...] = ()
    if inner.size:
        split = determined(jacobian[:, inner], FLAT)
        flat[inner] = split.members
        basis.append(axes[:, inner] @ split.basis)
        if split.flat.size:
            plane = np.linalg.qr(split.flat.T)[0]
            known, turn = np.linalg.eigh(plane.T @ (information[inner, np.newaxis] * plane))
            pinned = known >= 1.0
            basis.append(axes[:, inner] @ plane @ turn[:, pinned] / np.sqrt(known[pinned]))
            loose = plane @ turn[:, ~pinned]
            taking_part = members(np.linalg.qr(loose * norms[inner, np.newaxis])[0])
            open_[inner] = taking_part
            chosen = [parameters[i] for i in inner[taking_part]]
            combinations = _combinations(chosen, loose[taking_part])
    return Identified(np.hstack(basis), dead, at_bound, flat, open_, combinations)


def parameter_flags(
    i: int,
    parameters: Sequence[FreeParameter],
    split: Identified,
    place: FloatArray,
    covariance: FloatArray,
) -> tuple[tuple[Flag, ...], tuple[str, ...], str]:
    """Reasons not to quote parameter i: its flags, its partners and a sentence.

    ``place`` (p,) is the optimum in the unit cube, ``covariance`` (p, p) that of the places.
    """
    excluded = split.open | split.at_bound
    p = parameters[i]
    alone = "" if split.open[i] else "; its prior holds it"
    flags: list[Flag] = []
    partners: list[str] = []
    sentences: list[str] = []
    if split.dead[i]:
        flags.append(Flag.DEAD)
        sentences.append(f"the data do not depend on {p.name}{alone}")
    if split.flat[i]:
        flags.append(Flag.FLAT_DIRECTION)
        together = [q.name for j, q in enumerate(parameters) if split.flat[j] and j != i]
        partners += together
        sentences.append(
            f"{p.name} can change together with {_listed(together)} without changing the"
            f" data{alone}"
        )
    if split.at_bound[i]:
        flags.append(Flag.AT_BOUND)
        side, bound = ("lower", p.low) if place[i] < 0.5 else ("upper", p.high)
        sentences.append(
            f"{p.name} ran into its {side} bound {bound:g} {p.unit}, which then decides, not the"
            " data"
        )
    if not excluded[i]:
        correlated = [parameters[j].name for j in trade_offs(covariance, i, excluded)]
        if correlated and not split.flat[i]:
            flags.append(Flag.TRADE_OFF)
            partners += correlated
            sentences.append(
                f"{p.name} trades off with {_listed(correlated)} (correlation beyond 0.95)"
            )
        if covariance[i, i] > 1.0:
            flags.append(Flag.NOT_PINNED)
            sentences.append(f"the standard error of {p.name} is larger than its allowed range")
    return tuple(flags), tuple(sorted(set(partners))), "; ".join(sentences)


def _combinations(members: Sequence[FreeParameter], loose: FloatArray) -> tuple[str, ...]:
    """Write what is determined: all that is constant along the loose directions, shape (m, f)."""
    constant = np.linalg.svd(loose)[0][:, loose.shape[1] :].T
    # From places in the range to the parameters themselves, or their logarithms.
    constant = constant / _widths(members)
    return tuple(_written(row, members) for row in _reduced(constant))


def _widths(members: Sequence[FreeParameter]) -> list[float]:
    return [np.log(p.high / p.low) if p.scale == "log" else p.high - p.low for p in members]


def _reduced(rows: FloatArray) -> FloatArray:
    """Reduced echelon form: each row starts with a 1 in a column where the others have 0."""
    rows = rows.copy()
    # Columns compare only after scaling: parameters have different units.
    size = np.max(np.abs(rows), axis=0, initial=0.0)
    done = 0
    for column in range(rows.shape[1]):
        if done == rows.shape[0]:
            break
        best = done + int(np.argmax(np.abs(rows[done:, column])))
        if abs(rows[best, column]) <= 1e-6 * size[column]:
            continue
        rows[[done, best]] = rows[[best, done]]
        rows[done] /= rows[done, column]
        for other in range(rows.shape[0]):
            if other != done:
                rows[other] -= rows[other, column] * rows[done]
        done += 1
    return rows


def _written(row: FloatArray, members: Sequence[FreeParameter]) -> str:
    share = np.abs(row) * _widths(members)
    kept = [i for i in range(row.size) if share[i] > _ZERO * np.max(share)]
    if all(members[i].scale == "log" for i in kept):
        text = members[kept[0]].name
        for i in kept[1:]:
            power = "" if abs(abs(row[i]) - 1.0) < _ZERO else f"^{abs(row[i]):.3g}"
            text += f"{' / ' if row[i] < 0.0 else ' * '}{members[i].name}{power}"
        return text
    text = ""
    for i in kept:
        p = members[i]
        term = f"ln({p.name})" if p.scale == "log" else p.name
        factor = "" if abs(abs(row[i]) - 1.0) < _ZERO else f"{abs(row[i]):.3g} "
        sign = (" - " if row[i] < 0.0 else " + ") if text else ""
        text += f"{sign}{factor}{term}"
    return text


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
