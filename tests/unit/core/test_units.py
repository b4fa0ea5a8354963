"""Units at the border."""

from __future__ import annotations

import math

import pytest

from pamsim.core import units
from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, PA_PER_KPA, parse_quantity, to_si
from tests.unit.core.refusals import refused

CONVERSIONS = [
    (4.87, "bar", "Pa", 4.87e5),
    (487.0, "kPa", "Pa", 4.87e5),
    (0.6, "MPa", "Pa", 6e5),
    (180.0, "deg", "rad", math.pi),
    (250.0, "mm", "m", 0.25),
    (2.0, "cm", "m", 0.02),
    (10.0, "cm^3", "m^3", 1e-5),
    (20.0, "degC", "K", 293.15),
    (1.0, "dm^3/(s*bar)", "m^3/(s*Pa)", 1e-8),
    (294.0, "N/bar", "N/Pa", 294e-5),
    (100.0, "kPa/V", "Pa/V", 1e5),
    (20.0, "ms", "s", 0.02),
    (3.0, "g", "kg", 0.003),
    (25.0, "percent", "1", 0.25),
    (0.3, "1", "1", 0.3),
    (2.5, "N*m*s/rad", "N*m*s/rad", 2.5),
    (2.0, "kg*m^2/s^2", "J", 2.0),
    (1.0, "kPa", "Pa", PA_PER_KPA),
    (1.0, "bar", "Pa", PA_PER_BAR),
    (DEG_PER_RAD, "deg", "rad", 1.0),
]


@pytest.mark.parametrize(("value", "unit", "si_unit", "expected"), CONVERSIONS)
def test_conversion(value, unit, si_unit, expected):
    assert to_si(value, unit, si_unit, where="here") == pytest.approx(expected, rel=1e-14)


SLIPS = ["kPaa", "", " ", "bars of chocolate", "2*kPa", "m**m", "None", "k Pa", "°", "kPa;bar"]
SLIPS += ["(", "kPa)", "{", "'", "\\", "@", "1/0"]
# Towers of powers would be computed for ever.
SLIPS += ["m^9^9^9", "10**(1*10**9)", "(10*m)**9", "m^(9*9)", "m^123456"]


@pytest.mark.parametrize("unit", SLIPS)
def test_unknown_unit_is_refused_with_its_place(unit):
    with refused("a.toml: muscle.valve.supply_pressure", repr(unit), "'Pa'"):
        to_si(1.0, unit, "Pa", where="a.toml: muscle.valve.supply_pressure")


def test_wrong_quantity_is_refused_with_its_place():
    for unit, si_unit in (("N", "Pa"), ("mm", "m^3"), ("1", "m"), ("bar", "1"), ("deg", "m")):
        with refused("a.toml: key", repr(unit), repr(si_unit), "does not measure"):
            to_si(1.0, unit, si_unit, where="a.toml: key")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("487", 487e3),
        ("4.87bar", 487e3),
        (" 4.87 bar ", 487e3),
        ("+.5e1 bar", 5e5),
        ("-3kPa", -3e3),
        ("1E2", 1e5),
        ("0", 0.0),
        ("nan", math.nan),
        ("-inf", -math.inf),
    ],
)
def test_quantity_with_or_without_a_unit(text, expected):
    found = parse_quantity(text, "kPa", "Pa", where="--p1")
    assert found == pytest.approx(expected, rel=1e-14, nan_ok=True)


def test_what_is_no_quantity_is_refused():
    for text in ("", "bar", "4,87", "1 2", "487 kg", "--3", "0x10"):
        with refused("--p1"):
            parse_quantity(text, "kPa", "Pa", where="--p1")
    with refused("--p1: 5002 characters are not a number"):
        parse_quantity("9" * 5000 + "'b", "kPa", "Pa", where="--p1")


def test_usual_units_are_those_of_pint():
    for (unit, si_unit), factor in units._USUAL.items():
        # Older versions of pint round a power of ten differently.
        assert factor == pytest.approx(units._converted(1.0, unit, si_unit), rel=1e-15)
        assert units._converted(0.0, unit, si_unit) == 0.0
