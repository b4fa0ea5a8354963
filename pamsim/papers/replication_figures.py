"""Curves of the papers' figures, computed from what is printed: a page only draws them.

One function for every paper. Each gives plain arrays in the units of that paper's axes; a key ends
with its unit where it has one. What a paper does not print is assumed here, named in the caption.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

import pamsim.papers.alraouf2025.on_bench as alraouf_on_bench
import pamsim.papers.nguyen2024.on_bench as nguyen_on_bench
import pamsim.papers.sarosi.on_bench as sarosi_on_bench
import pamsim.papers.vandamme2008.on_bench as vandamme_on_bench
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA, FloatArray
from pamsim.papers.alraouf2025.loop import branch_data, fit_arctangent, fit_bouc_wen
from pamsim.papers.matiskova2021.stiffness import stiffness_over_pressure
from pamsim.papers.nguyen2024.fractional_reference import complex_stiffness
from pamsim.papers.nguyen2024.numbers import element
from pamsim.papers.paper_models import static_characteristic
from pamsim.papers.replication_figures_force import force_curves
from pamsim.papers.replication_figures_pleated import pleated_curves
from pamsim.recordings.printed import (
    BRANCHES,
    arctangent_law,
    distinct_steps,
    loop_equation,
    loop_rows,
)

Curves = Mapping[str, Any]

_LOOP = np.linspace(0.0, 2.0 * np.pi, 241)  # one period, closed
_MM = 1e3


def replication_figures(papers: Iterable[str]) -> dict[str, Curves]:
    """Curves of every figure of some papers.

    Args:
        papers: names; those without figures are left out.

    Returns:
        Name of the paper -> curves by name, arrays (n,); what the engine gives on the bench under
        ``bench``.
    """
    return {
        paper: {**_FIGURES[paper](), **({"bench": _BENCHES[paper]()} if paper in _BENCHES else {})}
        for paper in papers
    }


def _matiskova2021() -> Curves:
    steps = distinct_steps()
    return {
        **static_characteristic(),
        "stiffness": stiffness_over_pressure(),
        "rows": [
            {
                "size": step.size,
                "p_svd_kpa": (step.pressure[0] - step.pressure[1]) / PA_PER_KPA,
                "beta_deg": step.angle * DEG_PER_RAD,
            }
            for step in steps
        ],
    }


def _alraouf2025() -> Curves:
    fine = np.linspace(0.0, 500.0, 251)
    free, passive = fit_bouc_wen(), fit_bouc_wen(0.5)
    branches = {}
    for branch in BRANCHES:
        pressure, length = branch_data(branch)
        published = tuple(each.value for each in loop_equation(branch))
        refitted = fit_arctangent(branch)
        branches[branch] = {
            "mean_cm": length,
            "half_interval_cm": np.array([row.half_interval.value for row in loop_rows(branch)]),
            "published_cm": arctangent_law(fine, *published),
            "refitted_cm": arctangent_law(fine, *refitted),
            "published_residual_cm": arctangent_law(pressure, *published) - length,
            "refitted_residual_cm": arctangent_law(pressure, *refitted) - length,
            "bouc_wen_residual_cm": free.residual[branch],
            "passive_residual_cm": passive.residual[branch],
        }
    return {
        "pressure_kpa": branch_data("up")[0],
        "fine_kpa": fine,
        **branches,
        "sigma": {"bouc_wen": free.sigma, "passive": passive.sigma},
        "width_cm": {"bouc_wen": free.width, "passive": passive.width},
    }


def _fractional_loop(
    amplitude: float, omega: float, order: float, time_constant: float, stiffness: float
) -> tuple[FloatArray, FloatArray]:
    """Displacement [mm] and force [N] of one period under F = F0 sin(w t)."""
    compliance = 1.0 / complex_stiffness(omega, order, time_constant, stiffness)
    x = amplitude * abs(compliance) * np.sin(_LOOP + math.atan2(compliance.imag, compliance.real))
    return _MM * x, amplitude * np.sin(_LOOP)


def _nguyen2024() -> Curves:
    stiffness, viscosity = 150_000.0, 200_000.0  # Ke [N/m], c: the caption of Figure 3
    order, time_constant, identified = element()
    frequency = np.linspace(1.0, 10.0, 91)
    complex_values = np.array(
        [
            complex_stiffness(2.0 * math.pi * float(f), order, time_constant, identified)
            for f in frequency
        ]
    )
    return {
        "by_order": {
            f"{alpha:g}": _fractional_loop(
                2500.0, 9.0, alpha, (viscosity / stiffness) ** (1.0 / alpha), stiffness
            )
            for alpha in (0.8, 0.5, 0.2)
        },
        "by_amplitude": {
            f"{force:g} N": _fractional_loop(
                force, 2.0 * math.pi * 3.5, order, time_constant, identified
            )
            for force in (95.0, 110.0, 122.0, 148.0)
        },
        "by_frequency": {
            f"{f:g} Hz": _fractional_loop(
                125.0, 2.0 * math.pi * f, order, time_constant, identified
            )
            for f in (3.5, 4.5, 7.5, 8.5)
        },
        "frequency_hz": frequency,
        "stiffness_n_per_m": np.abs(complex_values),
        "loss_percent": 100.0 * np.sin(np.angle(complex_values)),
    }


_FIGURES: Mapping[str, Callable[[], Curves]] = {
    "matiskova2021": _matiskova2021,
    "alraouf2025": _alraouf2025,
    "nguyen2024": _nguyen2024,
    "vandamme2008": pleated_curves,
    "sarosi": force_curves,
}
_BENCHES: Mapping[str, Callable[[], Curves]] = {
    "alraouf2025": alraouf_on_bench.bench_curves,
    "nguyen2024": nguyen_on_bench.bench_curves,
    "vandamme2008": vandamme_on_bench.bench_curves,
    "sarosi": sarosi_on_bench.bench_curves,
}
