"""Undoes the hysteresis of the arm: an inverse Prandtl-Ishlinskii operator on the wanted angle.

The force law without hysteresis predicts the angle at rest for given pressures; with hysteresis the
arm lags behind it. The operator P maps the predicted angle to the reached one, and the force law is
evaluated at P^-1 of the wanted angle. So the law holds the nonlinearity, and P the dependence on
the past. P comes from `pamsim.controllers.play_sum_fit`.
"""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum


@dataclass(frozen=True, kw_only=True)
class HysteresisInverse:
    """From the wanted angle to the angle at which the force law is evaluated.

    Attributes:
        inverse: P^-1, angle to angle [rad].
    """

    inverse: PlaySum

    @classmethod
    def of(cls, lagging: PlaySum) -> HysteresisInverse:
        """Inverse of an operator P from predicted to reached angle."""
        return cls(inverse=lagging.inverse())

    def start(self, angle: float) -> tuple[float, ...]:
        """Memory of an arm that moved from angle 0 to an angle [rad] without turning back."""
        return self.inverse.step(self.inverse.virgin(), angle)[0]

    def undone(self, angle: float, plays: tuple[float, ...]) -> tuple[float, tuple[float, ...]]:
        """Angle at which the force law is evaluated [rad], and the new memory.

        Args:
            angle: wanted [rad].
            plays: memory.
        """
        plays_after, compensated = self.inverse.step(plays, angle)
        return compensated, plays_after
