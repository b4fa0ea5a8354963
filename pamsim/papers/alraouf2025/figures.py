"""Curves of Alraouf 2025: its loop with both models, and a hung muscle's loop on the bench.

The paper prints lengths over pressure, no force and no weight. What a muscle needs beside that to
move in an engine is taken from an ideal braid with a threshold pressure and the rubber's spring,
fitted to the 22 means of Table 2, both branches at once; half the width of its force loop goes
with them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.engine.rig import Rig
from pamsim.papers.alraouf2025.loop import (
    arctangent_residual,
    arctangent_scores,
    branch_data,
    fit_arctangent,
    fit_bouc_wen,
    published,
    scores,
)
from pamsim.papers.bench_experiments import bench, hanging_weight, hung
from pamsim.papers.numerics import root
from pamsim.physics.force_laws.mckibben import ideal_force
from pamsim.physics.hysteresis.arctangent import Arctangent, half_width
from pamsim.physics.passive import PassiveSpring, tube_force
from pamsim.physics.tension import effective_pressure
from pamsim.recordings.printed import BRANCHES, arctangent_law, loop_rows

LENGTH, DIAMETER = 0.3, 0.02
"""Of the muscle without pressure, as printed [m]."""
TOP = 500.0
"""Highest pressure of the loop [kPa]."""

_STROKE = 10.0
"""Time from no pressure to 500 kPa, and back [s]; four times slower moves no length by 0.05 mm."""
_PER_STROKE = 500  # samples: one for every kPa


def curves() -> Mapping[str, Any]:
    """Lengths of Table 2, both models and their residuals by branch, at the printed pressures.

    The arctangents, published and refitted, are over ``fine_kpa``. The Bouc-Wen loop is free and
    held passive.
    """
    fine = np.linspace(0.0, TOP, 251)
    free, passive = fit_bouc_wen(), fit_bouc_wen(0.5)
    branches = {}
    for branch in BRANCHES:
        laws = {"published": published(branch), "refitted": fit_arctangent(branch)}
        branches[branch] = {
            "mean_cm": branch_data(branch)[1],
            "half_interval_cm": np.array([row.half_interval.value for row in loop_rows(branch)]),
            **{f"{name}_cm": arctangent_law(fine, *a) for name, a in laws.items()},
            **{f"{name}_residual_cm": arctangent_residual(branch, a) for name, a in laws.items()},
            "bouc_wen_residual_cm": free.residual[branch],
            "passive_residual_cm": passive.residual[branch],
        }
    return {
        "pressure_kpa": branch_data("up")[0],
        "fine_kpa": fine,
        **branches,
        "width_cm": {"bouc_wen": free.width, "passive": passive.width},
        "bench": bench_curves(),
    }


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


def hung_muscle(rig: Rig) -> HungMuscle:
    """The numbers of the bench's muscle."""
    muscle = rig.muscles["muscle"]
    width = muscle.hysteresis.force if muscle.hysteresis else 0.0
    angle, rubber = muscle.braided.fibre_angle, muscle.passive
    return HungMuscle(angle, muscle.threshold.pressure, rubber.stiffness, rubber.softening, width)


def bench_curves(stroke: float = _STROKE) -> Mapping[str, Any]:
    """The loop of the engine, beside force balance, Table 2 and the printed equations.

    From no pressure to 500 kPa it takes a stroke [s]. By branch ``balance_off_cm`` is the largest
    distance from force balance; ``rmse_cm`` of the engine and ``printed_rmse_cm`` of (3) or (4) are
    on Table 2, ``equation_rmse_cm`` is between the two over all pressures. ``width_cm`` is the
    largest distance of the branches.
    """
    rig = bench("alraouf2025")
    weight, law = hanging_weight(rig, 0.0), hung_muscle(rig)
    time = np.linspace(0.0, 2.0 * stroke, 2 * _PER_STROKE + 1)
    kpa = TOP * (1.0 - np.abs(time / stroke - 1.0))
    run = hung(rig, time, kpa * PA_PER_KPA, load=0.0)
    length = 100.0 * (1.0 - run.contraction) * rig.muscles["muscle"].braided.nominal_length
    ends = {"up": slice(None, _PER_STROKE + 1), "down": slice(None, _PER_STROKE - 1, -1)}
    found: dict[str, Any] = {}
    for branch in BRANCHES:
        own, pressure = length[ends[branch]], kpa[ends[branch]]
        at, mean = branch_data(branch)
        off = np.interp(at, pressure, own) - mean
        printed = arctangent_law(pressure, *published(branch))
        found[branch] = {
            "pressure_kpa": pressure,
            "length_cm": own,
            "balance_off_cm": float(np.max(np.abs(own - law.length(branch, pressure, weight)))),
            "mean_off_cm": off,
            "rmse_cm": scores(off, mean)["RMSE"],
            "equation_rmse_cm": scores(own - printed, printed)["RMSE"],
            "printed_rmse_cm": arctangent_scores(branch, published(branch))["RMSE"],
        }
    up, down = (found[branch]["length_cm"] for branch in BRANCHES)
    equations = [arctangent_law(found["up"]["pressure_kpa"], *published(b)) for b in BRANCHES]
    means = [branch_data(branch)[1] for branch in BRANCHES]
    found["width_cm"] = {
        name: float(np.max(np.abs(pair[0] - pair[1])))
        for name, pair in (("engine", (up, down)), ("equations", equations), ("table", means))
    }
    return found
