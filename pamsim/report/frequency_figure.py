"""Page and figure of an identification from a frequency response: measured and shown model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pamsim.core.units import DEG_PER_RAD
from pamsim.identification.curves import frequency_response
from pamsim.identification.frequency import SCHEMA, FrequencyIdentification
from pamsim.inference.estimate import Interval
from pamsim.report.identify_figures import magnitude_and_phase
from pamsim.report.numbers import fixed, interval, quantity
from pamsim.report.page import write_page
from pamsim.report.style import INK, finish_axes, styled

_POINTS = 300


def write_frequency_identification(result: FrequencyIdentification, out: Path) -> Path:
    """Write page and figure of an identification from a frequency response; return the page."""
    content = result.to_dict()
    shown = result.shown.structure.sentence
    page, *_ = write_page(
        out,
        "summary.html",
        content,
        lambda: {"bode": measured_and_fitted_response(result)},
        schema=SCHEMA,
        headline=f"{'Recommended' if result.recommended else 'No model can be trusted; best'}:"
        f" {shown}",
        under=f"{result.source}. Reason: {result.reason}",
        tone="found" if result.recommended else "open",
        facts=[
            (one.name, quantity(one.value, one.unit.strip("-"), 4), _between(one.interval95))
            for one in result.shown.estimates
        ],
        caption=(
            "Frequency response.",
            "Measured magnitude and phase against frequency, with the model and its 95 % band",
            "Where the measured points leave the band, the model is too simple.",
        ),
        notes=[*result.notes, *(f"not fitted: {k}: {why}" for k, why in result.skipped.items())],
        tables=[
            {
                "title": "Models",
                "columns": ("model", "fit [%]", "AICc above the best"),
                "rows": [
                    (one["model"], fixed(one["fit_percent"], 2), fixed(one["aicc_above_best"], 1))
                    for one in content["models"]
                ],
            }
        ],
    )
    return page


def _between(ends: Interval | None) -> str:
    """An interval as printed."""
    return interval(ends, 4) if ends is None or np.all(np.isfinite(ends)) else "not bounded"


@styled
def measured_and_fitted_response(result: FrequencyIdentification) -> Figure:
    """Magnitude and phase over rad/s: measured, and of the shown model with its 95 % band."""
    omega = np.geomspace(result.frequency[0], result.frequency[-1], _POINTS)
    model = frequency_response(result.shown, omega)
    figure, (upper, lower) = magnitude_and_phase(model, omega, "model with 95 % band")
    # By whole turns to where the model is.
    phase = np.unwrap(np.angle(result.response))
    turns = np.mean(phase - np.interp(result.frequency, omega, model.phase)) / (2.0 * np.pi)
    phase -= 2.0 * np.pi * np.round(turns)
    for ax, measured in ((upper, np.abs(result.response)), (lower, DEG_PER_RAD * phase)):
        ax.plot(result.frequency, measured, ".", color=INK, alpha=0.6, label="measured")
    finish_axes(upper, y="magnitude", zero=False)
    finish_axes(lower, x="frequency [rad/s]", y="phase [deg]", zero=False)
    upper.legend(loc="lower left")
    return figure
