"""Parameter groups that check themselves: frozen dataclasses with unit and range per field.

A group is declared as::

    class Chamber(ParameterGroup, group="chamber"):
        dead_volume: float = quantity("[0, 1e-2] m^3", "volume of fittings and tubing")

The number's *source* (paper, data sheet, identified, assumed) belongs to a value, not to a field,
so it travels beside the value in `Sourced`, which is what a rig's ``params.toml`` is read into.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import math
from dataclasses import dataclass
from numbers import Real
from typing import Any, ClassVar, dataclass_transform

from pamsim.core.encoding import NOT_IN_JSON
from pamsim.core.errors import ParameterError
from pamsim.core.units import to_si

_META = "pamsim"


@dataclass(frozen=True, kw_only=True)
class FieldSpec:
    """What a parameter field allows."""

    unit: str  # SI unit, in the spelling of `pamsim.core.units.to_si`; ``1`` for a pure number
    low: float  # smallest allowed value, itself not allowed if ``low_open``
    high: float  # largest allowed value
    low_open: bool  # see ``low``
    doc: str  # what the parameter means
    # Value of an effect that is off; None where a user must think about the number
    default: float | None = dataclasses.field(default=None, metadata=NOT_IN_JSON)

    def range_text(self) -> str:
        """The allowed range as a mathematician writes it, such as ``(0, 1] m``."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{'(' if self.low_open else '['}{self.low:g}, {self.high:g}]{unit}"


def parameter(
    *,
    unit: str,
    low: float,
    high: float,
    doc: str,
    low_open: bool = False,
    default: float | None = None,
) -> Any:
    """Declare one parameter field, see `FieldSpec`."""
    spec = FieldSpec(unit=unit, low=low, high=high, low_open=low_open, doc=doc, default=default)
    value: Any = dataclasses.MISSING if default is None else default
    return dataclasses.field(default=value, metadata={_META: spec})


def quantity(allowed: str, doc: str, default: float | None = None) -> Any:
    """Declare a `parameter` by its range and unit, written as `FieldSpec.range_text` does."""
    limits, _, unit = allowed.partition("]")
    low, high = limits[1:].split(", ")
    return parameter(
        unit=unit.strip() or "1",
        low=float(low),
        high=float(high),
        low_open=limits.startswith("("),
        doc=doc,
        default=default,
    )


@dataclass_transform(frozen_default=True, kw_only_default=True)
@dataclass(frozen=True, kw_only=True)
class ParameterGroup:
    """Base of every parameter group: checks each declared field on construction.

    A subclass is a frozen dataclass. It is made one here if it states its class variables as
    keywords, ``class Chain(ParameterGroup, group="chain")``.
    """

    group: ClassVar[str] = ""
    """Name of the group in files and errors."""
    law: ClassVar[str] = ""
    """Name of the law, in groups that offer several."""
    states: ClassVar[int] = 0
    """Number of internal states of the law."""

    def __init_subclass__(cls, **variables: str | int) -> None:
        """Set the class variables."""
        super().__init_subclass__()
        for name, value in variables.items():
            setattr(cls, name, value)
        if variables:
            dataclass(frozen=True, kw_only=True)(cls)

    def __post_init__(self) -> None:
        """Check every field; ParameterError names field, value and allowed range."""
        for name, spec in specs(type(self)):
            check_value(f"{self.group}.{name}", getattr(self, name), spec)


@functools.cache
def specs(group: type[Any]) -> tuple[tuple[str, FieldSpec], ...]:
    """``(field name, FieldSpec)`` of each field that is a `parameter`, in declaration order."""
    found = ((field.name, field.metadata.get(_META)) for field in dataclasses.fields(group))
    return tuple((name, spec) for name, spec in found if spec)


def check_value(name: str, value: object, spec: FieldSpec) -> float:
    """``value`` as a float in a range; ParameterError with ``name``, value and range, if not."""
    number = math.nan
    if not isinstance(value, bool) and isinstance(value, Real):
        with contextlib.suppress(OverflowError):  # an integer beyond every float
            number = float(value)
    if not math.isfinite(number):
        raise ParameterError(
            f"{name} = {value!r} is not a finite number; give one in {spec.range_text()}"
        )
    if number < spec.low or number > spec.high or (spec.low_open and number == spec.low):
        raise ParameterError(f"{name} = {number:g} is outside {spec.range_text()} ({spec.doc})")
    return number


@dataclass(frozen=True, kw_only=True)
class Sourced:
    """A number as a file states it, with its unit and where it comes from."""

    value: float  # in ``unit``
    unit: str  # as written, such as ``kPa``
    source: str  # paper and table, ``datasheet``, ``identified`` or ``assumed``, with detail
    where: str  # file and key, for errors
    # 95 % interval in ``unit``, if the value was identified
    interval95: tuple[float, float] | None = None
    bounds: tuple[float, float] | None = None  # range in ``unit`` that a fit may move the value in
    note: str = ""  # remark for the reader

    def si(self, unit: str) -> float:
        """The value in an SI unit; raises as `pamsim.core.units.to_si`."""
        return to_si(self.value, self.unit, unit, where=self.where)
