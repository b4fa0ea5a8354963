"""Read a shipped printed table as the text it was printed in: digits are kept."""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any


@dataclass(frozen=True)
class Printed:
    """A number with the digits it was printed with.

    Attributes:
        value: the number.
        half_unit: half a unit of its last printed digit.
    """

    value: float
    half_unit: float

    @classmethod
    def read(cls, text: str) -> Printed:
        """Read a decimal number such as ``-0.0083212``."""
        return cls(float(text), 0.5 * 10.0 ** -len(text.partition(".")[2]))


def printed_table(name: str) -> list[dict[str, str]]:
    """Rows of a shipped CSV file, column -> text; lines that start with ``#`` are left out."""
    lines = _text(name).splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def printed_document(name: str) -> Mapping[str, Any]:
    """A shipped TOML file."""
    return tomllib.loads(_text(name))


def _text(name: str) -> str:
    return (resources.files("pamsim") / "data" / name).read_text(encoding="utf-8")
