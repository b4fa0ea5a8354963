"""What a sweep does in each run: a job gives a row for each, of rigs with the run's values."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from pamsim.comparison.effects_on_rig import at_size, forms, rig_effect
from pamsim.comparison.readable_unit import readable_unit
from pamsim.core.errors import InputError
from pamsim.core.units import to_si
from pamsim.effects.effect import AT, Effect
from pamsim.engine.parameter_names import ParameterName
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig, load_rig
from pamsim.recordings.step_metrics import step_figure_units
from pamsim.sweeps.design import Value

Row: TypeAlias = Mapping[str, float | str]
"""Column -> number or text; a number that a run did not come to is NaN."""

TEXTS = ("outcome", "message")
"""Columns of every job: how a run ended, and why."""

RIG = "rig"
"""Factor that chooses the rig."""


@dataclass(frozen=True, kw_only=True)
class Job(ABC):
    """A job, which must be picklable: it runs in other processes and on other machines."""

    outputs: Mapping[str, str]  # column of its rows -> unit, ``text`` for text; without `TEXTS`
    runs_in_block: int = 1  # runs that are worth a task of their own

    @property
    def columns(self) -> Mapping[str, str]:
        """Column of its rows -> unit; ``text`` for text."""
        return {**self.outputs, **dict.fromkeys(TEXTS, "text")}

    @abstractmethod
    def rows(self, runs: Sequence[Mapping[str, Value]], threads: int | None) -> list[Row]:
        """One row per run, factor -> value, failed runs included.

        There are ``threads`` simulations at a time, one per processor for None.
        """

    def refused(self, why: object) -> dict[str, float | str]:
        """The row of a run that was refused: of numbers and texts there are none."""
        empty = {name: "" if unit == "text" else math.nan for name, unit in self.outputs.items()}
        return {**empty, "outcome": "refused", "message": str(why)}


def is_effect(rig: Rig, name: str) -> bool:
    """Whether a factor is an effect, of the package or the rig, rather than a rig parameter."""
    return name.partition(AT)[0].partition(":")[0] in forms(rig)


def checked_units(rig: Rig, units: Mapping[str, str], inputs: Mapping[str, str]) -> dict[str, str]:
    """Factor -> its unit, the usual one where an empty one is stated; inputs first.

    Inputs, which do not change the rig, have their usual units here; ``rig`` is the first one.

    Raises:
        InputError: for a name that the rig does not have, or a unit that does not fit it.
    """
    found = {name: unit or inputs[name] for name, unit in units.items() if name in inputs}
    for name, unit in found.items():
        to_si(1.0, unit, inputs[name], where=f"vary.{name}")
    for name, unit in units.items():
        if name in inputs:
            continue
        if is_effect(rig, name):
            rig_effect(rig, name)
            if unit:
                raise InputError(f"vary.{name}: an effect has no unit; 1 is its typical size")
            found[name] = "typical sizes"
            continue
        parameter = rig_parameter(rig, name)
        found[name] = unit or readable_unit(parameter)
        to_si(1.0, found[name], parameter.spec.unit, where=f"vary.{name}")
    return found


def with_values(rig: Rig, values: Mapping[str, Value], units: Mapping[str, str]) -> Rig:
    """A rig with the values, in some units, that a run gives to its parameters and effects.

    Raises:
        InputError: if the rig cannot have them.
        ParameterError: for a value out of range.
    """
    changed: dict[str, float] = {}
    for name, value in values.items():
        if is_effect(rig, name):
            continue
        spec = rig_parameter(rig, name).spec
        changed[name] = to_si(float(value), units[name], spec.unit, where=f"vary.{name}")
    effects = [(rig_effect(rig, n), float(v)) for n, v in values.items() if is_effect(rig, n)]
    if changed and any(map(_starts_from_own, (effect for effect, _ in effects))):
        rig, changed = rig.with_parameters(changed), {}
    for effect, size in effects:
        changed |= at_size(rig, effect, size)
    return rig.with_parameters(changed) if changed else rig


def _starts_from_own(effect: Effect) -> bool:
    """Whether an effect changes the rig's own numbers, which other factors may change."""
    return any(
        p.relative or p.neutral is None or p.scaled_by or ParameterName.parse(p.name).operator
        for p in effect.parameters
    )


def loaded(names: Iterable[str]) -> dict[str, Rig]:
    """Name or folder -> rig; an `InputError` if they have other joints, muscles or names."""
    rigs = {name: load_rig(name) for name in dict.fromkeys(names)}
    first = next(iter(rigs.values()))
    for name, rig in rigs.items():
        if step_figure_units(rig.names) != step_figure_units(first.names):
            raise InputError(
                f"vary.rig: {name} has other joints or muscles than {first.name}; sweep it by"
                " itself"
            )
    return rigs
