"""How many digits of a number may be written: of a value with its interval, of a p-value."""

from __future__ import annotations

import math
from collections.abc import Sequence

FEWEST_DIGITS = 3  # of a fitted number; fewer would hide how wide its interval is
SMALLEST_P = 1e-4  # below it no data are as normal, and no permutations as many, as p would need


def significant_digits(value: float, interval: Sequence[float] | None) -> int:
    """Significant digits of a value and the ends of its interval.

    Two of half the interval's width, and three at least; three without a finite interval.
    """
    if interval is None or interval[0] == interval[1]:
        return FEWEST_DIGITS
    largest = max(abs(value), *map(abs, interval))
    half_width = 0.5 * abs(interval[1] - interval[0])
    if not math.isfinite(largest + half_width):
        return FEWEST_DIGITS
    return max(FEWEST_DIGITS, 2 + math.floor(math.log10(largest / half_width)))


def p_in_words(p_value: float) -> str:
    """Two digits, such as ``p = 0.013``; a p-value too small for its assumptions is a bound."""
    return f"p = {p_value:.2g}" if p_value >= SMALLEST_P else f"p < {SMALLEST_P:.4f}"
