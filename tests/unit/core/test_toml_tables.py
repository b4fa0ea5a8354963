"""Whatever a TOML file holds, the answer is a table or one line."""

from __future__ import annotations

import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.core.toml_tables import NUMBER, Entry, check_table, read_toml
from tests.unit.core.refusals import refused


@pytest.mark.parametrize(
    "content",
    [
        b"a = " + b"9" * 5000,
        b"a = " + b"[" * 3000,
        b"a = \xff",
        b"a = 1\n\x00",
        b"a = {" * 2000,
        b"a = {b = [1, " + b"9" * 400 + b"]}",
        b'a = "x\\u0000y"',
    ],
    ids=["digits", "nesting", "no UTF-8", "NUL", "tables", "number", "NUL in a text"],
)
def test_what_is_no_table_is_refused_in_one_line(tmp_path, content):
    (tmp_path / "x.toml").write_bytes(content)
    with pytest.raises(InputError, match="not valid TOML") as error:
        read_toml(tmp_path / "x.toml")
    assert len(str(error.value)) <= 1000
    assert str(error.value).isprintable()


def test_a_byte_order_mark_is_left_out_and_a_name_that_no_file_can_have_is_no_rig(tmp_path):
    (tmp_path / "x.toml").write_text("a = 1", encoding="utf-8-sig")
    assert read_toml(tmp_path / "x.toml") == {"a": 1}
    with refused("no rig"):
        pamsim.load_rig("x" * 5000)


@pytest.mark.parametrize(
    ("value", "kind"), [(" ", str), (1, str), (True, NUMBER), ("1", NUMBER), (1, bool)]
)
def test_an_entry_of_another_kind_is_refused_with_what_to_write(value, kind):
    with refused(f"a.toml: key = {value!r}; write key = this"):
        check_table({"key": value}, {"key": Entry(kind, "this")}, "a.toml")


def test_an_entry_has_its_default_or_is_asked_for_and_must_hold_what_is_asked_of_it():
    known = {"a": Entry(NUMBER, "1.2", 1.5), "b": Entry(default="")}
    assert check_table({}, known, "a.toml") == {"a": 1.5, "b": ""}
    assert check_table({"a": 2, "b": ""}, known, "a.toml") == {"a": 2, "b": ""}
    with refused('a.toml needs c = "..."'):
        check_table({}, {**known, "c": Entry()}, "a.toml")

    sign = {"sign": Entry(int, "1 or -1", 1, lambda sign: sign in (1, -1))}
    with refused("a.toml: sign = 2; write sign = 1 or -1"):
        check_table({"sign": 2}, sign, "a.toml")


def test_a_key_that_means_nothing_and_what_is_no_table_are_refused():
    known = {"file": Entry(), "rig": Entry(default=None)}
    with refused("a.toml: trial 1: unknown key fil; did you mean 'file'"):
        check_table({"fil": 1}, known, "a.toml: trial 1")
    with refused('a.toml: write { file = "..." }, not 3'):
        check_table(3, known, "a.toml")
