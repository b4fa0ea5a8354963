"""Results and checkpoints as JSON files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pamsim.core.bounded_read import read_bounded
from pamsim.core.errors import InputError
from pamsim.core.files import complete_file
from pamsim.core.limits import JSON_BYTES


def write_json(path: Path, result: Mapping[str, Any]) -> None:
    """Write a result, see `pamsim.core.files.complete_file`.

    Args:
        path: of the file; its folder is created.
        result: JSON-safe mapping; NaN and infinity are refused, since JSON has neither.

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
        content = json.loads(read_bounded(path, JSON_BYTES).decode("utf-8"))
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None
    stated = content.get("schema") if isinstance(content, dict) else None
    if stated != schema:
        raise InputError(f"{path}: schema is {stated!r}; this pamsim reads {schema!r}")
    return content


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
            state = json.loads(read_bounded(self.path, JSON_BYTES).decode("utf-8"))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, RecursionError) as error:
            raise InputError(
                f"cannot resume from {self.path}: {error}; remove it to start again"
            ) from None
        if not isinstance(state, dict):
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
