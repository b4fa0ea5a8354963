"""What an effect leaves in the residuals once everything ordinary has been refitted.

A refit of ordinary parameters absorbs much of any effect: only the part across their tangent space
can name it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Signature:
    """One effect's signature at one size.

    Attributes:
        size: in units of the effect's typical one.
        across: (n,) the part that no ordinary parameter can absorb, in units of noise.
        visible: its mean square: the excess over the floor that it would leave.
        absorbed: share of the raw change's square that ordinary parameters absorb.
    """

    size: float
    across: FloatArray
    visible: float
    absorbed: float

    def share(self, misfit: FloatArray) -> float:
        """How many of this signature the misfit holds: 1 for exactly this size of the effect.

        Args:
            misfit: (n,) measured minus simulated across the tangent space, in units of noise.
        """
        square = float(self.across @ self.across)
        return float(self.across @ misfit) / square if square > 0.0 else 0.0

    def gain(self, misfit: FloatArray) -> float:
        """By how much the mean loss would fall, in floors, were the effect linear in its size.

        Args:
            misfit: (n,) measured minus simulated across the tangent space, in units of noise.
        """
        return self.share(misfit) * float(self.across @ misfit)

    def within(self, space: TangentSpace) -> Signature:
        """The same signature across a larger tangent space."""
        across = space.across(self.across)
        return replace(self, across=across, visible=float(across @ across))

    def likeness(self, misfit: FloatArray) -> float:
        """Cosine between what a model lacks and this signature, in [-1, 1].

        Args:
            misfit: (n,) measured minus simulated across the tangent space, in units of noise.
        """
        norm = float(np.linalg.norm(self.across)) * float(np.linalg.norm(misfit))
        return float(self.across @ misfit) / norm if norm > 0.0 else 0.0


class TangentSpace:
    """The residual changes that ordinary parameters can make, to first order.

    Args:
        jacobian: (n, p) change of the weighted residual per parameter.
    """

    def __init__(self, jacobian: FloatArray) -> None:
        norms = np.linalg.norm(jacobian, axis=0)
        used = jacobian[:, norms > 0.0] / norms[norms > 0.0]
        basis, values, _ = np.linalg.svd(used, full_matrices=False)
        # A direction that is noise of differences must not be allowed to absorb an effect.
        self._basis = basis[:, values > 1e-6 * values[0]] if values.size else basis

    def across(self, change: FloatArray) -> FloatArray:
        """The part of a change, shape (n,), or of several, (n, k), that lies across the space."""
        return change - self._basis @ (self._basis.T @ change)


def signature(space: TangentSpace, change: FloatArray, size: float) -> Signature:
    """Signature of a simulated change.

    Args:
        space: of the ordinary parameters.
        change: (n,) of the weighted residual, whose squares sum to the mean loss.
        size: of the effect that made it.
    """
    left = space.across(change)
    raw, kept = float(change @ change), float(left @ left)
    return Signature(
        size=size, across=left, visible=kept, absorbed=1.0 - kept / raw if raw > 0.0 else 0.0
    )
