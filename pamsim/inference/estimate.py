"""An estimated number: value, 95 % interval, and the flags that say why not to quote it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from pamsim.inference.free_parameter import Prior

Interval = tuple[float, float]

NORMAL95 = 1.959964
"""Standard deviations of a normal distribution from the centre of its 95 % interval to an end."""


class Flag(StrEnum):
    """Why an estimate should not be quoted as it stands."""

    DEAD = "dead"
    """The data do not depend on it."""
    FLAT_DIRECTION = "flat_direction"
    """It can change together with others without changing what is simulated."""
    AT_BOUND = "at_bound"
    """It ran into its allowed range, which then decides, not the data."""
    TRADE_OFF = "trade_off"
    """It is correlated by more than 0.95 with another: only a combination is determined."""
    NOT_PINNED = "not_pinned"
    """Of a curve: its 95 % interval is wider than the value on either side, so that not even the
    sign is known. Of a rig: its standard error is larger than its allowed range."""


@dataclass(frozen=True, kw_only=True)
class PriorPull:
    """What a prior and the data did to each other."""

    prior: Prior  # the knowledge from elsewhere
    distance: float  # (value - mean) / standard deviation [-]; beyond 2 they contradict each other
    # Of the information on the parameter that comes from its prior, 0 to 1; None where the
    # parameter has no interval
    share: float | None


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A parameter or coefficient after a fit."""

    name: str  # of the parameter
    unit: str  # SI, of value, interval and bounds
    value: float  # at the optimum, or as held
    # 95 % interval; None if held, at a bound, or not determined by the data
    interval95: Interval | None
    bounds: Interval | None = None  # range the fit was allowed; None if it is not stated
    held: bool = False  # True if it was not fitted
    flags: tuple[Flag, ...] = ()  # why not to quote it; empty if there is no reason
    partners: tuple[str, ...] = ()  # parameters it trades off or shares a flat direction with
    sentence: str = ""  # the flags for a person; empty if there are none
    standard_error: float | None = None  # [unit]; None like the interval
    # By how much -2 log likelihood has risen at the ends of the interval; 3.84 for white noise,
    # more where the noise is coloured; None if not known
    rise95: float | None = None
    prior: PriorPull | None = None  # its prior against the data, or None


def without_intervals(estimates: Sequence[Estimate]) -> tuple[Estimate, ...]:
    """The same of a search that did not converge: an interval about no optimum means nothing."""
    return tuple(replace(one, interval95=None, standard_error=None) for one in estimates)
