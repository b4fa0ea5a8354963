"""The page of a calibration: what moved, how well it fits, which numbers not to quote."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.report.calibrate_numbers import correlations, parameter_ranges, profile_curves
from pamsim.report.numbers import sentence, significant, words
from pamsim.report.page import write_page
from pamsim.report.row_errors import rest_errors
from pamsim.report.trial_signals import shown_trials, trial_signals

SCHEMA = "pamsim-calibrate/1"


def write_calibration(
    result: Mapping[str, Any], comparisons: Sequence[Comparison], out: Path
) -> list[Path]:
    """Write page and figures of a calibration as `write_page` does.

    Args:
        result: of schema ``pamsim-calibrate/1``.
        comparisons: every channel of every trial, and every static table.
        out: folder.
    """
    trials = [c for c in comparisons if c.channel != "angle_at_rest"]
    return write_page(
        out,
        "calibrate.html",
        result,
        lambda: _figures(result, trials),
        schema=SCHEMA,
        headline=headline,
        shown_unit=shown_unit,
        shown=len(shown_trials(trials)),
        trials=len({c.trial for c in trials}),
    )


def _figures(result: Mapping[str, Any], trials: Sequence[Comparison]) -> dict[str, Figure]:
    parameters = result["parameters"]
    figures = {"parameters": parameter_ranges(parameters)}
    if len(parameters) > 1:
        matrix = result["fit"]["correlation"]
        figures["correlation"] = correlations(parameters, matrix)
    if trials:
        figures["trials"] = trial_signals(trials)
    tables = [trial for trial in result["trials"] if "rows" in trial]
    if tables:
        figures["rest"] = rest_errors(tables)
    if result["profiles"]:
        named = {parameter["name"]: parameter for parameter in parameters}
        figures["profiles"] = profile_curves(result["profiles"], named)
    return figures


def headline(result: Mapping[str, Any]) -> str:
    """What the calibration reached, in one line of numbers."""
    parts = [
        f"{words(row['channel'])}: {significant(row['before'], 2)} → {significant(row['after'], 2)}"
        f" {row['unit']}"
        for row in result["misfit"]
        if row["after"] is not None
    ]
    count = len(result["parameters"])
    fitted = f"{count} parameters" if count > 1 else "1 parameter"
    moved = f" RMS misfit, {', '.join(parts)}." if parts else ""
    return f"{fitted} fitted.{moved} {sentence(result['sentence'])}"
