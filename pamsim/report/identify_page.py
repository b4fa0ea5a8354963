"""The page of an identification: figures, tables and curves in one folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.identification.curves import Curves
from pamsim.identification.frequency import FrequencyIdentification
from pamsim.identification.result import SCHEMA, Identification
from pamsim.identification.summary import inputs_in_words
from pamsim.report.frequency_figure import write_frequency_identification
from pamsim.report.identify_figures import (
    bode,
    drawn_trials,
    measured_and_model,
    model_title,
    scan,
    steps_and_poles,
)
from pamsim.report.identify_local_figure import local_map
from pamsim.report.numbers import significant
from pamsim.report.page import write_page


def write_identification(
    identification: Identification | FrequencyIdentification, out: Path
) -> list[Path]:
    """Write page, figures and ``curves.csv`` of an identification as `write_page` does."""
    if isinstance(identification, FrequencyIdentification):
        page = write_frequency_identification(identification, out)
        return [page, *identification.save(out)]
    written = page_of(identification.to_dict(), identification.curves(), out)
    return [*written, identification.save_curves(out)]


def page_of(result: Mapping[str, Any], curves: Curves, out: Path) -> list[Path]:
    """Write page and figures of a result of schema ``pamsim-identify/4``."""
    models = {model["name"]: model for model in result["models"]}
    shown = models[result["shown"]]
    return write_page(
        out,
        "identify.html",
        result,
        lambda: _figures(result, curves),
        schema=SCHEMA,
        title=model_title,
        inputs=inputs_in_words(result),
        poles=pole_texts,
        best=models.get(result["best"]),
        scores={score["name"]: score for score in (*shown["trials"], *shown["held_out"])},
        drawn=len(drawn_trials(curves.trials)),
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
    figures = {"fit": measured_and_model(result, curves), "step": steps_and_poles(result, curves)}
    several = len(curves.bodes) > 1
    for i in range(len(curves.bodes)):
        figures[f"bode_{i + 1}" if several else "bode"] = bode(result, curves, i)
    if result["local"] is not None:
        figures["local"] = local_map(result)
    if result["scan"] is not None:
        figures["scan"] = scan(result)
    return figures
