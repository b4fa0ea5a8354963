"""Write docs/parameters.md: every field that a rig's params.toml can state.

python scripts/parameter_page.py
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

from pamsim.core.parameters import ParameterGroup, specs
from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.effective_area import Stroke
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.maxwell_slip import ParallelHysteresis
from pamsim.physics.muscle import PLAIN_GROUPS, Muscle
from pamsim.recordings.sensors import MeasurementChain

PAGE = Path(__file__).resolve().parent.parent / "docs" / "parameters.md"

INTRODUCTION = """\
# Every field of params.toml

Written by `scripts/parameter_page.py` from the classes that read the file. How the file is
written: [describe your own rig](rig.md). Equations and sources of the laws: [theory](theory.md).

Values may be in any unit of the same quantity; ranges and defaults here are in SI units. A field
with a default may be left out. A value outside its range is refused with the range.
"""

HEADER = "\n| field | meaning | range | default |\n|---|---|---|---|\n"

NEEDED = "Every muscle needs it."
OPTIONAL = "Optional."

WHEN: dict[type[ParameterGroup], str] = {
    Braid: "Every muscle needs it; a bellows or piston has `stroke` instead.",
    Stroke: "A bellows or piston needs it, in place of `braid`.",
    ParallelHysteresis: "Optional: hysteresis beside that of `muscle.hysteresis`, by Maxwell slip.",
}
"""Groups of which more is to be stated than whether every muscle needs them."""


def page() -> str:
    """The text of docs/parameters.md."""
    parts = [INTRODUCTION]
    needed = {field.name for field in dataclasses.fields(Muscle) if _is_needed(field)}
    for group in PLAIN_GROUPS:
        when = NEEDED if group.group in needed else OPTIONAL
        parts.append(_table(f"muscle.{group.group}", group, WHEN.get(group, when)))
    parts.append("\n## muscle.force\n\nEvery muscle needs it, with `law` as one of these.\n")
    parts += [
        _table(card.name, card.group, f"{card.title}{_validity(card)}.", level=3)
        for card in FORCE_LAWS.values()
    ]
    parts.append("\n## muscle.hysteresis\n\nOptional, with `law` as one of these.\n")
    parts += [
        _table(card.name, card.group, f"{card.title}.", level=3) for card in OPERATORS.values()
    ]
    parts.append(_table("sensor", MeasurementChain, "Optional: the sensors of the rig."))
    return "".join(parts)


def _is_needed(field: dataclasses.Field[object]) -> bool:
    missing = dataclasses.MISSING
    return field.default is missing and field.default_factory is missing


def _table(title: str, group: type[ParameterGroup], text: str, level: int = 2) -> str:
    defaults = {field.name: field.default for field in dataclasses.fields(group)}
    rows = "".join(
        f"| `{name}` | {spec.doc.replace('|', '&#124;')} |"
        f" {'above ' if spec.low_open else ''}{spec.low:g} to {spec.high:g}{_unit(spec.unit)} |"
        f" {_default(defaults[name])} |\n"
        for name, spec in specs(group)
    )
    return f"\n{'#' * level} {title}\n\n{text}\n{HEADER}{rows}"


def _validity(card: ForceLaw) -> str:
    if card.pressure_range is None:
        return ", at the pressure of its fit"
    low, high = (1e-3 * pressure for pressure in card.pressure_range)
    return ", at any pressure" if high == math.inf else f", for {low:g} to {high:g} kPa"


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def _default(value: object) -> str:
    return f"{value:g}" if isinstance(value, float | int) else ""


def main() -> None:
    """Write the page."""
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
