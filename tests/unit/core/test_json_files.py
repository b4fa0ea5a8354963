"""Results and checkpoints on disk: whole or not at all, and only what states the schema is read."""

from __future__ import annotations

import math

import pytest

from pamsim.core.encoding import CheckpointFile, read_json, write_json
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
        }
    ),
)
def test_another_file_is_refused(tmp_path, content, words):
    path = tmp_path / "r.json"
    path.write_bytes(content)
    with refused(str(path), words):
        read_json(path, SCHEMA)


def test_a_missing_file_is_said(tmp_path):
    for path in (tmp_path / "none.json", tmp_path):
        with refused("cannot read", str(path)):
            read_json(path, SCHEMA)


def test_what_was_saved_is_loaded_until_it_is_cleared_or_spoilt(tmp_path):
    file = CheckpointFile(tmp_path / "deep" / "checkpoint.json")
    assert file.load() is None
    for state in ({"a": [1.0, 0.1 + 0.2]}, {"b": None}):
        file.save(state)
        assert file.load() == state
    file.clear()
    file.clear()
    assert file.load() is None
    file.path.write_text("{", encoding="utf-8")
    with refused("checkpoint.json", "remove it to start again"):
        file.load()
