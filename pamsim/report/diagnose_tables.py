"""Rows of a diagnosis's tables, as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pamsim.report.numbers import (
    NONE,
    fixed,
    interval,
    p_value,
    percent,
    significant,
    unit,
    words,
)


def model_rows(models: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Effects or alternatives, with their parameters.

    Args:
        models: ``effects`` or ``alternatives`` of a result of schema ``pamsim-diagnosis/1``.
    """
    return [
        {
            "name": words(model["name"]).replace("+", " + "),
            "family": words(model["family"]).replace("+", " + "),
            "explained": percent(model["explained"]),
            "p_value": p_value(model.get("p_value")),
            "behind": fixed(model.get("loss_difference_in_standard_errors"), 1),
            "parameters": [
                {
                    "name": name,
                    "value": significant(p["value"], 4),
                    "interval": interval(p["interval95"], 4) or "no interval",
                    "unit": unit(p["unit"]),
                    "at_bound": p["at_bound"],
                }
                for name, p in model["parameters"].items()
            ],
        }
        for model in models
    ]


def gap_rows(gap: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Channels with floor, before and after."""

    def level(entry: Mapping[str, Any] | None) -> tuple[str, str]:
        if entry is None:
            return NONE, ""
        return significant(entry["value"], 3), interval(entry["interval95"], 3)

    return [
        {
            "channel": words(channel),
            "unit": entry["unit"],
            "levels": [level(entry[key]) for key in ("floor", "before", "after")],
        }
        for channel, entry in gap.items()
    ]


def absent_rows(absent: Mapping[str, Mapping[str, Any]]) -> list[dict[str, str]]:
    """Effects that are not claimed, with the largest size that the data could have missed."""
    return [
        {
            "effect": words(name),
            "parameter": bound["parameter"],
            "limit": significant(bound["limit"], 2) if bound["visible"] else NONE,
            "unit": unit(bound["unit"]) if bound["visible"] else "",
            "size": significant(bound["size"], 2) if bound["visible"] else NONE,
        }
        for name, bound in absent.items()
    ]


def tried_rows(tried: Sequence[Mapping[str, Any]]) -> list[dict[str, str]]:
    """Models that were fitted, the best first."""
    rows: list[dict[str, str]] = []
    for model in tried:
        doubts = [f"{name} at the end of its range" for name in model["at_bound"]]
        if not model["size_known"] and not doubts:
            doubts = ["its interval holds its absence"]
        rows.append(
            {
                "effects": " + ".join(map(words, model["effects"])),
                "loss": significant(model["held_out_loss"], 4),
                "gain": significant(model["gain"], 3),
                "error": significant(model["gain_error"], 2),
                "p_value": p_value(model["p_value"]),
                "doubt": "; ".join(doubts),
            }
        )
    return rows


def screened_rows(screened: Sequence[Mapping[str, Any]]) -> list[dict[str, str]]:
    """What the data show of each effect."""
    return [
        {
            "effect": words(one["effect"]),
            "visibility": significant(one["visibility"], 2),
            "absorbed": percent(one["absorbed"]),
            "likeness": fixed(one["likeness"], 2),
            "nearest": words(one["nearest"]) or NONE,
            "cosine": fixed(one["nearest_cosine"], 2),
            "visible": "yes" if one["visible"] else "no",
        }
        for one in screened
    ]


def base_rows(base: Sequence[Mapping[str, Any]]) -> list[dict[str, str]]:
    """Ordinary parameters as they were, refitted alone, and refitted with the best effects."""
    return [
        {
            "parameter": one["parameter"],
            "unit": unit(one["unit"]),
            "before": significant(one["before"], 4),
            "after": significant(one["after"], 4),
            "with_effects": significant(one["with_effects"], 4),
            "doubt": "at the end of its range" if one["at_bound"] else "",
        }
        for one in base
    ]
