"""A muscle that hangs and moves as Table 2 says: a force law under the paper's arctangent loop.

The paper prints lengths over pressure, no force and no weight. What a muscle needs beside that to
move in an engine is taken from an ideal braid with a threshold pressure and the rubber's spring,
fitted to the 22 means of Table 2, both branches at once; half the width of its force loop goes
with them.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.papers.alraouf2025.loop import branch_data
from pamsim.papers.numerics import least_squares, rms, root
from pamsim.physics.force_laws.mckibben import ideal_force
from pamsim.physics.hysteresis.arctangent import Arctangent, half_width
from pamsim.physics.passive import PassiveSpring, tube_force
from pamsim.physics.tension import effective_pressure
from pamsim.recordings.printed import BRANCHES

LENGTH, DIAMETER = 0.3, 0.02
"""Of the muscle without pressure, as printed [m]."""
TOP = 500.0
"""Highest pressure of the loop [kPa]."""

_START = (0.7, 3e4, 1500.0, 40.0, 4.0)
_LOWEST = (0.3, 0.0, 10.0, 0.2, 0.0)
_HIGHEST = (0.9, 9e4, 1e4, 200.0, 50.0)


@dataclass(frozen=True)
class HungMuscle:
    """The numbers of the fit, and what follows from them."""

    fibre_angle: float  # [rad]
    threshold: float  # pressure lost to the tube [Pa]
    stiffness: float  # of the rubber at nominal length [N]
    softening: float  # of the rubber [-]
    half_width: float  # of the force loop between the steepest points of its branches [N]

    def pull(self, pressure: float, contraction: float) -> float:
        """Force in the middle of the loop [N]; gauge pressure [Pa], contraction [-]."""
        reaching = effective_pressure(pressure, self.threshold)
        air = ideal_force(reaching, 1.0 - contraction, 1.0, DIAMETER, self.fibre_angle)
        rubber = PassiveSpring(stiffness=self.stiffness, softening=self.softening)
        return air + tube_force(rubber, contraction)

    def highest(self, weight: float) -> float:
        """Contraction at 500 kPa, where both branches meet [-]."""
        top = TOP * PA_PER_KPA
        return root(lambda kappa: self.pull(top, kappa) - weight, -0.3, 0.6, 1e-12)

    def length(self, branch: str, pressure_kpa: FloatArray, weight: float) -> FloatArray:
        """Lengths (n,) [cm] where the force balances a weight [N] on one branch of the whole loop.

        The branch is ``up`` or ``down``, the gauge pressures (n,) are in kPa.
        """
        high = self.highest(weight)
        loop = Arctangent(high_contraction=high)
        middle = 0.5 * (loop.middle_rising + loop.middle_falling)
        per_width = self.half_width / half_width(loop, middle)[0]
        side = per_width if branch == "up" else -per_width  # contracting costs force

        def balance(kappa: float, pressure: float) -> float:
            share = min(max(kappa / high, 0.0), 1.0)
            return self.pull(pressure, kappa) - side * half_width(loop, share)[0] - weight

        pressures = (pressure_kpa * PA_PER_KPA).tolist()
        kappas = [root(lambda k, p=p: balance(k, p), -0.3, 0.6, 1e-12) for p in pressures]
        return 100.0 * LENGTH * (1.0 - np.array(kappas))


@functools.cache
def fit_hung_muscle(weight: float) -> tuple[HungMuscle, float]:
    """Least squares on the means of Table 2 with a weight [N], and the RMS misfit [cm]."""
    pressure, _ = branch_data("up")
    wanted = np.concatenate([branch_data(branch)[1] for branch in BRANCHES])

    def lengths(*values: float) -> FloatArray:
        muscle = HungMuscle(*values)
        return np.concatenate([muscle.length(b, pressure, weight) for b in BRANCHES])

    bounds = (_LOWEST, _HIGHEST)
    fitted, _ = least_squares(
        lengths, wanted, _START, bounds=bounds, x_scale=_START, diff_step=1e-5
    )
    return HungMuscle(*fitted.tolist()), rms(lengths(*fitted) - wanted)
