"""The page of an identification: figures, tables and curves in one folder."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.core.errors import InputError
from pamsim.report import identify_figures
from pamsim.report.identify_bode import bode
from pamsim.report.identify_local_figure import local_map
from pamsim.report.identify_view import model_title, model_views, trial_views, verdict
from pamsim.report.numbers import fixed, plain
from pamsim.report.page import PageImage, check_schema, page_template, save_page

SCHEMA = "pamsim-identify/1"


def write_identification(
    result: Mapping[str, Any], curves: Mapping[str, Any], out: Path
) -> list[Path]:
    """Write page, figures and curves of an identification.

    Args:
        result: of schema ``pamsim-identify/1``.
        curves: what the figures draw, see `identify_figures` and `bode`.
        out: folder to write into; made if missing, files of the same names are replaced.

    Returns:
        The files written, the page first.

    Raises:
        InputError: for another schema, or if the place cannot be written.
    """
    check_schema(result, SCHEMA)
    written = save_page(
        out, lambda: _figures(result, curves), lambda images: _render(result, curves, images)
    )
    table = out / "curves.csv"
    try:
        _write_curves(result, curves, table)
    except OSError as error:
        raise InputError(f"cannot write {table}: {error.strerror}") from None
    return [*written, table]


def _figures(result: Mapping[str, Any], curves: Mapping[str, Any]) -> dict[str, Figure]:
    figures = {
        "fit": identify_figures.measured_and_model(result, curves),
        "step": identify_figures.step_and_poles(result, curves),
        "bode": bode(result, curves),
    }
    if result["local"] is not None:
        figures["local"] = local_map(result)
    return figures


def _write_curves(result: Mapping[str, Any], curves: Mapping[str, Any], path: Path) -> None:
    given, output = (
        "" if result[side]["unit"] == "1" else f"_{result[side]['unit'].lower()}"
        for side in ("input", "output")
    )
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["trial", "time_s", f"input{given}", f"output{output}", f"model{output}"])
        for trial in curves["trials"]:
            columns = (trial[key] for key in ("time", "input", "output", "model"))
            for row in zip(*columns, strict=True):
                writer.writerow([trial["name"], *(f"{value:.9g}" for value in row)])


def _render(
    result: Mapping[str, Any], curves: Mapping[str, Any], images: Mapping[str, PageImage]
) -> str:
    return page_template("identify.html").render(
        data=result["data"],
        given=result["input"],
        output=result["output"],
        verdict=verdict(result),
        models=model_views(result),
        shown=model_title(result["shown"]),
        skipped={model_title(name): why for name, why in result["skipped"].items()},
        trials=trial_views(result),
        drawn=len(identify_figures.shown_trials(curves["trials"])),
        dependences=[
            item["sentence"] for item in (result["local"] or {"dependences": []})["dependences"]
        ],
        effective=fixed(result["effective_samples"], 0),
        held_out=any(trial["role"] == "held_out" for trial in result["trials"]),
        notes=result["notes"],
        images=images,
        settings={
            "rig": result["rig"] or "not given",
            "wall time": f"{fixed(result['seconds'], 1)} s",
            **{name: plain(version) for name, version in result["versions"].items()},
        },
    )
