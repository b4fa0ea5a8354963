"""The result of a diagnosis in one word."""

from __future__ import annotations

from enum import StrEnum


class Verdict(StrEnum):
    """What a diagnosis concludes."""

    NO_GAP = "no_gap"
    """Nothing is missing that the data can show."""
    NAMED = "named"
    """Every effect that is missing is certain to its name."""
    NAMED_WITH_REMAINDER = "named_with_remainder"
    """The same or its family, and something is left."""
    AMBIGUOUS = "ambiguous"
    """Something is missing, not all of which is certain to its name."""
    UNEXPLAINED = "unexplained"
    """Something is missing the place of which is not certain, or that no effect tried explains."""
