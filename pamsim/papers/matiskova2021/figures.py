"""Curves of Matiskova 2021: static characteristic, printed rows, stiffness over pressure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.papers.matiskova2021.equations import stiffness_over_pressure
from pamsim.papers.matiskova2021.statics import static_characteristic
from pamsim.recordings.printed import distinct_steps


def curves() -> Mapping[str, Any]:
    """Equation (23) of `static_characteristic`, the distinct ``rows``, and ``stiffness``."""
    rows = [
        {
            "size": step.size,
            "p_svd_kpa": (step.pressure[0] - step.pressure[1]) / PA_PER_KPA,
            "beta_deg": step.angle * DEG_PER_RAD,
        }
        for step in distinct_steps()
    ]
    return {**static_characteristic(), "stiffness": stiffness_over_pressure(), "rows": rows}
