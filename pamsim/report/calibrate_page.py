"""The page of a calibration: what moved, how well it fits, what to doubt."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.report import calibrate_numbers, calibrate_signals
from pamsim.report.calibrate_signals import Compared
from pamsim.report.numbers import fixed, interval, plain, significant, unit, words
from pamsim.report.page import PageImage, check_schema, page_template, save_page

SCHEMA = "pamsim-calibrate/1"


def write_calibration(
    result: Mapping[str, Any], comparisons: Sequence[Compared], out: Path
) -> list[Path]:
    """Write page and figures of a calibration.

    Args:
        result: of schema ``pamsim-calibrate/1``.
        comparisons: every channel of every trial, and every static table.
        out: folder to write into; made if missing, files of the same names are replaced.

    Returns:
        The files written, the page first.

    Raises:
        InputError: if the result has another schema, or the place cannot be written.
    """
    check_schema(result, SCHEMA)
    return save_page(
        out,
        lambda: _figures(result, comparisons),
        lambda images: render_page(result, images, _shown(comparisons)),
    )


def _trials(comparisons: Sequence[Compared]) -> list[Compared]:
    return [c for c in comparisons if c.channel != "angle_at_rest"]


def _shown(comparisons: Sequence[Compared]) -> tuple[int, int]:
    trials = _trials(comparisons)
    return len(calibrate_signals.shown_trials(trials)), len({c.trial for c in trials})


def _figures(result: Mapping[str, Any], comparisons: Sequence[Compared]) -> dict[str, Figure]:
    parameters = result["parameters"]
    figures = {"parameters": calibrate_numbers.parameter_ranges(parameters)}
    if len(parameters) > 1:
        matrix = result["calibration"]["correlation"]
        figures["correlation"] = calibrate_numbers.correlations(parameters, matrix)
    if _trials(comparisons):
        figures["trials"] = calibrate_signals.trial_signals(_trials(comparisons))
    tables = [trial for trial in result["trials"] if "rows" in trial]
    if tables:
        figures["rest"] = calibrate_signals.rest_errors(tables)
    if result["profiles"]:
        named = {parameter["name"]: parameter for parameter in parameters}
        figures["profiles"] = calibrate_numbers.profile_curves(result["profiles"], named)
    return figures


def render_page(
    result: Mapping[str, Any], images: Mapping[str, PageImage], shown: tuple[int, int]
) -> str:
    """Fill the template.

    Args:
        result: of schema ``pamsim-calibrate/1``.
        images: by the names of the files without ``.png``.
        shown: how many trials are drawn, of how many.

    Returns:
        The page; every text from the result is escaped.
    """
    calibration = result["calibration"]
    return page_template("calibrate.html").render(
        rig=str(result["rig"]),
        data=list(result["data"]),
        verdict=verdict(result),
        status=words(result["status"]),
        notes=list(result["notes"]),
        misfit=[_misfit(row) for row in result["misfit"]],
        held_out=any(row["held_out_after"] is not None for row in result["misfit"]),
        parameters=[_parameter(parameter) for parameter in result["parameters"]],
        determined=list(calibration["determined"]),
        interval_method=str(calibration["interval_method"]),
        noise=[_noise(name, entry) for name, entry in calibration["noise"].items()],
        profiles=list(result["profiles"]),
        starts=[_start(start) for start in calibration["starts"]],
        same_optimum=calibration["same_optimum"],
        shown=shown,
        images=images,
        numbers={name: f"Figure {number}" for number, name in enumerate(images, 1)},
        calibrated_rig=result["calibrated_rig"],
        settings={
            "simulations": plain(result["simulations"]),
            "parameter vectors": plain(calibration["evaluations"]),
            "iterations": plain(calibration["iterations"]),
            "vectors that broke down": plain(calibration["diverged"]),
            "seed": plain(result["seed"]),
            "wall time": f"{fixed(result['seconds'], 1)} s",
        },
        versions=dict(result["versions"]),
    )


def verdict(result: Mapping[str, Any]) -> str:
    """What the calibration reached, in one sentence of numbers."""
    parts = [
        f"{words(row['channel'])}: {significant(row['before'], 2)} → {significant(row['after'], 2)}"
        f" {row['unit']}"
        for row in result["misfit"]
        if row["after"] is not None
    ]
    count = len(result["parameters"])
    named = f"{count} parameters" if count > 1 else "1 parameter"
    moved = f" RMS misfit, {', '.join(parts)}." if parts else ""
    said = str(result["sentence"]).rstrip(".")
    return f"{named} fitted.{moved} {said[:1].upper()}{said[1:]}."


def _misfit(row: Mapping[str, Any]) -> dict[str, str]:
    keys = ("before", "after", "held_out_before", "held_out_after")
    return {
        "channel": words(row["channel"]),
        "unit": row["unit"],
        **{key: significant(row[key], 3) for key in keys},
    }


def _parameter(parameter: Mapping[str, Any]) -> dict[str, Any]:
    written = parameter["written"]
    return {
        "name": parameter["name"],
        "tied": parameter["tied"],
        "before": significant(written["before"], 4),
        "value": significant(written["value"], 5),
        "interval": interval(written["interval95"], 4),
        "bounds": interval(written["bounds"], 3),
        "range_source": parameter["range_source"],
        "unit": unit(written["unit"]),
        "doubt": parameter["sentence"],
    }


_SHOWN = {"angle": ("deg", 57.29577951308232), "pressure": ("kPa", 1e-3)}


def _noise(name: str, entry: Mapping[str, Any]) -> dict[str, str]:
    shown, scale = _SHOWN.get(name.split("_")[0], ("N", 1.0))
    return {
        "channel": words(name),
        "noise": f"{significant(entry['noise_sd'] * scale, 3)} {shown}",
        "source": words(entry["noise_source"]),
    }


def _start(start: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "objective": fixed(start["objective"], 2),
        "converged": plain(start["converged"]),
        "iterations": start["iterations"],
        "same": plain(start["same_optimum"]),
    }
