"""What the property tests draw from."""

from __future__ import annotations

from hypothesis import strategies as st


def between(low: float, high: float) -> st.SearchStrategy[float]:
    """Ordinary floats of a closed range."""
    return st.floats(low, high, allow_nan=False, allow_subnormal=False)


BRAIDS = st.tuples(between(0.05, 2.0), between(0.005, 0.1), between(0.05, 0.95))
"""Nominal length [m], diameter [m], fibre angle [rad], over the whole range of angles."""

SHARES = between(0.0, 1.0)
"""A share of something [-]."""
