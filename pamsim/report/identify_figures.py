"""Figures of an identification over time: measured and model, and the model's step response."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from pamsim.report.identify_view import model_title
from pamsim.report.style import (
    BLUE,
    INK,
    MUTED,
    VERMILION,
    finish_axes,
    new_figure,
    say_empty,
    styled,
)

_MOST_TRIALS = 5


def label(quantity: str, unit: str) -> str:
    """Axis label; without a unit in it for a pure number."""
    return quantity if unit in ("", "1", "-") else f"{quantity} [{unit}]"


def shown_trials(trials: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The trials a figure has room for: held-out ones first, since they judge the model."""
    held = [trial for trial in trials if trial["held_out"]]
    return [*held, *(trial for trial in trials if not trial["held_out"])][:_MOST_TRIALS]


@styled
def measured_and_model(result: Mapping[str, Any], curves: Mapping[str, Any]) -> Figure:
    """Output and free run of the shown model on top, what is left below; a column pair per trial.

    Args:
        result: of schema ``pamsim-identify/1``.
        curves: ``trials`` with ``name``, ``held_out``, ``time`` [s], ``output`` and ``model``
            (n,) [unit of the output].

    Returns:
        For one trial two panels on top of each other, for more a row each.
    """
    unit = result["output"]["unit"]
    trials = shown_trials(curves["trials"])
    if len(trials) == 1:
        figure, panels = new_figure(4.8, rows=2, sharex=True, height_ratios=(1.7, 1.0))
    else:
        figure, panels = new_figure(0.7 + 1.45 * len(trials), rows=len(trials), columns=2)
    pairs = [(panels[2 * i], panels[2 * i + 1]) for i in range(len(trials))]
    for trial, (upper, lower) in zip(trials, pairs, strict=True):
        role = "held out" if trial["held_out"] else "fitted"
        upper.plot(
            trial["time"], trial["output"], color=INK, linewidth=2.6, alpha=0.35, label="measured"
        )
        upper.plot(trial["time"], trial["model"], color=VERMILION, linewidth=1.1, label="model")
        lower.plot(trial["time"], trial["model"] - trial["output"], color=BLUE, linewidth=0.8)
        title = f"{trial['name'].replace('_', ' ')} ({role})"
        last = len(trials) == 1 or trial is trials[-1]
        finish_axes(
            upper,
            y=label("output", unit),
            x="time [s]" if last and len(trials) > 1 else "",
            title=title,
            zero=False,
        )
        finish_axes(lower, y=label("difference", unit), x="time [s]" if last else "")
    handles, labels = pairs[0][0].get_legend_handles_labels()
    (difference,) = pairs[0][1].lines[:1]
    figure.legend(
        handles=[*handles, difference],
        labels=[*labels, "model − measured"],
        loc="outside upper right",
        ncols=3,
    )
    return figure


@styled
def step_and_poles(result: Mapping[str, Any], curves: Mapping[str, Any]) -> Figure:
    """Step response of the shown model with its 95 % band, and the poles of all models.

    Args:
        result: of schema ``pamsim-identify/1``.
        curves: ``step_time`` (k,) [s], ``step`` (k,) and ``step_band`` (2, k) or None [gain].

    Returns:
        Two panels side by side.
    """
    figure, (left, right) = new_figure(3.2, columns=2)
    model = next(m for m in result["models"] if m["name"] == result["shown"])
    gain = next(p for p in model["parameters"].values() if p["name"] == "K")
    time, step, band = curves["step_time"], curves["step"], curves["step_band"]
    if band is not None:
        left.fill_between(
            time, band[0], band[1], color=VERMILION, alpha=0.2, linewidth=0, label="95 % band"
        )
    left.plot(time, step, color=VERMILION, label=model_title(model["name"]))
    left.axhline(gain["value"], color=MUTED, linewidth=0.8, linestyle=":", label="static gain K")
    finish_axes(
        left,
        x="time after a unit step [s]",
        y=label("response", gain["unit"]),
        title="step response",
    )
    left.legend(loc="best")
    _poles(right, result)
    return figure


def _poles(ax: Axes, result: Mapping[str, Any]) -> None:
    """A row of poles per model: whether models agree shows where their marks line up."""
    models = result["models"]
    used: dict[str, Any] = {}
    for row, model in enumerate(models):
        colour = VERMILION if model["name"] == result["shown"] else MUTED
        for pole in model["poles_rad_per_s"]:
            if pole is None:
                continue
            kind, marker = _pole_look(complex(*pole))
            (used[kind],) = ax.plot(
                abs(complex(*pole)), row, marker, color=colour, markersize=6.5, markeredgewidth=1.4
            )
    finish_axes(ax, x="|pole| [rad/s]", title="poles", zero=False)
    ax.set_yticks(range(len(models)), [model_title(model["name"]) for model in models])
    ax.tick_params(axis="y", labelsize=7.5)
    ax.set_ylim(len(models) - 0.5, -0.5)
    if not used:
        say_empty(ax, "no pole")
        return
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
    if set(used) != {"lag"}:
        ax.legend(used.values(), used.keys(), loc="best")


def _pole_look(pole: complex) -> tuple[str, str]:
    if pole.real >= 0.0:
        return "unstable", "s"
    return ("conjugate pair", "D") if pole.imag else ("lag", "x")
