"""Curves of Alraouf 2025: its loop with both models, and a hung muscle's loop on the bench."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_KPA
from pamsim.engine.rig import Rig
from pamsim.papers.alraouf2025.hung_muscle import TOP, HungMuscle
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
from pamsim.recordings.printed import BRANCHES, arctangent_law, loop_rows

_STROKE = 10.0
"""Time from no pressure to 500 kPa, and back [s]; four times slower moves no length by 0.05 mm."""
_PER_STROKE = 500  # samples: one for every kPa


def curves() -> Mapping[str, Any]:
    """Lengths of Table 2, both models and their residuals.

    Returns:
        ``pressure_kpa`` (n,), ``fine_kpa`` (m,) [kPa]; under ``up`` and ``down`` the means with
        half intervals (n,), published and refitted arctangent (m,), residuals (n,) of both and of
        the Bouc-Wen loop, free and held passive [cm]; ``width_cm`` of both loops.
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
    }


def hung_muscle(rig: Rig) -> HungMuscle:
    """The numbers of the bench's muscle, as `fit_hung_muscle` gives them."""
    muscle = rig.muscles["muscle"]
    width = muscle.hysteresis.force if muscle.hysteresis else 0.0
    angle, rubber = muscle.braided.fibre_angle, muscle.passive
    return HungMuscle(angle, muscle.threshold.pressure, rubber.stiffness, rubber.softening, width)


def bench_curves(stroke: float = _STROKE) -> Mapping[str, Any]:
    """The loop of the engine, beside force balance, Table 2 and the printed equations.

    From no pressure to 500 kPa it takes a stroke [s].

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
