"""Results as JSON files: one encoder for every dataclass, one writer, one reader.

A field is written under its own name and in SI, unless its metadata says otherwise::

    @dataclass(frozen=True, kw_only=True)
    class StepRow:
        name: str
        error: float = field(metadata=json_key("error_deg", DEG_PER_RAD))
        pressure: tuple[float, ...] = field(metadata=json_key("pressure_kpa", 1 / PA_PER_KPA))
        status: Status
        scores: Scores = field(metadata=INLINE)
        curve: NDArray[np.float64] = field(metadata=NOT_IN_JSON)

        @json_property
        def sentence(self) -> str:
            return f"{self.name}: {self.status}"

    >>> to_dict(row)
    {'name': 'large', 'error_deg': 0.5, 'pressure_kpa': [487.0, 13.0], 'status': 'converged',
     'rms': None, 'sentence': 'large: converged'}

``rms`` is the only field of ``scores``, which was NaN. A class whose JSON has another shape than
its fields defines a method ``to_dict()``; it may return anything that the function `to_dict`
takes::

    def to_dict(self) -> dict[str, Any]:
        return to_dict({"schema": SCHEMA, **fields_to_dict(self), "rows": self.rows})
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
from pamsim.core.files import complete_file, read_bounded
from pamsim.core.limits import JSON_BYTES

_META = "pamsim.json"

NOT_IN_JSON: Mapping[str, Any] = {_META: None}
"""Metadata of a field that is not written."""
INLINE: Mapping[str, Any] = {_META: ("", 1.0)}
"""Metadata of a field whose own entries are written in place of it."""


def json_key(key: str, scale: float = 1.0) -> Mapping[str, Any]:
    """Metadata of a field that is written under another key, in another unit.

    Args:
        key: in the file, with the unit, such as ``error_deg``.
        scale: written unit per SI unit, such as ``DEG_PER_RAD``; applies to every number in the
            field: a float, a sequence, an array, the values of a mapping.
    """
    return {_META: (key, scale)}


class json_property(property):
    """A property that `fields_to_dict` writes, under its own name, after the fields."""


def to_dict(value: Any) -> Any:
    """Return a value in the types that JSON has.

    Args:
        value: None, bool, number, text, path, enum member, complex number (written as
            ``[real, imaginary]``), numpy scalar or array, mapping, tuple, list, set, dataclass, or
            an object with a method ``to_dict()``; nested to any depth.

    Returns:
        The same with dicts, lists, text, finite numbers, booleans and None only; NaN and infinity
        become None.

    Raises:
        TypeError: for any other type.
    """
    return _scaled(value, 1.0)


def fields_to_dict(value: Any) -> dict[str, Any]:
    """Return the fields and JSON properties of a dataclass as `to_dict` writes them.

    Args:
        value: instance of a dataclass; its own method ``to_dict()`` is not called.

    Raises:
        TypeError: a field holds what JSON cannot.
    """
    result: dict[str, Any] = {}
    for field in fields(value):
        place = field.metadata.get(_META, (field.name, 1.0))
        if place is None:
            continue
        key, scale = place
        content = _scaled(getattr(value, field.name), scale)
        result |= {key: content} if key else content
    for name in _json_properties(value):
        result[name] = to_dict(getattr(value, name))
    return result


def _scaled(value: Any, scale: float) -> Any:
    match value:
        case enum.Enum():
            return _scaled(value.value, scale)
        case None | bool() | str():
            return value
        case np.generic() | np.ndarray():
            return _scaled(value.tolist(), scale)
        case int() if scale == 1.0:
            return value
        case int() | float():
            return value * scale if math.isfinite(value) else None
        case complex():
            return [_scaled(value.real, scale), _scaled(value.imag, scale)]
        case Path():
            return str(value)
        case Mapping():
            entries = cast("Mapping[Any, Any]", value).items()
            return {_key(key): _scaled(entry, scale) for key, entry in entries}
        case _ if hasattr(value, "to_dict"):
            return _scaled(value.to_dict(), scale)
        case _ if is_dataclass(value) and not isinstance(value, type):
            return _scaled(fields_to_dict(value), scale)
        case Collection():
            return [_scaled(entry, scale) for entry in cast("Collection[Any]", value)]
        case _:
            raise TypeError(f"{type(value).__name__} cannot be written as JSON: {value!r}")


def _key(key: Any) -> str:
    return str(key.value if isinstance(key, enum.Enum) else key)


def _json_properties(value: Any) -> list[str]:
    """Names of the JSON properties of an object, those of its class's bases first."""
    return [
        name
        for base in reversed(type(value).__mro__)
        for name, member in vars(base).items()
        if isinstance(member, json_property)
    ]


def write_json(path: Path, result: Mapping[str, Any]) -> None:
    """Write a result, see `pamsim.core.files.complete_file`.

    Args:
        path: of the file; its folder is created.
        result: JSON-safe mapping, numbers in SI or with the unit in the key; NaN and infinity are
            refused, since JSON has neither.

    Raises:
        InputError: if the place cannot be written.
    """
    text = json.dumps(result, indent=1, allow_nan=False)
    with complete_file(path) as part:
        part.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path, schema: str) -> dict[str, Any]:
    """Read a result that `write_json` wrote.

    Args:
        path: of the file.
        schema: that it must state.

    Raises:
        InputError: if it cannot be read, is not JSON, or states another schema.
    """
    try:
        content = _content(path)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None
    stated = content.get("schema") if content is not None else None
    if content is None or stated != schema:
        raise InputError(f"{path}: schema is {stated!r}; this pamsim reads {schema!r}")
    return content


def _content(path: Path) -> dict[str, Any] | None:
    """What is in a JSON file; None if it is no mapping."""
    content: Any = json.loads(read_bounded(path, JSON_BYTES).decode("utf-8"))
    return cast("dict[str, Any]", content) if isinstance(content, dict) else None


@dataclass(frozen=True)
class CheckpointFile:
    """The state of a long computation, one JSON file that each save replaces.

    Attributes:
        path: of the JSON file.
    """

    path: Path

    def load(self) -> dict[str, Any] | None:
        """The state last saved, or None if there is none.

        Raises:
            InputError: if the file cannot be read as one.
        """
        try:
            state = _content(self.path)
        except FileNotFoundError:
            return None
        except (OSError, ValueError, RecursionError) as error:
            raise InputError(
                f"cannot resume from {self.path}: {error}; remove it to start again"
            ) from None
        if state is None:
            raise InputError(f"{self.path} holds no saved state; remove it to start again")
        return state

    def save(self, state: dict[str, Any]) -> None:
        """Save a JSON-safe state.

        Raises:
            InputError: if the place cannot be written.
        """
        write_json(self.path, state)

    def clear(self) -> None:
        """Delete the saved state."""
        self.path.unlink(missing_ok=True)
