"""The page of an identification: figures, tables and curves in one folder.

Results are of schema ``pamsim-identify/4``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator, SymmetricalLogLocator

from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.identification.curves import (
    Curves,
    FrequencyResponse,
    TrialCurve,
    frequency_response,
)
from pamsim.identification.frequency import SCHEMA as FREQUENCY_SCHEMA
from pamsim.identification.frequency import FrequencyIdentification
from pamsim.identification.result import SCHEMA, Identification
from pamsim.identification.summary import inputs_in_words
from pamsim.inference.estimate import Interval
from pamsim.report.numbers import fixed, interval, quantity, significant, words
from pamsim.report.page import write_page
from pamsim.report.style import (
    finish_axes,
    new_figure,
    plain_log_scale,
    say_empty,
    series_look,
    styled,
)
from pamsim.scene.series_colours import BLUE, GREEN, INK, MUTED, PURPLE, VERMILION

_MOST_TRIALS = 5

_DOTTED: dict[str, Any] = {"color": MUTED, "linewidth": 0.8, "linestyle": ":"}
_BAND: dict[str, Any] = {"color": VERMILION, "alpha": 0.2, "linewidth": 0}
_DIRECTIONS = {1: ("^", "rising input"), -1: ("v", "falling input"), 0: ("o", "both ways")}
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
    figures = {
        "fit": measured_and_model(result, curves),
        "step": steps_and_poles(result, curves),
    }
    several = len(curves.bodes) > 1
    for i in range(len(curves.bodes)):
        figures[f"bode_{i + 1}" if several else "bode"] = bode(result, curves, i)
    if result["local"] is not None:
        figures["local"] = local_map(result)
    if result["scan"] is not None:
        figures["scan"] = scan(result)
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


def label(quantity: str, unit: str) -> str:
    """Axis label; without a unit in it for a pure number."""
    return quantity if unit in ("", "1", "-") else f"{quantity} [{unit}]"


def model_title(name: str) -> str:
    """Name of a model for people: ``first order with dead time``, ``ARX 2,2,1``, ``OE 1,2,1``."""
    kind, _, orders = name.partition("_")
    if kind in ("arx", "oe"):
        return f"{kind.upper()} {orders.replace('_', ',')}"
    text = words(name).replace(" dead time of ", " dead time of input ")
    text = re.sub(r" zeros ((?:\d )*)(\d)(?= |$)", _zeros, text).replace(
        " any poles", ", any poles"
    )
    return text.replace(" dead time", " with dead time").replace(" drift", ", output drifts")


def _zeros(found: re.Match[str]) -> str:
    """Zeros of a structure, such as ``, 1 zero``; of each input where there are several."""
    before, last = found.groups()
    if before:
        return f", zeros {before.replace(' ', ', ')}{last}"
    return f", {last} zero{'' if last == '1' else 's'}"


def drawn_trials(trials: Sequence[TrialCurve]) -> list[TrialCurve]:
    """The trials a figure has room for: held-out ones first, since they judge the model."""
    return sorted(trials, key=lambda trial: not trial.held_out)[:_MOST_TRIALS]


@styled
def measured_and_model(result: Mapping[str, Any], curves: Curves) -> Figure:
    """Output and free run of the shown model, and their difference.

    For one trial they lie on top of each other, for more each trial has a row.
    """
    unit = result["output"]["unit"]
    trials = drawn_trials(curves.trials)
    if len(trials) == 1:
        figure, panels = new_figure(4.8, rows=2, sharex=True, height_ratios=(1.7, 1.0))
    else:
        figure, panels = new_figure(0.7 + 1.45 * len(trials), rows=len(trials), columns=2)
    pairs = [(panels[2 * i], panels[2 * i + 1]) for i in range(len(trials))]
    for trial, (upper, lower) in zip(trials, pairs, strict=True):
        role = "held out" if trial.held_out else "fitted"
        upper.plot(trial.time, trial.output, color=INK, linewidth=2.6, alpha=0.35, label="measured")
        upper.plot(trial.time, trial.model, color=VERMILION, linewidth=1.1, label="model")
        off = trial.model - trial.output
        lower.plot(trial.time, off, color=BLUE, linewidth=0.8, label="model − measured")
        title = f"{trial.name} ({role})"
        finish_axes(upper, y=label("output", unit), title=title, zero=False)
        finish_axes(lower, y=label("difference", unit))
    for ax in panels[-1:] if len(trials) == 1 else panels[-2:]:
        ax.set_xlabel("time [s]")
    handles = [*pairs[0][0].lines, pairs[0][1].lines[0]]
    figure.legend(handles=handles, loc="outside upper right", ncols=3)
    return figure


@styled
def scan(result: Mapping[str, Any]) -> Figure:
    """Every structure of the scan by its number of coefficients, the shown model's marked."""
    structures = result["scan"]["structures"]
    held_out = structures[0]["fit_percent_held_out"] is not None
    likelihood = structures[0]["hannan_quinn_above_best"] is not None
    criterion = "hannan_quinn_above_best" if likelihood else "aicc_above_best"
    key = "fit_percent_held_out" if held_out else criterion
    figure, (ax,) = new_figure(3.2)

    def mark(rows: list[Mapping[str, Any]], marker: str, **look: Any) -> None:
        if rows:
            ax.plot([s["coefficients"] for s in rows], [s[key] for s in rows], marker, **look)

    kinds = (("no", BLUE), ("one", GREEN), ("two", PURPLE))
    for integrators, (number, colour) in enumerate(kinds):
        name = f"{number} integrator{'s' if integrators > 1 else ''}"
        own = [s for s in structures if s["integrators"] == integrators]
        for dead_time, marker, more in ((False, "o", ""), (True, "^", ", dead time")):
            rows = [s for s in own if s["dead_time"] == dead_time]
            mark(rows, marker, color=colour, markersize=5, alpha=0.8, label=name + more)
    ring: dict[str, Any] = {"markersize": 13, "markerfacecolor": "none", "markeredgewidth": 1.6}
    shown = [s for s in structures if s["shown"]]
    mark(shown, "o", color=VERMILION, label="shown model", **ring)
    values = np.array([s[key] for s in structures])
    if held_out:
        best, usual = float(np.max(values)), float(np.median(values))
        span = max(4.0 * (best - usual), 1.0)
        ax.set_ylim(max(best - span, float(np.min(values)) - 0.1 * span), best + 0.15 * span)
    else:
        ax.set_yscale("symlog", linthresh=2.0)
        ticks = SymmetricalLogLocator(base=10.0, linthresh=2.0)
        ticks.set_params(numticks=8)  # as many as can be read
        ax.yaxis.set_major_locator(ticks)
    finish_axes(
        ax,
        x="poles, zeros, gains, dead times and drift",
        y="fit where nothing was fitted [%]"
        if held_out
        else f"{'criterion' if likelihood else 'AICc'} above the best",
        zero=False,
    )
    figure.legend(loc="outside upper center", ncols=3)
    return figure


@styled
def steps_and_poles(result: Mapping[str, Any], curves: Curves) -> Figure:
    """Step responses of the shown model to each input, and the poles of all models."""
    count = len(curves.steps) + 1
    rows = (count + 1) // 2
    figure, panels = new_figure(3.2 * rows, rows=rows, columns=2)
    model = _shown(result)
    settles = 0.0 not in (abs(complex(*p)) for p in model["poles_rad_per_s"] if p is not None)
    for i, (ax, step) in enumerate(zip(panels, curves.steps, strict=False)):
        gain = _gain(result, i)
        if step.band is not None:
            ax.fill_between(step.time, *step.band, label="95 % band", **_BAND)
        ax.plot(step.time, step.output, color=VERMILION, label=model_title(model["name"]))
        if settles:
            ax.axhline(gain["value"], label="static gain K", **_DOTTED)
        into = result["inputs"][i]["expression"]
        title = f"step response to [{i + 1}] {words(into)}" if count > 2 else "step response"
        unit = gain["unit"]
        finish_axes(ax, x="time after a unit step [s]", y=label("response", unit), title=title)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles=handles, labels=labels, loc="outside upper center", ncols=3)
    _draw_poles(panels[count - 1], result)
    for ax in panels[count:]:
        ax.set_visible(False)
    return figure


def _gain(result: Mapping[str, Any], given: int) -> Mapping[str, Any]:
    parameters = _shown(result)["parameters"]
    return parameters["K" if len(result["inputs"]) == 1 else f"K[{given + 1}]"]


def magnitude_and_phase(
    response: FrequencyResponse, frequency: FloatArray, name: str, band_name: str | None = None
) -> tuple[Figure, list[Axes]]:
    """Two panels on one logarithmic axis of frequency, with a model and its band named so."""
    figure, panels = new_figure(4.6, rows=2, sharex=True)
    for ax, values, band, scale in (
        (panels[0], response.magnitude, response.magnitude_band, 1.0),
        (panels[1], response.phase, response.phase_band, DEG_PER_RAD),
    ):
        if band is not None:
            ax.fill_between(frequency, *(scale * band), label=band_name, **_BAND)
        ax.plot(frequency, scale * values, color=VERMILION, label=name)
        ax.set_xscale("log")
        ax.grid(True, axis="x")
    panels[0].set_yscale("log")
    return figure, panels


@styled
def bode(result: Mapping[str, Any], curves: Curves, given: int = 0) -> Figure:
    """Magnitude and phase of the shown model over Hz, from the input at place ``given``."""
    model = _shown(result)
    response = curves.bodes[given]
    hertz = response.frequency / (2.0 * np.pi)
    title = model_title(model["name"])
    figure, (upper, lower) = magnitude_and_phase(response, hertz, title, "95 % band")
    nyquist = curves.nyquist / (2.0 * np.pi)
    corners = sorted({round(abs(complex(*p)), 9) for p in model["poles_rad_per_s"]} - {0.0})
    for number, corner in enumerate(corners):
        name = None if number else "corner frequency"
        for ax in (upper, lower):
            ax.axvline(corner / (2.0 * np.pi), label=name, **_DOTTED)
    finish_axes(upper, y=label("magnitude", _gain(result, given)["unit"]), zero=False)
    finish_axes(lower, x="frequency [Hz]", y="phase [deg]", zero=False)
    span = DEG_PER_RAD * float(np.ptp(response.phase))
    if span < 720.0:
        lower.yaxis.set_major_locator(MultipleLocator(45.0 if span < 300.0 else 90.0))
    lower.set_xlim(hertz[0], min(hertz[-1], nyquist))
    upper.legend(loc="lower left")
    return figure


def _shown(result: Mapping[str, Any]) -> Mapping[str, Any]:
    return next(model for model in result["models"] if model["name"] == result["shown"])


def _draw_poles(ax: Axes, result: Mapping[str, Any]) -> None:
    """A row of poles per model: models that agree have their poles in one column."""
    models = result["models"]
    handles: dict[str, Any] = {}
    for row, model in enumerate(models):
        colour = VERMILION if model["name"] == result["shown"] else MUTED
        for pole in model["poles_rad_per_s"]:
            if pole is None or complex(*pole) == 0.0:  # an integrator has no place on the axis
                continue
            kind, marker = _pole_marker(complex(*pole))
            (handles[kind],) = ax.plot(
                abs(complex(*pole)), row, marker, color=colour, markersize=6.5, markeredgewidth=1.4
            )
    finish_axes(ax, x="|pole| [rad/s]", title="poles", zero=False)
    ax.set_yticks(range(len(models)), [model_title(model["name"]) for model in models])
    ax.tick_params(axis="y", labelsize=7.5)
    ax.set_ylim(len(models) - 0.5, -0.5)
    if not handles:
        say_empty(ax, "no pole")
        return
    plain_log_scale(ax)
    if set(handles) != {"lag"}:
        ax.legend(handles.values(), handles.keys(), loc="best")


def _pole_marker(pole: complex) -> tuple[str, str]:
    if pole.real >= 0.0:
        return "unstable", "s"
    return ("conjugate pair", "D") if pole.imag else ("lag", "x")


@styled
def local_map(result: Mapping[str, Any]) -> Figure:
    """One panel per parameter against the pressure level, with 95 % intervals.

    The marker is that of the step's direction, the colour that of the load.
    """
    models = [m for m in result["local"]["models"] if m["status"] == "converged"]
    names = list(dict.fromkeys(name for m in result["local"]["models"] for name in m["parameters"]))
    figure, panels = new_figure(0.7 + 1.9 * len(names), rows=len(names), sharex=True)
    loads = sorted({model["load_kg"] for model in models})
    levels = [model["pressure_kpa"] for model in models]
    # Steps at one level would be drawn on top of each other.
    by_level = len(set(levels)) > 1
    places = levels if by_level else [float(i) for i in range(1, len(models) + 1)]
    for ax, name in zip(panels, names, strict=True):
        _panel(ax, models, places, name, loads)
    panels[-1].set_xlabel(
        "mean gauge pressure of the muscles [kPa]"
        if by_level
        else f"operating point, all at {fixed(levels[0] if levels else None, 0)} kPa"
    )
    handles = [
        Line2D([], [], color=series_look(i)[0], linewidth=3, label=f"load {load:g} kg")
        for i, load in enumerate(loads)
    ] + [
        Line2D([], [], color=INK, marker=marker, linestyle="none", label=text)
        for direction, (marker, text) in _DIRECTIONS.items()
        if any(model["direction"] == direction for model in models)
    ]
    if handles:
        figure.legend(handles=handles, loc="outside upper right", ncols=min(len(handles), 4))
    return figure


def _panel(
    ax: Axes,
    models: Sequence[Mapping[str, Any]],
    places: Sequence[float],
    name: str,
    loads: list[float],
) -> None:
    unit = ""
    for model, place in zip(models, places, strict=True):
        item = model["parameters"][name]
        unit = item["unit"]
        colour, _ = series_look(loads.index(model["load_kg"]))
        marker, _ = _DIRECTIONS[model["direction"]]
        value, sides = item["value"], item["interval95"]
        if value is None:
            continue
        if sides is not None and None not in sides:
            ax.vlines(place, sides[0], sides[1], color=colour, linewidth=1.0)
        ax.plot(place, value, marker, color=colour, markersize=5)
    finish_axes(ax, y=label(name, unit), zero=False)
    values = [m["parameters"][name]["value"] for m in models]
    if values and all(value is not None for value in values):
        # A very wide interval must not compress the scale of all values.
        low, high = float(np.min(values)), float(np.max(values))
        margin = max(high - low, 0.5 * abs(high))
        bottom, top = ax.get_ylim()
        ax.set_ylim(max(bottom, low - margin), min(top, high + margin))
