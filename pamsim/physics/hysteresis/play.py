"""The play operator (backlash), the elementary memory of Prandtl-Ishlinskii and Maxwell-slip.

z follows x at a distance r: z+ = max(x - r, min(x + r, z)) (Krasnosel'skii and Pokrovskii 1989;
Brokate and Sprekels 1996). Its complement x - z is the stop operator, an elastic-ideally plastic
element.
"""

from __future__ import annotations

import math


def play(x: float, held: float, threshold: float) -> float:
    """Output of the play operator, which is also its new memory.

    Args:
        x: input.
        held: z, the memory, in the unit of x.
        threshold: r >= 0, half the dead travel, in the unit of x.

    Returns:
        z+ within r of x. A NaN in input or memory stays NaN: neither comparison holds for it.
    """
    if held < x - threshold:
        return x - threshold
    if held > x + threshold:
        return x + threshold
    return x if math.isnan(x) else held
