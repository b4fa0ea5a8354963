"""Read a TOML file that anyone may have written, and check its tables entry by entry."""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from types import UnionType
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.core.files import read_document
from pamsim.core.limits import TOML_BYTES

NUMBER = int | float
"""What a number in a TOML file may be; `entry` takes no ``true`` for one."""


def read_toml(path: Path) -> dict[str, Any]:
    """The table of a TOML file; raises as `pamsim.core.files.read_document`."""
    return read_document(path, TOML_BYTES, tomllib.loads, "TOML")


def check_keys(
    table: Mapping[str, Any], known: Collection[str], where: object, under: str = ""
) -> Mapping[str, Any]:
    """The table, if all its keys are known.

    Raises:
        InputError: naming the file and place ``where``, the key with what it is ``under``, such as
            ``rig.``, and the nearest known one.
    """
    for key in table:
        if key not in known:
            raise InputError(f"{where}: unknown key {under}{key}; {nearest(key, known)}")
    return table


def entry(
    table: object, key: str, kind: type | UnionType, wanted: str, default: object = None
) -> Any:
    """An entry of a table, if it is of a kind; what is no table has no entries.

    The ``default`` of an entry that is left out is checked like one that is not.

    Raises:
        InputError: if it is missing, blank or of another kind, with the text ``wanted``: the place
            and what to write; ``{!r}`` in it stands for what is there.
    """
    content: Any = table
    value = content.get(key, default) if isinstance(table, Mapping) else None
    blank = isinstance(value, str) and not value.strip() and value != default
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool) or blank:
        raise InputError(wanted.replace("{!r}", repr(value)))
    return value
