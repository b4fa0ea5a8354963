"""Which directions of a parameter space the data determine, from the Jacobian alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray

BoolArray = NDArray[np.bool_]

DEAD = 1e-6
"""Column norm of the Jacobian relative to the largest, up to which it counts as none."""

FLAT = 1e-3
"""Singular value of the column-scaled Jacobian relative to the largest, up to which it is flat."""

_MEMBER = 0.05  # share in a flat direction from which a parameter belongs to it
_CORRELATED = 0.95  # of two estimates: a pair that is pointed out


@dataclass(frozen=True)
class Determined:
    """Directions of a parameter space, separated by how far they move the data.

    Attributes:
        basis: what is determined, one direction per column, shape (k, q). Columns of the Jacobian
            times ``basis`` are orthogonal.
        flat: what is not, one direction per row, shape (f, k).
        members: which parameters take part in a flat direction, shape (k,).
    """

    basis: FloatArray
    flat: FloatArray
    members: BoolArray


def determined(jacobian: FloatArray, singular: float) -> Determined:
    """Split the parameter space by the singular values of the column-scaled Jacobian.

    Scaled columns make the split independent of units and ranges: what counts is how similar the
    effects of parameters are, not how large.

    Args:
        jacobian: shape (n, k), columns not zero.
        singular: directions below this fraction of the largest singular value are flat.
    """
    norms = np.linalg.norm(jacobian, axis=0)
    _, values, vt = np.linalg.svd(jacobian / norms, full_matrices=False)
    # Fewer rows than columns leave directions without a singular value: flat as well.
    good = values > singular * values[0]
    basis = (vt[good] / norms).T
    if vt.shape[0] < vt.shape[1]:
        vt = np.linalg.svd(jacobian / norms)[2]
        good = np.append(good, np.zeros(vt.shape[0] - good.size, dtype=bool))
    flat = vt[~good]
    return Determined(basis, flat / norms, members(flat.T))


def members(directions: FloatArray) -> BoolArray:
    """Which parameters take part in orthonormal directions (k, f) of a scaled space, (k,)."""
    return np.linalg.norm(directions, axis=1) > _MEMBER


def covariance_along(jacobian: FloatArray, basis: FloatArray) -> FloatArray:
    """Covariance (k, k) under unit white noise, flat directions left out.

    Args:
        jacobian: shape (n, k).
        basis: determined directions, shape (k, q), from `determined`.
    """
    _, triangle = np.linalg.qr(jacobian @ basis)
    half = np.linalg.solve(triangle.T, basis.T)
    return half.T @ half


def trade_offs(covariance: FloatArray, i: int, excluded: BoolArray) -> list[int]:
    """Numbers of the parameters that one is correlated with by more than 0.95.

    Args:
        covariance: shape (k, k).
        i: the one.
        excluded: parameters not to look at, such as members of flat directions, shape (k,).
    """
    spread = np.sqrt(np.diag(covariance))
    return [
        j
        for j in range(spread.size)
        if j != i
        and not excluded[j]
        and abs(covariance[i, j]) > _CORRELATED * spread[i] * spread[j]
    ]
