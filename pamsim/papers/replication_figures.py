"""Curves of the papers' figures, computed from what is printed: a page only draws them.

Every paper's ``figures`` gives plain arrays in the units of that paper's axes; a key ends with its
unit where it has one. What a paper does not print is assumed there, named in the caption.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.papers.alraouf2025 import figures as alraouf2025
from pamsim.papers.matiskova2021.statics import static_characteristic
from pamsim.papers.matiskova2021.stiffness import stiffness_over_pressure
from pamsim.papers.nguyen2024 import figures as nguyen2024
from pamsim.papers.sarosi import figures as sarosi
from pamsim.papers.vandamme2008 import figures as vandamme2008
from pamsim.recordings.printed import distinct_steps

Curves = Mapping[str, Any]


def replication_figures(papers: Iterable[str]) -> dict[str, Curves]:
    """Curves of every figure of some papers.

    Returns:
        Name of the paper -> curves by name, arrays (n,); what the engine gives on the bench under
        ``bench``.
    """
    return {paper: _CURVES[paper]() for paper in papers}


def _matiskova2021() -> Curves:
    rows = [
        {
            "size": step.size,
            "p_svd_kpa": (step.pressure[0] - step.pressure[1]) / PA_PER_KPA,
            "beta_deg": step.angle * DEG_PER_RAD,
        }
        for step in distinct_steps()
    ]
    return {**static_characteristic(), "stiffness": stiffness_over_pressure(), "rows": rows}


_CURVES: Mapping[str, Callable[[], Curves]] = {
    "matiskova2021": _matiskova2021,
    "alraouf2025": lambda: {**alraouf2025.curves(), "bench": alraouf2025.bench_curves()},
    "nguyen2024": lambda: {**nguyen2024.curves(), "bench": nguyen2024.bench_curves()},
    "vandamme2008": lambda: {**vandamme2008.curves(), "bench": vandamme2008.bench_curves()},
    "sarosi": lambda: {**sarosi.curves(), "bench": sarosi.bench_curves()},
}
