"""Curves of Matiskova 2021: static characteristic, and stiffness over pressure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pamsim.papers.matiskova2021.equations import stiffness_over_pressure
from pamsim.papers.matiskova2021.statics import static_characteristic


def curves() -> Mapping[str, Any]:
    """Equation (23) of `static_characteristic`, and ``stiffness``."""
    return {**static_characteristic(), "stiffness": stiffness_over_pressure()}
