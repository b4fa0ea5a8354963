"""The page of an identification: figures, tables and curves in one folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pamsim.core.units import DEG_PER_RAD
from pamsim.identification.curves import Curves, frequency_response
from pamsim.identification.frequency import SCHEMA as FREQUENCY_SCHEMA
from pamsim.identification.frequency import FrequencyIdentification
from pamsim.identification.result import SCHEMA, Identification
from pamsim.identification.summary import inputs_in_words
from pamsim.inference.estimate import Interval
from pamsim.report import identify_figures as draw
from pamsim.report.numbers import fixed, interval, quantity, significant
from pamsim.report.page import write_page
from pamsim.report.style import finish_axes, styled
from pamsim.scene.series_colours import INK

_POINTS = 300


def write_identification(
    identification: Identification | FrequencyIdentification, out: Path
) -> Path:
    """Write page, figures and ``curves.csv`` of an identification; return the page."""
    if isinstance(identification, FrequencyIdentification):
        identification.save(out)
        return write_frequency_identification(identification, out)
    identification.save_curves(out)
    return page_of(identification.to_dict(), identification.curves(), out)


def page_of(result: Mapping[str, Any], curves: Curves, out: Path) -> Path:
    """Write page and figures of a result of schema ``pamsim-identify/4``."""
    models = {model["name"]: model for model in result["models"]}
    shown = models[result["shown"]]
    return write_page(
        out,
        "identify.html",
        result,
        lambda: _figures(result, curves),
        schema=SCHEMA,
        title=draw.model_title,
        inputs=inputs_in_words(result),
        poles=pole_texts,
        best=models.get(result["best"]),
        scores={score["name"]: score for score in (*shown["trials"], *shown["held_out"])},
        drawn=len(draw.drawn_trials(curves.trials)),
        held_out=any(trial["role"] == "held_out" for trial in result["trials"]),
    )


def pole_texts(poles: Sequence[Sequence[float] | None]) -> list[str]:
    """Poles as printed; a conjugate pair is one entry.

    Args:
        poles: real and imaginary part of each [rad/s]; None where there is no continuous pole.
    """
    texts: list[str] = []
    for pole in poles:
        real, imaginary = pole or (None, 0.0)
        text = "none" if real is None else significant(real, 3)
        if imaginary != 0.0:
            text += f" ± {significant(abs(imaginary), 3)}j"
        if imaginary >= 0.0 or text not in texts:
            texts.append(text)
    return texts


def _figures(result: Mapping[str, Any], curves: Curves) -> dict[str, Figure]:
    figures = {
        "fit": draw.measured_and_model(result, curves),
        "step": draw.steps_and_poles(result, curves),
    }
    several = len(curves.bodes) > 1
    for i in range(len(curves.bodes)):
        figures[f"bode_{i + 1}" if several else "bode"] = draw.bode(result, curves, i)
    if result["local"] is not None:
        figures["local"] = draw.local_map(result)
    if result["scan"] is not None:
        figures["scan"] = draw.scan(result)
    return figures


def write_frequency_identification(result: FrequencyIdentification, out: Path) -> Path:
    """Write page and figure of an identification from a frequency response; return the page."""
    content = result.to_dict()
    shown = result.shown.structure.sentence
    return write_page(
        out,
        "summary.html",
        content,
        lambda: {"bode": measured_and_fitted_response(result)},
        schema=FREQUENCY_SCHEMA,
        headline=f"{'Recommended' if result.best else 'No model can be trusted; best'}: {shown}",
        under=f"{result.source}. Reason: {result.reason}",
        tone="found" if result.best else "open",
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


def _between(ends: Interval | None) -> str:
    return interval(ends, 4) if ends is None or np.all(np.isfinite(ends)) else "not bounded"


@styled
def measured_and_fitted_response(result: FrequencyIdentification) -> Figure:
    """Magnitude and phase over rad/s: measured, and of the shown model with its 95 % band."""
    omega = np.geomspace(result.frequency[0], result.frequency[-1], _POINTS)
    model = frequency_response(result.shown, omega)
    figure, (upper, lower) = draw.magnitude_and_phase(model, omega, "model with 95 % band")
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
