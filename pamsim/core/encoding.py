"""Results as JSON files: one encoder for every dataclass, one writer, one reader.

A field is written under its own name, unless its metadata says otherwise::

    @dataclass(frozen=True, kw_only=True)
    class StepRow:
        name: str
        error: float = field(metadata=json_key("error_deg"))
        scores: Scores = field(metadata=INLINE)
        curve: NDArray[np.float64] = field(metadata=NOT_IN_JSON)

        @json_property
        def sentence(self) -> str:
            return f"{self.name}: {self.error:g}"

    >>> to_dict(row)
    {'name': 'large', 'error_deg': 0.5, 'rms': None, 'sentence': 'large: 0.5'}

``rms`` is the only field of ``scores``, which was NaN. A class whose JSON has another shape than
its fields defines a method ``to_dict()`` that returns anything the function `to_dict` takes, such
as ``{"schema": SCHEMA, **fields_to_dict(self)}``.
"""

from __future__ import annotations

import enum
import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.files import complete_file, read_document
from pamsim.core.limits import JSON_BYTES

_META = "pamsim.json"

NOT_IN_JSON: Mapping[str, Any] = {_META: None}
"""Metadata of a field that is not written."""
INLINE: Mapping[str, Any] = {_META: ""}
"""Metadata of a field whose own entries are written in place of it."""


def json_key(key: str) -> Mapping[str, Any]:
    """Metadata of a field that is written under another key, such as ``error_deg``."""
    return {_META: key}


class json_property(property):
    """A property that `fields_to_dict` writes, under its own name, after the fields."""


def to_dict(value: Any) -> Any:
    """A value in dicts, lists, text, finite numbers, booleans and None only.

    It is None, bool, number, text, path, enum member, complex number (written as ``[real,
    imaginary]``), numpy scalar or array, mapping, tuple, list, set, dataclass, or an object with a
    method ``to_dict()``; nested to any depth. NaN and infinity become None.

    Raises:
        TypeError: for any other type.
    """
    match value:
        case enum.Enum():
            return to_dict(value.value)
        case np.generic() | np.ndarray():
            return to_dict(value.tolist())
        case None | bool() | str() | int():
            return value
        case float():
            return value if math.isfinite(value) else None
        case complex():
            return to_dict([value.real, value.imag])
        case Path():
            return str(value)
        case Mapping():
            entries = cast("Mapping[Any, Any]", value).items()
            return {
                str(key.value if isinstance(key, enum.Enum) else key): to_dict(entry)
                for key, entry in entries
            }
        case _ if hasattr(value, "to_dict"):
            return to_dict(value.to_dict())
        case _ if is_dataclass(value) and not isinstance(value, type):
            return to_dict(fields_to_dict(value))
        case Collection():
            return [to_dict(entry) for entry in cast("Collection[Any]", value)]
        case _:
            raise TypeError(f"{type(value).__name__} cannot be written as JSON: {value!r}")


def fields_to_dict(value: Any) -> dict[str, Any]:
    """Fields and JSON properties of a dataclass, but for a method ``to_dict()`` as `to_dict`."""
    result: dict[str, Any] = {}
    for field in fields(value):
        key = field.metadata.get(_META, field.name)
        if key is not None:
            content = to_dict(getattr(value, field.name))
            result |= {key: content} if key else content
    for base in reversed(type(value).__mro__):
        for name, member in vars(base).items():
            if isinstance(member, json_property):
                result[name] = to_dict(getattr(value, name))
    return result


def write_json(path: Path, result: Mapping[str, Any]) -> None:
    """Write a result without NaN, in SI or with units in keys; InputError if it cannot be."""
    text = json.dumps(result, indent=1, allow_nan=False)
    with complete_file(path) as part:
        part.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path, schema: str) -> dict[str, Any]:
    """Read a result that `write_json` wrote and that states a schema.

    Raises:
        InputError: if it cannot be read, is not JSON, or states another schema.
    """
    try:
        return read_document(path, JSON_BYTES, json.loads, "JSON", [schema])
    except FileNotFoundError:
        raise InputError(f"cannot read {path}: there is no such file") from None


@dataclass(frozen=True)
class CheckpointFile:
    """The state of a long computation, one JSON file that each save replaces."""

    path: Path

    def load(self) -> dict[str, Any] | None:
        """The state last saved, None if there is none; InputError if it cannot be read."""
        try:
            return read_document(self.path, JSON_BYTES, json.loads, "JSON")
        except FileNotFoundError:
            return None
        except InputError as error:
            raise InputError(f"cannot resume: {error}; remove it to start again") from None

    def save(self, state: dict[str, Any]) -> None:
        """Save a JSON-safe state; raises as `write_json`."""
        write_json(self.path, state)

    def clear(self) -> None:
        """Delete the saved state."""
        self.path.unlink(missing_ok=True)
