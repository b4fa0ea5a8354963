"""The muscle of Van Damme 2008 and its loops, from the printed numbers, in SI."""

from __future__ import annotations

from pamsim.core.units import PA_PER_BAR
from pamsim.papers.claim import printed_number, printed_values

PERCENT = 1e-2


def value(name: str) -> float:
    """A printed number of Van Damme 2008 in its printed unit."""
    return printed_number("vandamme2008", name).value


def length() -> float:
    """Uncontracted length l0 [m]."""
    return value("length") * 1e-2


def pressures() -> tuple[float, ...]:
    """Gauge pressures of the experiments [Pa]."""
    return tuple(p * PA_PER_BAR for p in printed_values("vandamme2008", "pressures"))


def largest() -> float:
    """eps_max, the contraction mapped to +1 [-]."""
    return value("max_contraction") * PERCENT
