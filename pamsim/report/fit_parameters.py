"""Write the fitted numbers as sections that paste into a rig's ``params.toml``."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pamsim.core.errors import InputError


def write_fit_parameters(result: Mapping[str, Any], folder: Path) -> Path:
    """Write ``params.toml`` of a fit into a folder.

    Returns:
        The path written.

    Raises:
        InputError: if the place cannot be written.
    """
    path = folder / "params.toml"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(parameter_text(result), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    return path


def parameter_text(result: Mapping[str, Any]) -> str:
    """The sections of a fit result as TOML.

    Args:
        result: of `pamsim.fitting.fit`, with ``section``: section -> key -> word or number.

    Returns:
        Text with value, unit, source and 95 % interval of each number [SI].
    """
    best = result["fits"][0]
    scores = best["scores"]
    lines = [
        f"# {best['model']} fitted to {Path(result['file']).name}: {scores['points']} points,"
        f" {scores['rmse']:.4g} {best['unit']} RMS. Paste the sections into a rig's params.toml."
    ]
    for name, entries in result["section"].items():
        lines += ["", f"[{name}]"]
        lines += [f"{key} = {_value(entry)}" for key, entry in entries.items()]
    return "\n".join(lines) + "\n"


def _value(entry: Any) -> str:
    """A TOML value; texts and floats are written the same in JSON and TOML."""
    if isinstance(entry, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(value)}" for key, value in entry.items()) + " }"
    return json.dumps(entry, ensure_ascii=False, allow_nan=False)
