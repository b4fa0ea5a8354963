"""Results as JSON: written whole or not at all, read back by their schema."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pamsim.core.errors import InputError


def write_json(path: Path, result: Mapping[str, Any]) -> None:
    """Write a result, creating its folder; a file that is there is replaced in one move.

    Args:
        path: of the file.
        result: JSON-safe mapping; NaN and infinity are refused, since JSON has neither.

    Raises:
        InputError: if the place cannot be written.
    """
    text = json.dumps(result, indent=1, allow_nan=False)
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text + "\n", encoding="utf-8")
        os.replace(part, path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None


def read_json(path: Path, schema: str) -> dict[str, Any]:
    """Read a result that `write_json` wrote.

    Args:
        path: of the file.
        schema: that it must state.

    Raises:
        InputError: if it cannot be read, is not JSON, or states another schema.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None
    stated = found.get("schema") if isinstance(found, dict) else None
    if stated != schema:
        raise InputError(f"{path}: schema is {stated!r}; this pamsim reads {schema!r}")
    return found
