"""Numbers that JSON can hold."""

from __future__ import annotations

import math


def safe(value: float | None) -> float | None:
    """Return a finite float, or None for what JSON cannot hold."""
    return float(value) if value is not None and math.isfinite(value) else None
