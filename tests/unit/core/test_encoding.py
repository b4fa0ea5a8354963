"""The encoder of results: keys, units, nesting, and what JSON cannot hold."""

from __future__ import annotations

import enum
import json
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from pamsim.core.encoding import (
    INLINE,
    NOT_IN_JSON,
    fields_to_dict,
    json_key,
    json_property,
    to_dict,
)
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA


class Status(enum.StrEnum):
    CONVERGED = "converged"


@dataclass(frozen=True)
class Scores:
    rms: float


@dataclass(frozen=True, kw_only=True)
class StepRow:
    name: str
    error: float = field(metadata=json_key("error_deg", DEG_PER_RAD))
    pressure: tuple[float, ...] = field(metadata=json_key("pressure_kpa", 1 / PA_PER_KPA))
    status: Status
    scores: Scores = field(metadata=INLINE)
    curve: Any = field(metadata=NOT_IN_JSON)

    @json_property
    def sentence(self) -> str:
        return f"{self.name}: {self.status}"


ROW = StepRow(
    name="large",
    error=np.radians(0.5),
    pressure=(487e3, 13e3),
    status=Status.CONVERGED,
    scores=Scores(float("nan")),
    curve=object(),
)


def test_a_dataclass_is_written_as_its_metadata_say():
    assert to_dict(ROW) == {
        "name": "large",
        "error_deg": pytest.approx(0.5, rel=1e-15),
        "pressure_kpa": [487.0, 13.0],
        "status": "converged",
        "rms": None,
        "sentence": "large: converged",
    }


@pytest.mark.parametrize(
    ("value", "written"),
    [
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
    ],
)
def test_values_become_the_types_that_json_has(value, written):
    encoded = to_dict(value)
    assert encoded == written
    assert type(encoded) is type(written)
    json.dumps(encoded, allow_nan=False)


@pytest.mark.parametrize(
    ("value", "written"),
    [
        (2, 6.0),
        (None, None),
        (np.array([1.0, np.nan]), [3.0, None]),
        ({"a": (1.0, True)}, {"a": [3.0, True]}),
        (1j, [0.0, 3.0]),
    ],
)
def test_the_scale_applies_to_every_number_of_the_field(value, written):
    @dataclass
    class Scaled:
        value: Any = field(metadata=json_key("times_three", 3.0))

    assert to_dict(Scaled(value)) == {"times_three": written}


def test_a_method_to_dict_replaces_the_fields_and_may_build_on_them():
    @dataclass
    class Report:
        rows: tuple[StepRow, ...]
        rms: float

        def to_dict(self) -> dict[str, Any]:
            return to_dict({"schema": "report/1", **fields_to_dict(self), "path": Path("x")})

    report = Report((ROW,), float("nan"))
    assert to_dict({"report": report})["report"] == report.to_dict()
    assert report.to_dict() == {
        "schema": "report/1",
        "rows": [to_dict(ROW)],
        "rms": None,
        "path": "x",
    }


def test_properties_of_a_base_class_are_written_too():
    @dataclass(frozen=True, kw_only=True)
    class Derived(StepRow):
        @json_property
        def second(self) -> int:
            return 2

    written = to_dict(Derived(**vars(ROW)))
    assert list(written.items()) == [*to_dict(ROW).items(), ("second", 2)]


@pytest.mark.parametrize("value", [object(), Scores, {"a": object()}, lambda: 0])
def test_what_json_cannot_hold_is_an_error_of_the_programmer(value):
    with pytest.raises(TypeError, match="cannot be written as JSON"):
        to_dict(value)
