"""Write docs/parameters.md: every field that a rig's params.toml can state.

python scripts/parameter_page.py
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Iterator
from pathlib import Path

from pamsim.core.parameters import ParameterGroup, specs
from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.effective_area import Stroke
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.group import Operator
from pamsim.physics.hysteresis.maxwell_slip import ParallelHysteresis
from pamsim.physics.learned import Learned
from pamsim.physics.learned_tension import LearnedTension
from pamsim.physics.muscle import PLAIN_GROUPS, Muscle
from pamsim.recordings.sensors import MeasurementChain

PAGE = Path(__file__).resolve().parent.parent / "docs" / "parameters.md"

INTRODUCTION = """\
# Every field of params.toml

`field` [unit] = default: meaning. **Bold** fields must be stated where the group is; others are 0
unless a default is given. Groups without *Needed* may be left out. A value may be in any unit of
the quantity; one outside its range is refused (`pamsim list params` prints the ranges). Fields
`learned_...` are of curves that `pamsim diagnose` fits and writes. How the file is written: [your
own rig](rig.md); equations and sources: [theory](theory.md). Written by
`scripts/parameter_page.py`.
"""

NEEDED = "*Needed.*"

WHEN: dict[type[ParameterGroup], str] = {
    Braid: "*Needed*; a bellows or piston has `stroke` instead.",
    Stroke: "*Needed* by a bellows or piston, in place of `braid`.",
    Learned: "Curves that `pamsim diagnose` fits and writes.",
    LearnedTension: "Curves that `pamsim diagnose` fits and writes.",
    ParallelHysteresis: "Hysteresis beside that of `muscle.hysteresis`, by Maxwell slip.",
}
"""Groups of which more is to be stated than whether every muscle needs them."""


def page() -> str:
    """The text of docs/parameters.md."""
    parts = [INTRODUCTION]
    needed = {field.name for field in dataclasses.fields(Muscle) if _is_needed(field)}
    for group in PLAIN_GROUPS:
        when = WHEN.get(group, NEEDED if group.group in needed else "")
        rows = () if group in (Learned, LearnedTension) else _rows(group)
        above = (f"{when}\n",) if when else ()
        parts.append(f"\n## muscle.{group.group}\n{_list(above)}{_list(rows)}")
    parts += _laws("force", f"{NEEDED} ", FORCE_LAWS.values())
    parts += _laws("hysteresis", "", OPERATORS.values())
    sensor = _list(_rows(MeasurementChain))
    about = "The sensors of the rig. Where every joint slides, m takes the place of rad."
    parts.append(f"\n## sensor\n\n{about}\n{sensor}")
    return "".join(parts)


def _is_needed(field: dataclasses.Field[object]) -> bool:
    missing = dataclasses.MISSING
    return field.default is missing and field.default_factory is missing


def _laws(name: str, when: str, cards: Collection[ForceLaw | Operator]) -> Iterator[str]:
    """The fields that all laws have, and by name those of each, whose card states the rest."""
    rows = {card.name: _rows(card.group) for card in cards}
    shared = [row for row in next(iter(rows.values())) if all(row in own for own in rows.values())]
    yield (
        f"\n## muscle.{name}\n\n{when}Its `law` is one of the table, and `pamsim list models LAW`"
        f" prints meaning, unit, default and range of its fields. All have\n{_list(tuple(shared))}"
        "\n| law | | fields |\n|---|---|---|\n"
    )
    for card in cards:
        fields = [row for row in rows[card.name] if row not in shared]
        stated = ", ".join(row.split()[1].rstrip(":") for row in fields)
        yield f"| `{card.name}` | {card.title}{_validity(card)} | {stated} |\n"


def _rows(group: type[ParameterGroup]) -> tuple[str, ...]:
    defaults = {field.name: field.default for field in dataclasses.fields(group)}
    return tuple(
        f"- {_stated(name, spec.unit, defaults[name])}: {spec.doc}\n"
        for name, spec in specs(group)
        if not name.startswith("learned_")
    )


def _list(rows: tuple[str, ...]) -> str:
    return f"\n{''.join(rows)}" if rows else ""


def _validity(card: ForceLaw | Operator) -> str:
    if not isinstance(card, ForceLaw):
        return ""
    if card.pressure_range is None:
        return ", at the pressure of its fit"
    low, high = (1e-3 * pressure for pressure in card.pressure_range)
    return "" if high == math.inf else f", for {low:g} to {high:g} kPa"


def _stated(name: str, unit: str, default: object) -> str:
    """Field, unit and default; bold if it must be stated, and without a default of 0."""
    optional = isinstance(default, float | int)
    field = f"`{name}`" if optional else f"**`{name}`**"
    in_unit = "" if unit == "1" else f" [{unit}]"
    return f"{field}{in_unit} = {default:g}" if optional and default else f"{field}{in_unit}"


def main() -> None:
    """Write the page."""
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
