"""Size of an effect in physical terms, as one line of plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pamsim.core.units import common_unit, to_si
from pamsim.diagnosis.virtual_test_conditions import CONDITIONS
from pamsim.report.numbers import digits, quantity, significant, unit, words

_CONDITION_UNITS = {"Pa": "bar", "rad": "rad"}  # as in the documentation of the tests


def physical_words(
    physical: Mapping[str, Mapping[str, Any]], parameters: Mapping[str, Mapping[str, Any]]
) -> str:
    """Write the size of an effect of a diagnosis, by quantity.

    Such as ``loop half width 15.0 [13.2, 16.8] N; energy per cycle 0.160 [0.140, 0.180] J (test:
    pressure 2.50 bar, contraction amplitude 1.50 %)``; empty without a size. What the effect cannot
    change is left out, and so is a quantity that is one of its parameters or named before.
    """
    sizes: list[str] = []
    written = [(p["value_si"], p["unit_si"], list(p["interval95_si"])) for p in parameters.values()]
    conditions: dict[str, str] = {}
    for name, entry in physical.items():
        plain = name.rpartition(".")[2] if name.rpartition(".")[2] in CONDITIONS else name
        if plain in CONDITIONS:
            shown = _CONDITION_UNITS.get(entry["unit"], common_unit(entry["unit"]))
            value = to_si(entry["value"], entry["unit"], shown, where=name)
            conditions[words(plain).removeprefix("at ")] = quantity(value, shown, 2)
            continue
        ends = entry["interval95"]
        same = entry["value"], entry["unit"], ends and list(ends)
        if same not in written and (ends is None or ends[0] != ends[1]):
            written.append(same)
            sizes.append(_sized(name, *same))
    tested = ", ".join(f"{name} {value}" for name, value in conditions.items())
    return "; ".join(sizes) + (f" (test: {tested})" if tested and sizes else "")


def _sized(name: str, value: float, si_unit: str, ends: Sequence[float] | None) -> str:
    shown = common_unit(si_unit)
    numbers = [to_si(number, si_unit, shown, where=name) for number in (value, *(ends or ()))]
    shared = digits(numbers[0], numbers[1:])
    text = f"{words(name.replace('.', ': '))} {significant(numbers[0], shared)}"
    if ends is not None:
        text += f" [{', '.join(significant(end, shared) for end in numbers[1:])}]"
    return f"{text} {unit(shown)}".rstrip()
