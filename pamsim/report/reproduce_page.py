"""The page of the reproduction: figures, table and verdict in one folder."""

from __future__ import annotations

import csv
import functools
import itertools
import math
import operator
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.core.files import complete_file
from pamsim.recordings.recording import Recording
from pamsim.report import reproduce_figures as draw
from pamsim.report.numbers import fixed, significant, words
from pamsim.report.page import write_page

SCHEMA = "pamsim-reproduce/1"

# Upper ends of the tints of the error column [deg]; beyond the last one is the strongest tint.
_TINT_STEPS_DEG = (0.5, 1.0, 2.0, 4.0)
_SOURCES = ("identified", "assumed", "datasheet", "paper")
_CITING = ("matiskova", "nguyen", "van damme", "sarosi", "alraouf", "paper", "published", "table")
_LOWERED = str.maketrans("12", "₁₂")


def write_reproduction(
    result: Mapping[str, Any], recordings: Mapping[int, Recording], out: Path
) -> Path:
    """Write page, figures and table of a reproduction as `write_page` does; return the page.

    The recordings are those of the distinct rows, by their numbers.
    """
    distinct = [row for row in result.get("rows", ()) if row["repeats"] is None]

    def figures() -> dict[str, Figure]:
        models = result["static_models"]
        compared = models and draw.static_models_figure(models, result["calibration"])
        return {
            **({"static_models": compared} if compared else {}),
            "figure_6_static": draw.static_characteristic(distinct, result["figure6"]),
            "figure_7_large_medium": draw.large_medium_responses(distinct, recordings),
            "figure_8_small": draw.small_responses(distinct, recordings),
            "figure_9_models": draw.model_responses(result["figure9"] or {}),
            "errors": draw.errors_by_row(distinct, result["rms_deg"]),
            "pressures": draw.pressure_courses(distinct, recordings),
        }

    page = write_page(
        out,
        "reproduce.html",
        result,
        figures,
        schema=SCHEMA,
        distinct=distinct,
        sentence=verdict_sentence,
        groups=_groups,
        notes=_notes,
        better_models=better_models,
        not_lowered=not_lowered,
        source_tag=source_tag,
        tags=lambda: Counter(source_tag(entry["source"]) for entry in result["parameters"] or ()),
        tint_steps=_TINT_STEPS_DEG,
        shown_settling_times=draw.SHOWN_SETTLING_TIMES,
    )
    columns = list(result["rows"][0])
    with complete_file(out / "rows.csv") as part, part.open("w", newline="", encoding="utf-8") as f:
        writer = csv.writer(f, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([_cell(row[name]) for name in columns] for row in result["rows"])
    return page


def verdict_sentence(result: Mapping[str, Any]) -> str:
    """How close the simulation comes, in one sentence of numbers without judging words."""
    distinct = [row for row in result["rows"] if row["repeats"] is None]
    done = sum(row["outcome"] == "completed" for row in distinct)
    count = str(done) if done == len(distinct) else f"{done} of {len(distinct)}"
    in_sample = f"{fixed(result['rms_deg'], 2)} deg RMS"
    text = f"{count} distinct operating points reproduced with {in_sample}"
    calibration = result["calibration"]
    if calibration and calibration["applies"]:
        nested = fixed(calibration["nested_leave_one_out"]["rms_deg"], 2)
        text = (
            f"{count} distinct operating points predicted with {nested} deg RMS, each by a model"
            f" chosen and fitted without it (nested leave-one-out); {in_sample} in sample"
        )
    if worst := result["worst"]:
        text += f" (worst: row {worst['row']}, {fixed(worst['error_deg'], 1)} deg)"
    parts = [text]
    for model, names in (("g1", ("T",)), ("g2", ("T1", "T2"))):
        if fit := result[model]:
            equal = ", ".join(
                f"{name.translate(_LOWERED)} = {significant(fit[f'{name}_s'], 3)} s"
                for name in names
            )
            printed = [significant(result["paper"][model][f"{name}_s"], 3) for name in names]
            against = " and ".join(f"{value} s" for value in printed)
            parts.append(
                f"{model.upper().translate(_LOWERED)}: {equal} ({words(fit['method'])}) against"
                f" {against} printed"
            )
    return "; ".join(parts) + "."


def better_models(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Models that were not accepted although they predict rows held out better than the one used.

    The last model accepted is the one used.
    """
    models = result["static_models"] or ()
    used = [model["leave_one_out_rms_deg"] for model in models if model["accepted"]][-1:]
    return [
        model
        for model in models
        if not model["accepted"] and used and model["leave_one_out_rms_deg"] < used[0]
    ]


def not_lowered(result: Mapping[str, Any], *keys: str) -> list[str]:
    """Names of accepted models whose error is not below that of the one accepted before them.

    The keys lead to the error in a model, such as ``left_out_block_rms_deg`` and ``small steps``.
    """
    accepted = [model for model in result["static_models"] or () if model["accepted"]]
    errors = [functools.reduce(operator.getitem, keys, model) for model in accepted]
    known = [math.inf if error is None else error for error in errors]
    return [
        model["name"]
        for model, (before, after) in zip(accepted[1:], itertools.pairwise(known), strict=True)
        if not after < before
    ]


def source_tag(source: str) -> str:
    """Kind of a source as a rig file writes it, such as ``Matiskova 2021, Table 1``.

    It is ``identified``, ``assumed``, ``datasheet``, ``paper`` or ``other``.
    """
    text = source.lower()
    if begun := [tag for tag in _SOURCES if text.startswith(tag)]:
        return begun[0]
    if "datasheet" in text:
        return "datasheet"
    return "paper" if any(word in text for word in _CITING) else "other"


def _groups(result: Mapping[str, Any]) -> list[tuple[str, list[Mapping[str, Any]]]]:
    """Rows of one printed table and one size of step under their heading."""
    grouped = itertools.groupby(
        result["rows"], key=lambda row: f"Table {row['table']}, {row['size']} steps"
    )
    return [(title, list(rows)) for title, rows in grouped]


def _notes(result: Mapping[str, Any]) -> list[tuple[int, str]]:
    notes: list[tuple[int, str]] = []
    for row in result["rows"]:
        if row["repeats"] is not None:
            text = row["slip"] or f"repeats row {row['repeats']}"
            notes.append((row["row"], f"{text}; counted once in the RMS."))
        elif row["slip"]:
            notes.append((row["row"], f"{row['slip']}."))
        if row["outcome"] != "completed":
            why = f"the run ended early ({words(row['outcome'])}): {row['message']}"
            notes.append((row["row"], why))
    return notes


def _cell(value: Any) -> Any:
    """A cell with every digit; what does not exist is empty."""
    return str(value).lower() if isinstance(value, bool) else value
