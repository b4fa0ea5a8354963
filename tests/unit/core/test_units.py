"""Units and tables at the border: what is read in SI, and the one line for what is not."""

import math

import pytest

import pamsim
from pamsim.core import units
from pamsim.core.digits import p_in_words, significant_digits
from pamsim.core.errors import InputError, ParameterError, SimulationError, nearest
from pamsim.core.parameters import Sourced
from pamsim.core.toml_tables import NUMBER, Entry, check_table, read_toml
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
SLIPS = ["kPaa", "", " ", "bars of chocolate", "2*kPa", "m**m", "None", "k Pa", "°", "kPa;bar"]
SLIPS += ["(", "kPa)", "{", "'", "\\", "@", "1/0"]
# Towers of powers would be computed for ever.
SLIPS += ["m^9^9^9", "10**(1*10**9)", "(10*m)**9", "m^(9*9)", "m^123456"]


def test_a_number_is_converted_by_its_unit():
    for value, unit, si_unit, expected in CONVERSIONS:
        assert to_si(value, unit, si_unit, where="here") == pytest.approx(expected, rel=1e-14)
    for (unit, si_unit), factor in units._USUAL.items():
        # Older versions of pint round a power of ten differently.
        assert factor == pytest.approx(units._converted(1.0, unit, si_unit), rel=1e-15)
        assert units._converted(0.0, unit, si_unit) == 0.0
    number = Sourced(value=250.0, unit="mm", source="Table 1", where="a.toml: braid.length")
    assert number.si("m") == pytest.approx(0.25)
    with refused("a.toml: braid.length", "'mm'"):
        number.si("Pa")


def test_unknown_units_and_wrong_quantities_are_refused_with_their_place():
    for unit in SLIPS:
        with refused("a.toml: supply_pressure", repr(unit), "'Pa'"):
            to_si(1.0, unit, "Pa", where="a.toml: supply_pressure")
    for unit, si_unit in (
        ("N", "Pa"),
        ("mm", "m^3"),
        ("1", "m"),
        ("bar", "1"),
        ("deg", "m"),
        ("Hz", "rad/s"),
    ):
        with refused("a.toml: key", repr(unit), repr(si_unit), "does not measure"):
            to_si(1.0, unit, si_unit, where="a.toml: key")


def test_a_quantity_may_have_a_unit():
    for text, expected in (
        ("487", 487e3),
        ("4.87bar", 487e3),
        (" 4.87 bar ", 487e3),
        ("+.5e1 bar", 5e5),
        ("-3kPa", -3e3),
        ("1E2", 1e5),
        ("0", 0.0),
        ("nan", math.nan),
        ("-inf", -math.inf),
    ):
        found = parse_quantity(text, "kPa", "Pa", where="--p1")
        assert found == pytest.approx(expected, rel=1e-14, nan_ok=True)
    for text in ("", "bar", "4,87", "1 2", "487 kg", "--3", "0x10"):
        with refused("--p1"):
            parse_quantity(text, "kPa", "Pa", where="--p1")
    with refused("--p1: 5002 characters are not a number"):
        parse_quantity("9" * 5000 + "'b", "kPa", "Pa", where="--p1")


def test_what_is_no_toml_is_refused_in_one_line(tmp_path):
    path = tmp_path / "x.toml"
    for content in (
        b"a = " + b"9" * 5000,
        b"a = " + b"[" * 3000,
        b"a = \xff",
        b"a = 1\n\x00",
        b"a = {" * 2000,
        b"a = {b = [1, " + b"9" * 400 + b"]}",
        b'a = "x\\u0000y"',
    ):
        path.write_bytes(content)
        with pytest.raises(InputError, match="not valid TOML") as error:
            read_toml(path)
        assert len(str(error.value)) <= 1000
        assert str(error.value).isprintable()
    path.write_text("a = 1", encoding="utf-8-sig")  # with a byte order mark
    assert read_toml(path) == {"a": 1}
    with refused("no rig"):  # no file can be called so
        pamsim.load_rig("x" * 5000)


def test_an_entry_has_its_kind_and_its_default_or_is_asked_for():
    known = {"a": Entry(NUMBER, "1.2", 1.5), "b": Entry(default="")}
    assert check_table({}, known, "a.toml") == {"a": 1.5, "b": ""}
    assert check_table({"a": 2, "b": ""}, known, "a.toml") == {"a": 2, "b": ""}
    with refused('a.toml needs c = "..."'):
        check_table({}, {**known, "c": Entry()}, "a.toml")
    for value, kind in ((" ", str), (1, str), (True, NUMBER), ("1", NUMBER), (1, bool)):
        with refused(f"a.toml: key = {value!r}; write key = this"):
            check_table({"key": value}, {"key": Entry(kind, "this")}, "a.toml")
    sign = {"sign": Entry(int, "1 or -1", 1, lambda sign: sign in (1, -1))}
    with refused("a.toml: sign = 2; write sign = 1 or -1"):
        check_table({"sign": 2}, sign, "a.toml")
    known = {"file": Entry(), "rig": Entry(default=None)}
    with refused("a.toml: trial 1: unknown key fil; did you mean 'file'"):
        check_table({"fil": 1}, known, "a.toml: trial 1")
    with refused('a.toml: write { file = "..." }, not 3'):
        check_table(3, known, "a.toml")


def test_digits_follow_from_half_an_interval_and_are_three_without_one():
    for interval, digits in (
        ((0.999, 1.001), 5), ((0.5, 1.5), 3), (None, 3), ((1.0, 1.0), 3), ((math.nan, 1.0), 3),
        ((1.0, math.nan), 3), ((-math.inf, 1.0), 3),
    ):  # fmt: skip
        assert significant_digits(1.0, interval) == digits, interval


def test_nearest_suggests_what_is_near_and_lists_all_unless_they_are_many():
    known = ["kPa", "bar", "pressure"]
    for name, near in (("kpa", "kPa"), ("bat", "bar"), ("presure", "pressure")):
        text = nearest(name, known)
        assert text.startswith(f"did you mean {near!r}?")
        assert all(other in text for other in known)
    words, many = ["a.gain", "b_gain", "again"], [f"x{i}" for i in range(30)]
    both = "did you mean 'a.gain' or 'b_gain'? known: a.gain, again, b_gain"
    for name, given, expected in (
        ("zzzz", ["kPa", "bar"], "known: bar, kPa"),
        ("anything", [], "known: none"),
        ("Gain", words, both),
        ("x3", many, "did you mean 'x3'?"),
    ):
        assert nearest(name, given) == expected
    assert nearest("zzzz", many).startswith("known: x0, x1, ")


def test_a_message_is_one_line_that_can_be_printed():
    shown = str(InputError("a\nb \x1b[31m\x00 " + "c" * 5000 + " d" * 5000))
    assert shown.startswith("a b ")
    assert shown.isprintable()
    assert len(shown) <= 1000
    assert str(InputError("x.toml: a = 3 is not known")) == "x.toml: a = 3 is not known"
    assert issubclass(ParameterError, InputError)
    assert not issubclass(SimulationError, InputError)


def test_a_p_value_too_small_to_mean_its_digits_is_a_bound():
    assert p_in_words(0.0132) == "p = 0.013"
    assert p_in_words(1e-4) == "p = 0.0001"
    assert p_in_words(2e-15) == "p < 0.0001"
