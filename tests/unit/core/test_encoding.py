"""Results on disk: keys, units, nesting, what JSON cannot hold; whole or not at all."""

from __future__ import annotations

import enum
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from pamsim.core.encoding import (
    INLINE,
    NOT_IN_JSON,
    CheckpointFile,
    fields_to_dict,
    json_key,
    json_property,
    read_json,
    to_dict,
    write_json,
)
from tests.unit.core.refusals import all_refused, refused


class Status(enum.StrEnum):
    CONVERGED = "converged"


@dataclass(frozen=True)
class Scores:
    rms: float


@dataclass(frozen=True, kw_only=True)
class StepRow:
    name: str
    error: float = field(metadata=json_key("error_rad"))
    status: Status
    scores: Scores = field(metadata=INLINE)
    curve: Any = field(metadata=NOT_IN_JSON)

    @json_property
    def sentence(self) -> str:
        return f"{self.name}: {self.status}"


@dataclass(frozen=True, kw_only=True)
class Derived(StepRow):
    @json_property
    def second(self) -> int:
        return 2


@dataclass
class Report:
    rows: tuple[StepRow, ...]
    rms: float

    def to_dict(self) -> dict[str, Any]:
        return to_dict({"schema": "report/1", **fields_to_dict(self), "path": Path("x")})


ROW = StepRow(
    name="large",
    error=0.5,
    status=Status.CONVERGED,
    scores=Scores(float("nan")),
    curve=object(),
)


def test_a_dataclass_is_written_as_its_metadata_and_its_own_method_say():
    expected = {
        "name": "large",
        "error_rad": 0.5,
        "status": "converged",
        "rms": None,
        "sentence": "large: converged",
    }
    assert to_dict(ROW) == expected
    assert list(to_dict(Derived(**vars(ROW))).items()) == [*to_dict(ROW).items(), ("second", 2)]
    written = {"schema": "report/1", "rows": [to_dict(ROW)], "rms": None, "path": "x"}
    assert to_dict({"report": Report((ROW,), float("nan"))})["report"] == written


def test_values_become_the_types_that_json_has():
    for value, written in (
        (None, None),
        (True, True),
        (np.bool_(True), True),
        (np.int64(3), 3),
        (np.float32(0.5), 0.5),
        (float("inf"), None),
        (np.float64("-inf"), None),
        (np.array([[1.0, np.nan]]), [[1.0, None]]),
        (np.array(2.0), 2.0),
        (1.0 - 2.0j, [1.0, -2.0]),
        (Path("a") / "b", "a/b"),
        (Status.CONVERGED, "converged"),
        ({Status.CONVERGED: (1, 2), 3: {4}}, {"converged": [1, 2], "3": [4]}),
        (MappingProxyType({"a": np.zeros(1)}), {"a": [0.0]}),
        ([Scores(1.0)], [{"rms": 1.0}]),
    ):
        encoded = to_dict(value)
        assert encoded == written
        assert type(encoded) is type(written)
        json.dumps(encoded, allow_nan=False)
    for value in (object(), Scores, {"a": object()}, lambda: 0):
        with pytest.raises(TypeError, match="cannot be written as JSON"):
            to_dict(value)


SCHEMA = "pamsim-test/1"
RESULT = {"schema": SCHEMA, "name": "β", "values": [0.1, -1e-300, 2**53], "none": None, "ok": True}


def test_what_is_written_is_read_back_and_what_json_cannot_hold_leaves_the_old_file(tmp_path):
    path = tmp_path / "new" / "folder" / "r.json"
    write_json(path, {"schema": SCHEMA})
    assert read_json(path, SCHEMA) == {"schema": SCHEMA}
    write_json(path, RESULT)
    assert path.read_text(encoding="utf-8").endswith("}\n")
    for value in (math.nan, math.inf, object()):
        with pytest.raises((ValueError, TypeError)):
            write_json(path, {"schema": SCHEMA, "value": value})
        assert read_json(path, SCHEMA) == RESULT
    assert [file.name for file in path.parent.iterdir()] == ["r.json"]
    bad = {
        "empty": (b"", "not valid JSON"),
        "cut off": (b'{"schema": "pamsim-test/1", "na', "not valid JSON"),
        "not text": (b"\xff\xfe\x00", "not valid JSON"),
        "too deep": (b"[" * 100_000, "not valid JSON"),
        "later version": (b'{"schema": "pamsim-test/2"}', "'pamsim-test/2'"),
        "no schema": (b"{}", "None"),
        "a list": (b'["schema"]', "not ['schema']"),
    }
    all_refused(bad, lambda b: [path.write_bytes(b), read_json(path, SCHEMA)], str(path))
    for missing in (tmp_path / "none.json", tmp_path):
        with refused("cannot read", str(missing)):
            read_json(missing, SCHEMA)


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
