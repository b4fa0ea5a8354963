"""What scripts share: their option ``--json``, what begins a record, and how it is written."""

from __future__ import annotations

import argparse
import json
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
from scipy.stats import binomtest

from pamsim.core.encoding import write_json


def parser(
    description: str | None, target: Path | None = None, **options: float | str
) -> argparse.ArgumentParser:
    """A parser with ``--json FILE``, whose help is the docstring of a script.

    Args:
        description: the docstring.
        target: FILE, if it is left out.
        options: further ones -> their values if they are left out, which are of their types.
    """
    raw = argparse.RawDescriptionHelpFormatter
    made = argparse.ArgumentParser(description=description, formatter_class=raw)
    made.add_argument("--json", type=Path, default=target, metavar="FILE")
    for name, default in options.items():
        made.add_argument(f"--{name}", type=type(default), default=default)
    return made


def head(command: str) -> dict[str, Any]:
    """What begins a record: the command that made it, and its versions."""
    return {"command": command, "mujoco": mujoco.__version__, "python": platform.python_version()}


def write(record: Mapping[str, Any], path: Path | None) -> None:
    """Write a record where this is asked for."""
    if path is not None:
        write_json(path, record)


def print_and_write(record: Mapping[str, Any], path: Path | None) -> None:
    """Print a record, and write it where this is asked for."""
    print(json.dumps(record, indent=1))
    write(record, path)


def share(hits: int, count: int) -> dict[str, Any]:
    """A share with its exact 95 % interval (Clopper and Pearson, Biometrika 26, 1934)."""
    ends = binomtest(int(hits), count).proportion_ci() if count else None
    return {
        "hits": int(hits),
        "count": count,
        "share": float(hits / count) if count else None,
        "interval95": [ends.low, ends.high] if ends else None,
    }


def with_rows_on_lines(record: Mapping[str, Any]) -> str:
    """A record as JSON, its ``rows``, which stand last, on a line each."""
    first = json.dumps({key: value for key, value in record.items() if key != "rows"}, indent=1)
    lines = ",\n".join("  " + json.dumps(row) for row in record["rows"])
    return f'{first[:-2]},\n "rows": [\n{lines}\n ]\n}}\n'
