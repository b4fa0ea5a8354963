"""Write results as JSON, whole or not at all."""

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
