"""Runs operators as the engine does: output at the present input, then one Euler step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamsim.physics.hysteresis.arctangent import Arctangent
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.fractional_maxwell import FractionalMaxwell
from pamsim.physics.hysteresis.group import Hysteresis
from pamsim.physics.hysteresis.maxwell_slip import MaxwellSlip
from pamsim.physics.hysteresis.prandtl_ishlinskii import PrandtlIshlinskii
from pamsim.physics.hysteresis.preisach import PleatedFactor, Preisach

TIMESTEP = 1e-3
LOW, HIGH = -0.175, 0.175
"""Span of the operators that have one, symmetric so that odd means odd about 0."""

GROUPS: tuple[Hysteresis, ...] = (
    BoucWen(yield_contraction=0.02, sigma=1.5, sharpness=2.0),
    MaxwellSlip(elements=1, full_slip=0.03),
    MaxwellSlip(elements=6, full_slip=0.1, decay=0.7),
    PrandtlIshlinskii(elements=1, span=0.15, linear_share=1.0),
    PrandtlIshlinskii(elements=7, span=0.15, decay=1.4, linear_share=0.3),
    Preisach(levels=2, low_contraction=LOW, high_contraction=HIGH),
    Preisach(levels=21, low_contraction=LOW, high_contraction=HIGH, c=-0.4, d=0.2),
    PleatedFactor(levels=24, low_contraction=LOW, high_contraction=HIGH),
    Arctangent(turning_points=24, low_contraction=LOW, high_contraction=HIGH),
    Arctangent(
        turning_points=24,
        low_contraction=LOW,
        high_contraction=HIGH,
        steepness_rising=20.0,
        middle_rising=0.7,
        steepness_falling=20.0,
        middle_falling=0.4,
    ),
    FractionalMaxwell(order=0.27, time_constant=49.82, span=0.1),
    FractionalMaxwell(branches=7, order=0.6, time_constant=0.2, span=0.1),
)


def label(group: Hysteresis) -> str:
    return f"{group.law}-{group.state_count}"


def path(turns: Sequence[float], points: int, start: float = 0.0) -> list[float]:
    """Straight lines of some points each through turning points; the start is not in it."""
    xs: list[float] = []
    for turn in turns:
        xs += [start + (turn - start) * k / points for k in range(1, points)]
        xs.append(turn)
        start = turn
    return xs


def run(
    group: Hysteresis,
    xs: Sequence[float],
    act: Sequence[float] | None = None,
    timestep: float = TIMESTEP,
    start: float = 0.0,
) -> tuple[list[float], list[float]]:
    """Outputs at the inputs, and the memory after the last; inputs are joined by straight lines."""
    operator = OPERATORS[group.law]
    memory = [0.0] * group.state_count if act is None else list(act)
    rates = [0.0] * len(memory)
    outputs = []
    # The rate belongs to the step that follows; operators without a rate only see the inputs.
    for x, after in zip([start, *xs], [*xs, None], strict=True):
        outputs.append(operator.output(group, memory, x))
        x_rate = 0.0 if after is None else (after - x) / timestep
        operator.rates(group, memory, rates, x, x_rate, timestep)
        memory = [z + timestep * rate for z, rate in zip(memory, rates, strict=True)]
    return outputs[1:], memory


def area(xs: Sequence[float], ws: Sequence[float]) -> float:
    """Integral of w dx by the trapezium rule."""
    return float(np.trapezoid(ws, xs))
