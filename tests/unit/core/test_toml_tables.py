"""Whatever a TOML file holds, the answer is a table or one line."""

from __future__ import annotations

import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.core.toml_tables import NUMBER, check_keys, entry, read_toml
from tests.unit.core.refusals import refused


@pytest.mark.parametrize(
    "content",
    [
        b"a = " + b"9" * 5000,
        b"a = " + b"[" * 3000,
        b"a = \xff",
        b"a = 1\n\x00",
        b"a = {" * 2000,
    ],
    ids=["digits", "nesting", "no UTF-8", "NUL", "tables"],
)
def test_what_is_no_table_is_refused_in_one_line(tmp_path, content):
    (tmp_path / "x.toml").write_bytes(content)
    with pytest.raises(InputError, match="not valid TOML") as error:
        read_toml(tmp_path / "x.toml")
    assert len(str(error.value)) <= 1000
    assert str(error.value).isprintable()


def test_a_byte_order_mark_is_left_out(tmp_path):
    (tmp_path / "x.toml").write_text("a = 1", encoding="utf-8-sig")
    assert read_toml(tmp_path / "x.toml") == {"a": 1}


def test_a_name_that_no_file_can_have_is_no_rig():
    with refused("no rig"):
        pamsim.load_rig("x" * 5000)


@pytest.mark.parametrize(
    ("value", "kind"),
    [(None, str), (" ", str), (1, str), (True, NUMBER), ("1", NUMBER)],
)
def test_an_entry_of_another_kind_is_refused_in_the_words_of_the_reader(value, kind):
    table = {} if value is None else {"key": value}
    with refused(f"a.toml: key is {value!r}, not this"):
        entry(table, "key", kind, "a.toml: key is {!r}, not this")


def test_an_entry_that_is_left_out_has_its_default():
    assert entry({}, "key", NUMBER, "", 1.5) == 1.5
    assert entry({"key": ""}, "key", str, "", "") == ""


def test_a_key_that_means_nothing_is_refused_with_the_nearest():
    assert check_keys({"file": 1}, ("file", "rig"), "a.toml") == {"file": 1}
    with refused("a.toml: unknown key trial.fil; did you mean 'file'"):
        check_keys({"fil": 1}, ("file", "rig"), "a.toml", "trial.")
