"""Results and checkpoints on disk: whole or not at all, and only what states the schema is read."""

from __future__ import annotations

import json
import math

import pytest

from pamsim.core import files
from pamsim.core.encoding import CheckpointFile, read_json, write_json
from pamsim.core.errors import InputError
from tests.unit.core.refusals import cases, refused

SCHEMA = "pamsim-test/1"
RESULT = {"schema": SCHEMA, "name": "β", "values": [0.1, -1e-300, 2**53], "none": None, "ok": True}


def test_what_is_written_is_read_back(tmp_path):
    path = tmp_path / "new" / "folder" / "r.json"
    write_json(path, RESULT)
    assert read_json(path, SCHEMA) == RESULT
    assert path.read_text(encoding="utf-8").endswith("}\n")
    write_json(path, {"schema": SCHEMA})
    assert read_json(path, SCHEMA) == {"schema": SCHEMA}
    assert [file.name for file in path.parent.iterdir()] == ["r.json"]


@pytest.mark.parametrize("value", [math.nan, math.inf, object()])
def test_what_json_cannot_hold_leaves_the_old_file(tmp_path, value):
    path = tmp_path / "r.json"
    write_json(path, RESULT)
    with pytest.raises((ValueError, TypeError)):
        write_json(path, {"schema": SCHEMA, "value": value})
    assert read_json(path, SCHEMA) == RESULT


def test_an_interrupted_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "r.json"
    write_json(path, RESULT)

    def fail(source, target):
        assert json.loads(source.read_text(encoding="utf-8")) == {"schema": SCHEMA}  # whole by now
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "replace", fail)
    with refused(str(path), "No space left on device"):
        write_json(path, {"schema": SCHEMA})
    assert read_json(path, SCHEMA) == RESULT


def test_a_place_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    with refused("cannot write", "file"):
        write_json(tmp_path / "file" / "r.json", RESULT)
    (tmp_path / "folder").mkdir()
    with refused("cannot write", "folder"):
        write_json(tmp_path / "folder", RESULT)


@pytest.mark.parametrize(
    ("content", "words"),
    cases(
        {
            "empty": (b"", "not valid JSON"),
            "cut off": (b'{"schema": "pamsim-test/1", "na', "not valid JSON"),
            "not text": (b"\xff\xfe\x00", "not valid JSON"),
            "too deep": (b"[" * 100_000, "not valid JSON"),
            "later version": (b'{"schema": "pamsim-test/2"}', "'pamsim-test/2'"),
            "no schema": (b"{}", "None"),
            "a list": (b'["schema"]', "not ['schema']"),
            "a number": (b"1", "not 1"),
        }
    ),
)
def test_another_file_is_refused(tmp_path, content, words):
    path = tmp_path / "r.json"
    path.write_bytes(content)
    with refused(str(path), words):
        read_json(path, SCHEMA)


def test_a_missing_file_is_said(tmp_path):
    with refused("cannot read", "none.json"):
        read_json(tmp_path / "none.json", SCHEMA)
    with refused("cannot read", str(tmp_path)):
        read_json(tmp_path, SCHEMA)


def test_what_was_saved_is_loaded_until_it_is_cleared(tmp_path):
    file = CheckpointFile(tmp_path / "deep" / "checkpoint.json")
    assert file.load() is None
    for state in ({"a": [1.0, 0.1 + 0.2]}, {"b": None}):
        file.save(state)
        assert file.load() == state
    file.clear()
    file.clear()
    assert file.load() is None


@pytest.mark.parametrize("text", ["{", "[1]", "", "[" * 100_000])
def test_a_spoilt_file_says_how_to_start_again(tmp_path, text):
    path = tmp_path / "checkpoint.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="remove it to start again"):
        CheckpointFile(path).load()
