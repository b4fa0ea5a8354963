"""What the rounding of printed numbers leaves open in a number computed from them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pamsim.recordings.printed import Printed


def propagated(function: Callable[..., float], *numbers: Printed) -> Printed:
    """A function of printed numbers, with how far their rounding lets it move.

    Args:
        function: of as many floats.
        numbers: printed ones.

    Returns:
        Its value; half a unit is the sum of what half a unit of each number moves it.
    """
    (result,) = propagated_each(lambda *values: [function(*values)], *numbers)
    return result


def propagated_each(
    function: Callable[..., Sequence[float]], *numbers: Printed
) -> tuple[Printed, ...]:
    """As `propagated`, for a function with several results."""
    middle = [number.value for number in numbers]
    value = np.asarray(function(*middle), dtype=np.float64)
    moved = np.zeros_like(value)
    for index, number in enumerate(numbers):
        ends = (
            function(*middle[:index], middle[index] + side * number.half_unit, *middle[index + 1 :])
            for side in (-1.0, 1.0)
        )
        moved += np.max([np.abs(np.asarray(end) - value) for end in ends], axis=0)
    return tuple(map(Printed, value.tolist(), moved.tolist()))


def half_unit(decimals: int) -> float:
    """Half a unit of the last printed digit.

    Args:
        decimals: digits printed after the point.
    """
    return 0.5 * 10.0**-decimals
