"""Read single printed numbers of Nguyen 2024, Van Damme 2008 and Sarosi with their digits.

Numbers stay in the printed units: they are compared digit by digit with what is recomputed.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.store.printed_table import Printed, printed_document


@functools.cache
def _numbers(paper: str) -> Mapping[str, Any]:
    return printed_document(f"paper_{paper.lower()}_printed.toml")["number"]


def printed_numbers(paper: str, name: str) -> tuple[Printed, ...]:
    """All numbers of one entry.

    Args:
        paper: letter, ``C``, ``D`` or ``E``.
        name: of the entry.

    Returns:
        The numbers in the entry's printed unit.

    Raises:
        InputError: if there is no such entry.
    """
    entries = _numbers(paper)
    if name not in entries:
        raise InputError(f"paper {paper} prints no {name!r}; {nearest(name, entries)}")
    value = entries[name]["value"]
    return tuple(Printed.read(text) for text in ([value] if isinstance(value, str) else value))


def printed_values(paper: str, name: str) -> tuple[float, ...]:
    """As `printed_numbers`, without their digits."""
    return tuple(number.value for number in printed_numbers(paper, name))


def printed_number(paper: str, name: str) -> Printed:
    """The one number of an entry; arguments and errors as `printed_numbers`."""
    (number,) = printed_numbers(paper, name)
    return number
