"""Parameter groups: what every declared field owes, and what every bad value gets."""

from __future__ import annotations

import dataclasses
import importlib
import math
import re
from pathlib import Path

import numpy as np
import pint
import pytest

import pamsim
from pamsim.core.errors import ParameterError
from pamsim.core.parameters import FieldSpec, ParameterGroup, check_value, quantity, specs
from pamsim.core.units import to_si
from tests.unit.core.refusals import refused

SOURCE = Path(pamsim.__file__).parent


def parameter_groups() -> dict[str, type[ParameterGroup]]:
    """Every parameter group of the whole package; modules without one are not imported."""
    classes = [  # by their text: to parse every file takes seconds of each start of the tests
        (path, name, set(re.findall(r"\w+(?=[,\s]|$)", bases)))
        for path in sorted(SOURCE.rglob("*.py"))
        for name, bases in re.findall(
            r"^class (\w+)\(([^)]*)\)", path.read_text(encoding="utf-8"), re.MULTILINE
        )
    ]
    names = {ParameterGroup.__name__}
    while more := {name for _, name, bases in classes if bases & names} - names:
        names |= more  # groups of groups as well
    found = {}
    for path, name, bases in classes:
        if bases & names:
            module = ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts)
            found[name] = getattr(importlib.import_module(module), name)
    return found


GROUPS = parameter_groups()
FIELDS = [(group, name, spec) for group in GROUPS for name, spec in specs(GROUPS[group])]
UNITS = pint.UnitRegistry()


def middle(spec: FieldSpec) -> float:
    """A value inside; a whole one where the field may be one that takes whole numbers only."""
    value = 0.5 * (spec.low + spec.high)
    counts = spec.unit == "1" and spec.low >= 1.0 and spec.low % 1.0 == spec.high % 1.0 == 0.0
    return float(round(value)) if counts else value


def with_field(group: str, name: str, value: object) -> ParameterGroup:
    """A group with all fields inside their ranges but perhaps this one."""
    values = {other: middle(spec) for other, spec in specs(GROUPS[group])}
    return GROUPS[group](**(values | {name: value}))


def test_groups_are_frozen_dataclasses_whose_every_number_is_declared():
    assert {"Braid", "Chamber", "ValvePair", "BoucWen", "SixParameter"} <= set(GROUPS)
    names = [(group.group, group.law) for group in GROUPS.values()]
    assert len(set(names)) == len(names)
    for name, group in GROUPS.items():
        assert group.group
        declared = {field for field, _ in specs(group)}
        fields = {field.name for field in dataclasses.fields(group)}
        assert fields == declared != set(), f"{name}: a field without parameter(...) is unchecked"
        made = group(**{field: middle(spec) for field, spec in specs(group)})
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(made, min(fields), 1.0)


def test_a_quantity_is_declared_as_its_range_is_printed():
    class Pipe(ParameterGroup, group="pipe"):
        bore: float = quantity("(0, 1e-2] m", "inner diameter")
        share: float = quantity("[-1, 1]", "share", 0.5)

    bore, share = dict(specs(Pipe)).values()
    assert (bore.range_text(), bore.doc) == ("(0, 0.01] m", "inner diameter")
    assert share.range_text() == "[-1, 1]"
    expected = {"unit": "1", "low": -1.0, "high": 1.0, "low_open": False}
    assert share == FieldSpec(**expected, doc="share", default=0.5)
    assert Pipe.group == "pipe"
    assert Pipe(bore=1e-3) == Pipe(bore=1e-3, share=0.5)
    with refused("pipe.bore = 0 is outside (0, 0.01] m", error=ParameterError):
        Pipe(bore=0.0)
    for value in (3, np.float64(3.0)):
        checked = check_value("length", value, dataclasses.replace(share, high=10.0))
        assert (checked, type(checked)) == (3.0, float)


def test_fields_state_si_unit_range_and_meaning():
    assert len(FIELDS) > 30
    for group, name, spec in FIELDS:
        place = f"{group}.{name}"
        assert np.all(np.isfinite([spec.low, spec.high])), place
        assert spec.low < spec.high, place
        assert spec.default is None or check_value(place, spec.default, spec) == spec.default
        assert spec.doc.strip(), place
        assert to_si(1.0, spec.unit, spec.unit, where=place) == 1.0
        assert UNITS.Quantity(1.0, spec.unit).to_base_units().magnitude == pytest.approx(1.0), place


def test_fields_take_their_range_and_nothing_else():
    no_numbers = (math.nan, math.inf, -math.inf, True, "1", None, [1.0], 1.0 + 0j)
    for group, name, spec in FIELDS:
        beyond = 1e-6 * (spec.high - spec.low)
        good = [middle(spec), spec.high, spec.low + beyond]
        bad = [spec.low - beyond, spec.high + beyond]
        (bad if spec.low_open else good).append(spec.low)
        for value in good:  # not through the group, where a field may also be bound by another
            assert check_value(name, value, spec) == value
        assert getattr(with_field(group, name, middle(spec)), name) == middle(spec)
        place = f"{GROUPS[group].group}.{name}"
        for shown, value in (
            *((f"{value:g}", value) for value in bad),
            *((repr(value), value) for value in no_numbers),
        ):
            with refused(f"{place} = {shown}", spec.range_text(), error=ParameterError):
                with_field(group, name, value)
