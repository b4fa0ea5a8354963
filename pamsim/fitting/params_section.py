"""Fitted numbers as sections that paste into a rig's ``params.toml``."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pamsim.inference.estimate import Estimate, Flag

_FLAG_TEXT = {
    Flag.DEAD: "the data do not depend on it",
    Flag.FLAT_DIRECTION: "the data determine only a combination with",
    Flag.AT_BOUND: "at the end of its allowed range, not determined by the data",
    Flag.TRADE_OFF: "trades off with",
    Flag.NOT_PINNED: "95 % interval wider than the value itself",
}
_WITH_PARTNERS = (Flag.TRADE_OFF, Flag.FLAT_DIRECTION)


def coefficient_entries(coefficients: Sequence[Estimate]) -> dict[str, dict[str, Any]]:
    """The coefficients of a fit as entries of ``params.toml`` [SI].

    A held coefficient is ``assumed``, a fitted one ``identified`` with its interval, or with a note
    why there is none.
    """
    entries: dict[str, dict[str, Any]] = {}
    for c in coefficients:
        entry: dict[str, Any] = {"value": c.value, "unit": c.unit}
        entry["source"] = "assumed" if c.held else "identified"
        if c.interval95 is not None:
            entry["interval95"] = list(c.interval95)
        if c.held:
            entry["note"] = "held in the fit"
        elif c.flags:
            entry["note"] = flag_text(c.flags, c.partners)
        entries[c.name] = entry
    return entries


def flag_text(flags: Sequence[Flag], partners: Sequence[str]) -> str:
    """Flags as one line, such as ``trades off with c2``."""
    names = ", ".join(partners)
    return "; ".join(
        f"{_FLAG_TEXT[flag]} {names}" if flag in _WITH_PARTNERS else _FLAG_TEXT[flag]
        for flag in flags
    )


def params_text(result: Mapping[str, Any]) -> str:
    """The sections of a fit result as TOML.

    Args:
        result: of schema ``pamsim-fit/2``.

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
