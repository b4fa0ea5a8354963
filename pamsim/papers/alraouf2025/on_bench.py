"""Alraouf 2025 on the bench: length over pressure, up and down, with the arctangent operator."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_KPA
from pamsim.engine.rig import Rig
from pamsim.papers.alraouf2025.hung_muscle import TOP, HungMuscle
from pamsim.papers.alraouf2025.loop import branch_data, published, scores
from pamsim.papers.bench_experiments import bench, hanging_weight, hung
from pamsim.recordings.printed import BRANCHES, arctangent_law

_STROKE = 10.0
"""Time from no pressure to 500 kPa, and back [s]; four times slower moves no length by 0.05 mm."""
_PER_STROKE = 500  # samples: one for every kPa


def hung_muscle(rig: Rig) -> HungMuscle:
    """The numbers of the bench's muscle, as `fit_hung_muscle` gives them."""
    muscle = rig.muscles["muscle"]
    return HungMuscle(
        fibre_angle=muscle.braided.fibre_angle,
        threshold=muscle.threshold.pressure,
        stiffness=muscle.passive.stiffness,
        softening=muscle.passive.softening,
        half_width=muscle.hysteresis.force if muscle.hysteresis else 0.0,
    )


def bench_curves(stroke: float = _STROKE) -> Mapping[str, Any]:
    """The loop of the engine, beside force balance, Table 2 and the printed equations.

    Args:
        stroke: time from no pressure to 500 kPa [s].

    Returns:
        By branch: ``pressure_kpa``, ``length_cm`` (n,) of the engine; ``balance_off_cm``, their
        largest distance from force balance; ``mean_off_cm`` (11,), engine less Table 2, and its
        ``rmse_cm``; ``equation_rmse_cm``, engine less (3) or (4) over all pressures;
        ``printed_rmse_cm``, that of (3) or (4) on Table 2; ``width_cm``, the largest distance of
        the branches: ``engine``, ``equations``, ``table``.
    """
    rig = bench("alraouf2025")
    weight, law = hanging_weight(rig, 0.0), hung_muscle(rig)
    time = np.linspace(0.0, 2.0 * stroke, 2 * _PER_STROKE + 1)
    kpa = TOP * (1.0 - np.abs(time / stroke - 1.0))
    run = hung(rig, time, kpa * PA_PER_KPA, load=0.0)
    length = 100.0 * (1.0 - run.contraction) * rig.muscles["muscle"].braided.nominal_length
    ends = {"up": slice(None, _PER_STROKE + 1), "down": slice(None, _PER_STROKE - 1, -1)}
    curves: dict[str, Any] = {}
    for branch in BRANCHES:
        own, pressure = length[ends[branch]], kpa[ends[branch]]
        at, mean = branch_data(branch)
        off = np.interp(at, pressure, own) - mean
        printed = arctangent_law(pressure, *published(branch))
        curves[branch] = {
            "pressure_kpa": pressure,
            "length_cm": own,
            "balance_off_cm": float(np.max(np.abs(own - law.length(branch, pressure, weight)))),
            "mean_off_cm": off,
            "rmse_cm": scores(off, mean)["RMSE"],
            "equation_rmse_cm": scores(own - printed, printed)["RMSE"],
            "printed_rmse_cm": scores(arctangent_law(at, *published(branch)) - mean, mean)["RMSE"],
        }
    up, down = (curves[branch]["length_cm"] for branch in BRANCHES)
    equations = [arctangent_law(curves["up"]["pressure_kpa"], *published(b)) for b in BRANCHES]
    means = [branch_data(branch)[1] for branch in BRANCHES]
    curves["width_cm"] = {
        name: float(np.max(np.abs(pair[0] - pair[1])))
        for name, pair in (("engine", (up, down)), ("equations", equations), ("table", means))
    }
    return curves
