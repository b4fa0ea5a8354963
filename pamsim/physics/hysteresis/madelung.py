"""Memory of turning points by Madelung's rules, with a bounded number of them.

``z[0]`` is the last input as a fraction t of the span, ``z[1:]`` the turning points since it
was last at an end of the span, 0 for an empty slot: a turning point is never 0, because there the
memory is wiped out. Zeros throughout are an input that comes from the lower end.
"""

from __future__ import annotations

from pamsim.physics.hysteresis.group import Row

SMALLEST_MOVE = 1e-9
"""Moves below this share of the span are rounding errors of the state, not reversals."""


def remembered(slots: int, z: Row) -> int:
    """Number of turning points in the memory: a slot near 0 is empty."""
    count = 0
    while count < slots and z[1 + count] > SMALLEST_MOVE:
        count += 1
    return count


def kept_and_added(slots: int, z: Row, t: float) -> tuple[int, int]:
    """How the turning points change when the input goes to t, a pure number.

    Turning points alternate, the first is a maximum: with an even number of them the input is on
    a rising branch, which ends at the maximum before last, with an odd number on a falling one.

    Returns:
        Number of old turning points that stay, and 1 if the last input becomes a new one.
    """
    count = remembered(slots, z)
    rising = count % 2 == 0
    reverses = t < z[0] - SMALLEST_MOVE if rising else t > z[0] + SMALLEST_MOVE
    if reverses and count == 0 and t <= SMALLEST_MOVE:
        return 0, 0  # down to the lower end in one step
    if reverses:
        if count == 0 or (t > z[count] + SMALLEST_MOVE if rising else t < z[count] - SMALLEST_MOVE):
            return count, 1 if count < slots else 0
        # Back beyond the start of this branch: both close, the branch before them goes on.
        count -= 1
        rising = not rising
    while count >= 2 and (
        t >= z[count - 1] - SMALLEST_MOVE if rising else t <= z[count - 1] + SMALLEST_MOVE
    ):
        count -= 2
    if count == 1 and t <= SMALLEST_MOVE:
        count = 0
    return count, 0
