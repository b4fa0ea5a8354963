"""Lead-lag design on G2 for a crossover and a phase margin, sampled by Tustin's rule.

The lead is centred on the crossover, where it gives phi = asin((r - 1)/(r + 1)) for a ratio r of
its corners; the lag lies a decade below and lifts the gain at rest (Franklin, Powell and
Emami-Naeini, Feedback Control of Dynamic Systems, section 6.7). The phase of the held, sampled
plant is taken as it is and Tustin's rule is made exact at the crossover, so that the margin asked
is the margin had; where the plant has more than that by itself, no lead is added.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

import control
import numpy as np

from pamsim.controllers.second_order_model import SecondOrderModel
from pamsim.core.errors import InputError

_control: Any = control  # carries no types

_MOST_LEAD = math.radians(75.0)
_EXACT = 1e-5  # rad


@dataclass(frozen=True, kw_only=True)
class LeadLagDesign:
    """A sampled lead-lag filter from error to input, and the margins it has on the model.

    Attributes:
        period: between two samples [s].
        numerator: b of ``b0 + b1 z^-1 + b2 z^-2`` [input unit per output unit].
        denominator: a of ``1 + a1 z^-1 + a2 z^-2``, the leading 1 included.
        crossover: where the loop's gain is 1 [rad/s].
        phase_margin: there [rad].
        gain_margin: factor on the gain at which the loop becomes unstable [-].
    """

    period: float
    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    crossover: float
    phase_margin: float
    gain_margin: float


def design_lead_lag(
    model: SecondOrderModel,
    *,
    period: float,
    crossover: float,
    phase_margin: float,
    lag_ratio: float = 10.0,
    delay: int = 0,
) -> LeadLagDesign:
    """Design the filter; python-control finds its margins.

    Args:
        model: G2.
        period: between two samples [s].
        crossover: wanted [rad/s].
        phase_margin: wanted at least [rad].
        lag_ratio: by how much the lag lifts the gain at rest, from 1 on.
        delay: dead time of the plant beside G2, in whole periods.

    Raises:
        InputError: for a crossover beyond half the Nyquist frequency, a margin that one lead cannot
            give, or a loop that crosses unity elsewhere too with a smaller margin.
    """
    if not 0.0 < crossover <= 0.5 * math.pi / period:
        raise InputError(
            f"crossover {crossover:g} rad/s is not between 0 and half the Nyquist frequency,"
            f" {0.5 * math.pi / period:g} rad/s; sample faster or ask for less"
        )
    a, b = model.matrices()
    plant = _control.sample_system(_control.ss(a, b, [[1.0, 0.0]], 0.0), period, method="zoh")
    plant = _control.ss2tf(plant) * _control.tf([1.0], [1.0] + [0.0] * delay, period)
    lag = np.array([1.0, crossover / 10.0]), np.array([1.0, crossover / 10.0 / lag_ratio])
    here = complex(plant(cmath.exp(1j * crossover * period)))
    here *= np.polyval(lag[0], 1j * crossover) / np.polyval(lag[1], 1j * crossover)
    needed = math.remainder(phase_margin - math.pi - cmath.phase(here), 2.0 * math.pi)
    if needed > _MOST_LEAD:
        raise InputError(
            f"a phase margin of {math.degrees(phase_margin):.3g} deg at {crossover:g} rad/s needs"
            f" {math.degrees(needed):.3g} deg of lead; one lead-lag filter gives at most 75: ask"
            " for a smaller phase margin or crossover"
        )
    sine = math.sin(max(needed, 0.0))
    root = math.sqrt((1.0 + sine) / (1.0 - sine))
    lead = np.array([root / crossover, 1.0]), np.array([1.0 / (root * crossover), 1.0])
    # A lead has the gain `root` at its centre.
    filtered = _control.tf(
        np.polymul(lag[0], lead[0]) / (abs(here) * root), np.polymul(lag[1], lead[1])
    )
    sampled = _control.sample_system(filtered, period, method="tustin", prewarp_frequency=crossover)
    loop = sampled * plant
    # By its frequency response: the polynomial way loses digits where a pole lies near 1.
    gain_margin, margin, _, _, crossed, _ = map(
        float, _control.stability_margins(loop, method="frd")
    )
    margin = math.radians(margin)
    stable = bool(np.all(np.abs(_control.feedback(loop, 1).poles()) < 1.0))
    if not (stable and margin > phase_margin - _EXACT):
        raise InputError(
            f"crossing at {crossover:g} rad/s leaves a phase margin of {math.degrees(margin):.3g}"
            f" deg at {crossed:.3g} rad/s and a gain margin of {gain_margin:.3g}: the resonance"
            " of G2 is too strong for this filter; move the crossover away from it"
        )
    numerator, denominator = (
        np.asarray(item[0][0], dtype=float) for item in (sampled.num, sampled.den)
    )
    return LeadLagDesign(
        period=period,
        numerator=tuple(map(float, numerator / denominator[0])),
        denominator=tuple(map(float, denominator / denominator[0])),
        crossover=crossed,
        phase_margin=margin,
        gain_margin=gain_margin,
    )
