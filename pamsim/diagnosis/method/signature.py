"""The signature of an effect: what it leaves in the residuals after a refit of other parameters.

Nuisance parameters explain much of any effect. Only the part of the change that is orthogonal to
their Jacobian can identify it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pamsim.core.units import FloatArray


@dataclass(frozen=True, kw_only=True)
class Signature:
    """One effect's signature at one size.

    Attributes:
        size: in units of the effect's typical one.
        projected: (n,) the part that no nuisance parameter can explain, in units of noise.
        visible: its mean square: the excess over the noise that it would leave.
        explained_by_nuisance: share of the raw change's square that nuisance parameters explain.
    """

    size: float
    projected: FloatArray
    visible: float
    explained_by_nuisance: float

    def share(self, misfit: FloatArray) -> float:
        """Multiple of this signature that fits the misfit best: 1 for exactly this size.

        Args:
            misfit: (n,) measured minus simulated, projected, in units of noise.
        """
        square = float(self.projected @ self.projected)
        return float(self.projected @ misfit) / square if square > 0.0 else 0.0

    def gain(self, misfit: FloatArray) -> float:
        """By how much the mean loss would fall, were the effect linear in its size.

        Args:
            misfit: (n,) measured minus simulated, projected, in units of noise.
        """
        return self.share(misfit) * float(self.projected @ misfit)

    def within(self, space: TangentSpace) -> Signature:
        """The same signature after projection by a larger tangent space."""
        projected = space.project_out(self.projected)
        return replace(self, projected=projected, visible=float(projected @ projected))

    def similarity(self, misfit: FloatArray) -> float:
        """Cosine between a misfit and this signature, in [-1, 1].

        Args:
            misfit: (n,) measured minus simulated, projected, in units of noise.
        """
        norm = float(np.linalg.norm(self.projected)) * float(np.linalg.norm(misfit))
        return float(self.projected @ misfit) / norm if norm > 0.0 else 0.0


class TangentSpace:
    """The residual changes that parameters can make, to first order.

    Args:
        jacobian: (n, p) change of the weighted residual per parameter.
    """

    def __init__(self, jacobian: FloatArray) -> None:
        norms = np.linalg.norm(jacobian, axis=0)
        used = jacobian[:, norms > 0.0] / norms[norms > 0.0]
        basis, values, _ = np.linalg.svd(used, full_matrices=False)
        # A direction that is rounding noise of differences must not explain an effect.
        self._basis = basis[:, values > 1e-6 * values[0]] if values.size else basis

    def project_out(self, change: FloatArray) -> FloatArray:
        """Projection of a change (n,), or several (n, k), onto the orthogonal complement."""
        return change - self._basis @ (self._basis.T @ change)


def signature(space: TangentSpace, change: FloatArray, size: float) -> Signature:
    """Signature of a simulated change.

    Args:
        space: of the nuisance parameters.
        change: (n,) of the weighted residual, whose squares sum to the mean loss.
        size: of the effect that made it.
    """
    left = space.project_out(change)
    raw, kept = float(change @ change), float(left @ left)
    return Signature(
        size=size,
        projected=left,
        visible=kept,
        explained_by_nuisance=1.0 - kept / raw if raw > 0.0 else 0.0,
    )
