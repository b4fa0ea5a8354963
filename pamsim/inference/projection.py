"""Vectors as columns of a matrix, and what lies in their span."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pamsim.core.units import FloatArray

RANK = 1e-6
"""Relative size of a direction from which it counts: difference Jacobians are that accurate."""


def as_columns(vectors: Iterable[FloatArray], rows: int) -> FloatArray:
    """Vectors (n,) as the columns of a matrix (n, k), of which there may be none."""
    return np.column_stack([np.empty((rows, 0)), *vectors])


def orthonormal(columns: FloatArray, rank: float = RANK) -> FloatArray:
    """Orthonormal basis (n, r) of columns, which all count the same whatever their units.

    Directions below ``rank``, a share of the largest singular value, count as none.
    """
    norms = np.linalg.norm(columns, axis=0)
    used = columns[:, norms > 0.0] / norms[norms > 0.0]
    if not used.size:
        return np.empty((len(columns), 0))
    basis, values, _ = np.linalg.svd(used, full_matrices=False)
    return basis[:, values > rank * values[0]]


def project_out(basis: FloatArray, rows: FloatArray) -> FloatArray:
    """Part of rows, (n,) or (n, k), that an orthonormal basis (n, p) cannot give."""
    return rows - basis @ (basis.T @ rows)
