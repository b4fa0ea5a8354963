"""The page of a diagnosis: the verdict, what it rests on, where the gap is, what was tried."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.comparison.compared_signal import Comparison
from pamsim.report import diagnose_gap, diagnose_loops, diagnose_signals, diagnose_where
from pamsim.report.diagnose_tables import (
    absent_rows,
    base_rows,
    gap_rows,
    model_rows,
    screened_rows,
    tried_rows,
)
from pamsim.report.numbers import fixed, plain, significant, words
from pamsim.report.page import PageImage, check_schema, page_template, save_page

SCHEMA = "pamsim-diagnosis/1"


def write_diagnosis(
    result: Mapping[str, Any], comparisons: Sequence[Comparison], out: Path
) -> list[Path]:
    """Write page and figures of a diagnosis.

    Args:
        result: of schema ``pamsim-diagnosis/1``.
        comparisons: every compared channel of every trial.
        out: folder to write into; made if missing, files of the same names are replaced.

    Returns:
        The files written, the page first.

    Raises:
        InputError: if the result has another schema, or the place cannot be written.
    """
    check_schema(result, SCHEMA)
    shown = diagnose_signals.worst_trials(comparisons, _noise(comparisons, result))
    return save_page(
        out,
        lambda: _figures(result, comparisons, shown),
        lambda images: render_page(result, images, shown),
    )


def _noise(comparisons: Sequence[Comparison], result: Mapping[str, Any]) -> dict[str, float]:
    """Channel -> noise floor [SI], from the floors in written units."""
    floors = result["noise_floor"]["channels"]
    return {channel: floors[channel]["sd_si"] for channel in {part.channel for part in comparisons}}


def _figures(
    result: Mapping[str, Any], comparisons: Sequence[Comparison], shown: Sequence[str]
) -> dict[str, Figure]:
    noise = _noise(comparisons, result)
    figures: dict[str, Figure] = {}
    if result["gap"]:
        figures["gap"] = diagnose_gap.gap_bars(result["gap"])
    if result["where"]:
        figures["where"] = diagnose_where.where_map(result["where"], result["given"])
    maps = diagnose_where.surest_maps(result["maps"])
    if maps:
        figures["maps"] = diagnose_where.binned_maps(maps)
    for number, trial in enumerate(shown, 1):
        parts = [part for part in comparisons if part.trial == trial]
        figures[f"trial_{number}"] = diagnose_signals.trial_channels(parts, noise)
    if result["loops"]:
        figures["loops"] = diagnose_loops.loop_areas(result["loops"])
    if result["spectrum"]:
        figures["lines"] = diagnose_loops.residual_lines(result["spectrum"])
    if result["regimes"]:
        figures["regimes"] = diagnose_gap.regime_values(result["regimes"])
    return figures


def render_page(
    result: Mapping[str, Any], images: Mapping[str, PageImage], shown: Sequence[str]
) -> str:
    """Fill the template.

    Args:
        result: of schema ``pamsim-diagnosis/1``.
        images: by the names of the files without ``.png``.
        shown: names of the trials that are drawn, in the order of their figures.

    Returns:
        The page; every text from the result is escaped.
    """
    following = result["next_experiment"]
    floors = result["noise_floor"]
    return page_template("diagnose.html").render(
        rig=str(result["rig"]),
        data=list(result["data"]),
        verdict=words(result["verdict"]),
        sentence=str(result["sentence"]),
        notes=list(result["notes"]),
        skipped=dict(result["skipped"]),
        repaired_rig=result["repaired_rig"],
        gap=gap_rows(result["gap"]),
        repaired=result["gap_over_floor"]["after"] is not None,
        effects=model_rows(result["effects"]),
        only_alike=result["verdict"] == "named_with_remainder",
        alternatives=model_rows(result["alternatives"]),
        following=following,
        distances=None if following is None else _distances(following),
        absent=absent_rows(result["absent"]),
        tried=tried_rows(result["tried"]),
        screened=screened_rows(result["screened"]),
        base=base_rows(result["base"]),
        assumed=floors["assumed"],
        repeats=floors["repeats"],
        held_out=_grouped(result["held_out"]),
        shown=list(shown),
        given=bool(result["given"]),
        images=images,
        numbers={name: f"Figure {number}" for number, name in enumerate(images, 1)},
        settings={
            "effects tried": plain(len(result["screened"])),
            "models fitted": plain(len(result["tried"])),
            "parameter sets": plain(result["parameter_sets"]),
            "simulations": plain(result["rollouts"]),
            "seed": plain(result["seed"]),
            "wall time": f"{fixed(result['seconds'], 1)} s",
        },
        versions=dict(result["versions"]),
    )


def _grouped(trials: Sequence[str]) -> str:
    """Names of trials, those that differ in their last number together."""
    stems = Counter(re.sub(r"_?\d+$", "", name) or name for name in trials)
    return ", ".join(f"{stem} ({count} trials)" for stem, count in stems.items())


def _distances(following: Mapping[str, Any]) -> dict[str, Any]:
    menu = sorted(following["menu"].items(), key=lambda item: -(item[1] or 0.0))
    return {
        "before": significant(following["before"], 2),
        "after": significant(following["after"], 2),
        "menu": [(words(name), significant(distance, 2)) for name, distance in menu],
    }
