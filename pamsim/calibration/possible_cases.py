"""Cases of a search that may be impossible, such as a muscle longer than its fibres."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from pamsim.core.errors import InputError

Case = TypeVar("Case")
Found = TypeVar("Found")


def possible(
    simulate: Callable[[Sequence[Case]], Sequence[Found | None]],
    cases: Sequence[Case],
    *,
    begun: bool,
) -> list[Found | None]:
    """What cases give when simulated together; None for those that cannot begin.

    A muscle that would be longer than its fibres is a reason to search elsewhere, but not at the
    rig as it is.

    Args:
        simulate: cases together.
        cases: such as rigs.
        begun: whether any has been simulated before; if not, what is wrong is raised.

    Raises:
        InputError: if the first cases cannot begin.
    """
    try:
        return list(simulate(cases))
    except InputError:
        if not begun:
            raise
        if len(cases) == 1:
            return [None]
    return [found for case in cases for found in possible(simulate, [case], begun=True)]
