"""Undoes the hysteresis of the arm: an inverse Prandtl-Ishlinskii operator on the wanted angle.

The force law without hysteresis says at which angle given pressures let the arm rest; with it, the
arm gets there late. Taken from predicted to reached angle this is an operator P that lags, and the
force law is asked for P^-1 of the wanted angle. So the law keeps what is nonlinear, and P only what
depends on the past. P comes from `pamsim.controllers.play_sum_fit`.
"""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.hysteresis.prandtl_ishlinskii import PlaySum


@dataclass(frozen=True, kw_only=True)
class HysteresisInverse:
    """From the wanted angle to the one to ask the force law for.

    Attributes:
        inverse: P^-1, angle to angle [rad].
    """

    inverse: PlaySum

    @classmethod
    def of(cls, lagging: PlaySum) -> HysteresisInverse:
        """Inverse of an operator P from predicted to reached angle."""
        return cls(inverse=lagging.inverse())

    def start(self, angle: float) -> tuple[float, ...]:
        """Memory of an arm that came from angle 0 to an angle [rad] in one go."""
        return self.inverse.step(self.inverse.virgin(), angle)[0]

    def undone(self, angle: float, plays: tuple[float, ...]) -> tuple[float, tuple[float, ...]]:
        """Angle to ask the force law for [rad], and the new memory.

        Args:
            angle: wanted [rad].
            plays: memory.
        """
        held, found = self.inverse.step(plays, angle)
        return found, held
