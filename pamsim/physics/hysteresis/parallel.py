"""Maxwell-slip hysteresis beside a muscle's own operator.

A muscle's own operator is what was fitted or assumed for its rig; hysteresis that is missing beside
it adds to its force, whatever the formulas. The blocks of this one have places in every muscle's
state, so that it can be added to a compiled model.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter

BLOCKS = 5
"""Number of elements."""


@dataclass(frozen=True, kw_only=True)
class ParallelHysteresis(ParameterGroup):
    """Half-width of its loop, without and with pressure; both 0 turn it off."""

    group: ClassVar[str] = "parallel_hysteresis"
    force: float = parameter(
        unit="N", low=0.0, high=1e3, doc="half-width of the loop, without pressure", default=0.0
    )
    force_per_pressure: float = parameter(
        unit="N/Pa", low=0.0, high=1e-2, doc="half-width per gauge pressure", default=0.0
    )
    chord: float = parameter(
        unit="1",
        low=0.0,
        high=1e3,
        doc="output per contraction taken off, so that the loop lies about the static curve",
        default=0.0,
    )
    full_slip: float = parameter(
        unit="1",
        low=0.0,
        high=0.5,
        low_open=True,
        doc="contraction at which every block slips",
        default=0.01,
    )
    decay: float = parameter(
        unit="1",
        low=0.1,
        high=10.0,
        doc="ratio of the shares of neighbours, late slipping over early",
        default=1.0,
    )
