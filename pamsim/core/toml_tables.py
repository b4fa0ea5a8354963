"""Read a TOML file that anyone may have written, and check its tables by what they may hold."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Any, cast

from pamsim.core.errors import InputError, refuse_unknown
from pamsim.core.files import read_document
from pamsim.core.limits import TOML_BYTES

_LARGEST = 2**63  # of a whole number

NUMBER = int | float
"""What a number in a TOML file may be; `check_table` takes no ``true`` for one."""


@dataclass(frozen=True)
class Entry:
    """What an entry of a table may be."""

    kind: type | UnionType = str  # its type; text must not be blank, unless the default is
    write: str = '"..."'  # what to write instead of another, for errors
    default: Any = ...  # value of one that is left out; ``...`` if it must be there
    holds: Callable[[Any], bool] = lambda _: True  # what must be true of it beside its type

    def accepts(self, value: object) -> bool:
        """Whether a value may stand there."""
        blank = isinstance(value, str) and not value.strip() and value != self.default
        if isinstance(value, bool) and self.kind is not bool:
            return False
        return isinstance(value, self.kind) and not blank and self.holds(value)


def read_toml(path: Path, *schemas: str) -> dict[str, Any]:
    """The table of a TOML file; raises as `pamsim.core.files.read_document`."""
    return read_document(path, TOML_BYTES, _loads, "TOML", schemas)


def _loads(text: str) -> dict[str, Any]:
    """As `tomllib.loads`, without what no file name and no computer's number can be."""
    if "\\u0000" in text or "\\U00000000" in text:
        raise ValueError("a text holds the character NUL")
    table = tomllib.loads(text)
    open_values: list[Any] = [table]
    while open_values:
        value = open_values.pop()
        if isinstance(value, dict):
            open_values.extend(cast("dict[str, Any]", value).values())
        elif isinstance(value, list):
            open_values.extend(cast("list[Any]", value))
        elif isinstance(value, int) and abs(value) > _LARGEST:
            raise ValueError(f"a whole number of {len(str(value))} digits")
    return table


def check_table(table: object, entries: Mapping[str, Entry], where: object) -> dict[str, Any]:
    """Every entry that a table may have, its default where it is left out.

    Raises:
        InputError: naming file and place ``where`` and what to write: for what is no table, an
            unknown key with the nearest known one, an entry that is missing or of another kind.
    """
    if not isinstance(table, Mapping):
        needed = (f"{k} = {one.write}" for k, one in entries.items() if one.default is ...)
        raise InputError(f"{where}: write {{ {', '.join(needed)} }}, not {table!r}")
    stated = cast("Mapping[str, Any]", table)
    for key in stated:
        refuse_unknown(key, entries, f"{where}: unknown key {key}")
    for key, one in entries.items():
        if key not in stated and one.default is ...:
            raise InputError(f"{where} needs {key} = {one.write}")
        if key in stated and not one.accepts(stated[key]):
            raise InputError(f"{where}: {key} = {stated[key]!r}; write {key} = {one.write}")
    return {key: stated.get(key, one.default) for key, one in entries.items()}
