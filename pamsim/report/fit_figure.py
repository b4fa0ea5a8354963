"""Page and figure of a fit: measured and fitted over pressure, and the residuals."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamsim.core.units import PA_PER_KPA
from pamsim.fitting.result import SCHEMA
from pamsim.report.numbers import NONE, fixed, interval, plain, quantity, significant, words
from pamsim.report.numbers import unit as unit_text
from pamsim.report.page import write_page
from pamsim.report.style import finish_axes, new_figure, series_look, styled
from pamsim.scene.series_colours import INK, MUTED

_MM_PER_M = 1e3
_MOST_SERIES = 8


def write_fit(result: Mapping[str, Any], out: Path) -> Path:
    """Write page and figure of a fit, schema ``pamsim-fit/2``, as `write_page`; return the page."""
    ranked = result["compared"] and result["kind"] == "force_map"
    shown = result["fits"][:1] if ranked else result["fits"]
    notes = [*result["notes"], *(note for one in shown for note in one["notes"])]
    notes += [f"{one['title']}: the search did not converge" for one in shown
              if not one["converged"]]  # fmt: skip
    ranking = {
        "title": "Laws by held-out error",
        "columns": ("law", "held out [N]", "worst [N]", "in-sample [N]", "AIC", "free"),
        "rows": [_ranked(one) for one in result["fits"]],
    }
    return write_page(
        out,
        "summary.html",
        result,
        lambda: {"fit": fit_figure(result)},
        schema=SCHEMA,
        headline=f"{'Best law' if ranked else 'Fit'}: {shown[0]['title']}",
        under=f"{result['file']}; {shown[0]['equation']}",
        tone="found" if all(one["converged"] for one in shown) else "open",
        facts=[fact for one in shown for fact in _facts(one)],
        caption=(
            "Data and fit.",
            "Measured and fitted values, and their differences",
            "Symbols: measured; lines: fitted. A pattern in the differences is physics that the"
            " law does not have.",
        ),
        notes=[*notes, *(f"not fitted: {law}: {why}" for law, why in result["skipped"].items())],
        tables=[*([ranking] if ranked else []), *map(_coefficients, shown)],
    )


def _ranked(one: Mapping[str, Any]) -> tuple[str, ...]:
    held, scores = one["held_out"] or {"rmse": None, "worst": None}, one["scores"]
    errors = (held["rmse"], held["worst"], scores["rmse"])
    return (
        one["title"],
        *(significant(error, 3) for error in errors),
        fixed(scores["aic"], 1),
        plain(scores["free"]),
    )


def _facts(one: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """What the law misses of data that it has not seen, and of those it has."""
    part = f", {one['part']} pressure" if one["part"] else ""
    scale, unit = (_MM_PER_M, "mm") if one["unit"] == "m" else (1.0, one["unit"])
    scores, held = one["scores"], one["held_out"]

    def error(value: float | None) -> str:
        return NONE if value is None else quantity(scale * value, unit, 3)

    counted = f"{scores['points']} points, {scores['free']} coefficients"
    seen = f"RMS error in-sample{part}", error(scores["rmse"]), counted
    if held is None:
        return [seen]
    unseen = f"RMS error, each {held['by']} held out in turn"
    return [(unseen, error(held["rmse"]), f"worst {held['by']} {error(held['worst'])}"), seen]


def _coefficients(one: Mapping[str, Any]) -> dict[str, Any]:
    part = f", {one['part']} pressure" if one["part"] else ""
    return {
        "title": f"Coefficients of {one['title']}{part}",
        "columns": ("coefficient", "value", "95 % interval", "unit", "warning"),
        "rows": [
            (
                c["name"],
                significant(c["value"], 4),
                "held" if c["held"] else interval(c["interval95"], 4) or "no interval",
                unit_text(c["unit"]),
                words(", ".join(c["flags"]))
                + (f" with {', '.join(c['partners'])}" if c["partners"] else ""),
            )
            for c in one["coefficients"]
        ],
    }


@styled
def fit_figure(result: Mapping[str, Any]) -> Figure:
    """Points with fitted curves, and residuals in-sample and held-out.

    The first fit is drawn, of a length loop all branches.
    """
    if result["kind"] == "force_loops":
        return _loops(result)
    figure, (top, bottom) = new_figure(6.6, rows=2, sharex=True, height_ratios=(1.5, 1.0))
    if result["kind"] == "force_map":
        _force_map(top, bottom, result["fits"][0])
    else:
        _branches(top, bottom, result["fits"])
    handles, labels = top.get_legend_handles_labels()
    top.legend(handles, labels, loc="best", ncols=2 if len(labels) > 5 else 1)
    return figure


def _force_map(top: Axes, bottom: Axes, law: Mapping[str, Any]) -> None:
    points = {name: np.array(values) for name, values in law["points"].items()}
    pressure = points["pressure"] / PA_PER_KPA
    held = (law["held_out"] or {}).get("residual")
    kinds = np.unique(points["contraction"])
    # Scattered contractions make one series; a map measured at set lengths one per length.
    few = kinds.size <= _MOST_SERIES
    for i, kind in enumerate(kinds if few else kinds[:1]):
        rows = points["contraction"] == kind if few else np.ones(pressure.size, dtype=bool)
        rows = np.flatnonzero(rows)[np.argsort(pressure[rows], kind="stable")]
        colour, marker = series_look(i)
        label = f"κ = {fixed(100.0 * kind, 1)} %" if few else "measured"
        dot = {"color": colour, "marker": marker, "linestyle": "none", "markersize": 3.6}
        top.plot(pressure[rows], points["measured"][rows], label=label, **dot)
        if few:
            top.plot(pressure[rows], points["predicted"][rows], color=colour, linewidth=1.0)
        else:
            top.plot(pressure[rows], points["predicted"][rows], ".", color=MUTED, markersize=2)
        bottom.plot(pressure[rows], (points["predicted"] - points["measured"])[rows], **dot)
        if held is not None:
            hollow = np.array([np.nan if held[r] is None else held[r] for r in rows])
            bottom.plot(pressure[rows], hollow, **dot, markerfacecolor="none", alpha=0.7)
    scores = law["scores"]
    title = f"{law['title']}: {scores['points']} points, {scores['free']} coefficients"
    finish_axes(top, y="force [N]", title=title, zero=False)
    text = f"filled: in-sample, {fixed(scores['rmse'], 1)} N RMS"
    if law["held_out"] is not None:
        by, rmse = law["held_out"]["by"], law["held_out"]["rmse"]
        text += f"; hollow: that {by} held out, {fixed(rmse, 1)} N RMS"
    finish_axes(bottom, x="gauge pressure [kPa]", y="fitted − measured [N]", title=text)
    shown = np.abs(points["predicted"] - points["measured"])
    _readable(bottom, max(1.3 * float(np.max(shown)), 10.0 * scores["rmse"]), held or [])


def _readable(ax: Axes, limit: float, held: list[float | None]) -> None:
    """Limit the axis where held-out residuals diverged, so that the other points stay visible."""
    sizes = [abs(residual) for residual in held if residual is not None]
    outside = sum(size > limit for size in sizes)
    if outside and max(sizes) > 2.0 * limit:  # a smaller excess stays visible
        ax.set_ylim(-limit, limit)
        ax.annotate(
            f"{outside} hollow points lie outside", (0.99, 0.03), xycoords="axes fraction",
            ha="right", va="bottom", color=MUTED, fontsize=8,
        )  # fmt: skip


def _branches(top: Axes, bottom: Axes, fits: list[Mapping[str, Any]]) -> None:
    for i, law in enumerate(fits):
        points = {name: np.array(values) for name, values in law["points"].items()}
        order = np.argsort(points["pressure"], kind="stable")
        pressure = points["pressure"][order] / PA_PER_KPA
        measured, predicted = points["measured"][order], points["predicted"][order]
        colour, marker = series_look(i)
        dot = {"color": colour, "marker": marker, "linestyle": "none", "markersize": 4.0}
        rms = fixed(_MM_PER_M * law["scores"]["rmse"], 2)
        label = f"{law['part']} pressure: {rms} mm RMS"
        top.plot(pressure, _MM_PER_M * measured, label=label, **dot)
        top.plot(pressure, _MM_PER_M * predicted, color=colour, linewidth=1.0)
        bottom.plot(pressure, _MM_PER_M * (predicted - measured), **dot)
    finish_axes(top, y="length [mm]", title=fits[0]["title"], zero=False)
    finish_axes(bottom, x="gauge pressure [kPa]", y="fitted − measured [mm]")


def _loops(result: Mapping[str, Any]) -> Figure:
    figure, (ax,) = new_figure(3.2)
    points = result["fits"][0]["points"]
    frequency = np.array(points["frequency"][::2]) / (2.0 * np.pi)
    for i, label in enumerate(
        ("equation (14), at the force's crest", "equation (15), at no force")
    ):
        colour, marker = series_look(i)
        ax.plot(
            frequency, points["predicted"][i::2], marker, color=colour, label=label, markersize=4.0
        )
    title = result["fits"][0]["title"]
    finish_axes(ax, x="frequency [Hz]", y="residual [N]", title=title)
    ax.legend(loc="best", labelcolor=INK)
    return figure
