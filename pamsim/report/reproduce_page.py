"""The page of the reproduction: figures, table and verdict in one folder."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.core.recording import Recording
from pamsim.report import reproduce_figures, reproduce_steps
from pamsim.report.numbers import fixed, number_or_none, plain
from pamsim.report.page import PageImage, check_schema, page_template, save_page
from pamsim.report.parameter_view import parameter_views
from pamsim.report.reproduce_ladder import TORQUE_LAW_DEG, rivals, rung_views, static_ladder
from pamsim.report.reproduce_rows import (
    OperatingPoint,
    distinct,
    parse_rows,
    write_rows_csv,
)
from pamsim.report.reproduce_view import (
    TINT_STEPS_DEG,
    dig,
    failing,
    model_views,
    row_views,
    verdict,
)

SCHEMA = "pamsim-reproduce/1"


def write_reproduction(
    result: Mapping[str, Any], recordings: Mapping[int, Recording], out: Path
) -> list[Path]:
    """Write page, figures and table of a reproduction.

    Args:
        result: of schema ``pamsim-reproduce/1``: JSON-safe, angles [deg], pressures [kPa]. Keys
            unknown to this version are ignored.
        recordings: by row number, of the distinct rows.
        out: folder to write into; made if missing, files of the same names are replaced.

    Returns:
        The files written, the page first.

    Raises:
        InputError: if the result has another schema or lacks its rows, or ``out`` is a file.
    """
    check_schema(result, SCHEMA)
    points = parse_rows(result)
    written = save_page(
        out,
        lambda: _figures(result, points, recordings),
        lambda images: render_page(result, points, images),
    )
    write_rows_csv(points, out / "rows.csv")
    return [*written, out / "rows.csv"]


def _figures(
    result: Mapping[str, Any],
    points: list[OperatingPoint],
    recordings: Mapping[int, Recording],
) -> dict[str, Figure]:
    single = distinct(points)
    rungs = result.get("ladder") or ()
    ladder = {"ladder": static_ladder(rungs)} if rungs else {}
    return {
        **ladder,
        "figure_6_static": reproduce_figures.static_characteristic(
            single, result.get("figure6") or {}
        ),
        "figure_7_large_medium": reproduce_steps.large_medium_responses(single, recordings),
        "figure_8_small": reproduce_steps.small_responses(single, recordings),
        "figure_9_models": reproduce_figures.model_responses(result.get("figure9") or {}),
        "errors": reproduce_figures.errors_by_row(single, number_or_none(result.get("rms_deg"))),
        "pressures": reproduce_steps.pressure_courses(single, recordings),
    }


def render_page(
    result: Mapping[str, Any], points: list[OperatingPoint], images: Mapping[str, PageImage]
) -> str:
    """Fill the template.

    Args:
        result: of schema ``pamsim-reproduce/1``.
        points: its rows.
        images: by the names of the files without ``.png``.

    Returns:
        The page; every text from the result is escaped.
    """
    row_groups, notes = row_views(points)
    parameters = parameter_views(result)
    return page_template("reproduce.html").render(
        rig=str(result.get("rig") or "unnamed rig"),
        verdict=verdict(result, points),
        start=str(result.get("start") or "not given"),
        start_meaning=str(result.get("start_meaning") or "not described").rstrip("."),
        source=str(dig(result, "paper", "source") or "the paper"),
        checks=list(result.get("checks") or ()),
        failing=failing(result),
        row_groups=row_groups,
        row_count=len(points),
        shown_settling_times=plain(reproduce_steps.SHOWN_SETTLING_TIMES),
        notes=notes,
        distinct_count=len(distinct(points)),
        rms=fixed(result.get("rms_deg"), 2),
        tint_steps=[plain(step) for step in TINT_STEPS_DEG],
        images=images,
        scale=fixed(dig(result, "figure6", "scale_kpa"), 0),
        rms_bar=fixed(dig(result, "figure6", "rms_bar_deg"), 1),
        rms_scaled=fixed(dig(result, "figure6", "rms_scaled_deg"), 1),
        models=model_views(result),
        rungs=rung_views(result.get("ladder") or ()),
        rivals=rivals(result.get("ladder") or ()),
        ladder_command=dig(result, "calibration", "command"),
        torque_law=fixed(TORQUE_LAW_DEG, 2),
        identified_row=dig(result, "identification", "row"),
        paper_notes=list(dig(result, "paper", "notes") or ()),
        parameters=parameters,
        parameter_tags=Counter(parameter.tag for parameter in parameters),
        settings={
            "time step": f"{plain(result.get('timestep_s'))} s",
            "sampling": f"{plain(result.get('sample_hz'))} Hz",
            "simulated encoder and converter": plain(result.get("sensors")),
            "wall time": f"{fixed(result.get('wall_s'), 1)} s",
        },
        versions=dict(result.get("versions") or {}),
    )
