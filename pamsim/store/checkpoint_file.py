"""A state that survives an interruption: one JSON file, replaced whole each time."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pamsim.core.errors import InputError
from pamsim.store.json_file import write_json


@dataclass(frozen=True)
class CheckpointFile:
    """Where a long computation keeps its state.

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
            state = json.loads(self.path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            raise InputError(
                f"cannot resume from {self.path}: {error}; remove it to start anew"
            ) from None
        if not isinstance(state, dict):
            raise InputError(f"{self.path} holds no saved state; remove it to start anew")
        return state

    def save(self, state: dict[str, Any]) -> None:
        """Keep a JSON-safe state.

        Raises:
            InputError: if the place cannot be written.
        """
        write_json(self.path, state)

    def clear(self) -> None:
        """Forget what was saved."""
        self.path.unlink(missing_ok=True)
