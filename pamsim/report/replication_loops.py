"""Figures of Nguyen 2024, Van Damme 2008 and Sarosi: force over displacement or contraction.

Each draws what ``figures.curves`` and ``figures.bench_curves`` of the paper's room return.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamsim.report.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    MUTED,
    VERMILION,
    finish_axes,
    new_figure,
    series_look,
    styled,
)

Curves = Mapping[str, Any]

_DASHES = ("-", (0, (5, 2)), (0, (1, 1.4)), (0, (5, 1.5, 1, 1.5)))
_THIN: dict[str, Any] = {"color": INK, "linewidth": 0.8}


@styled
def loops_by_order(curves: Curves) -> Figure:
    """Nguyen 2024, Figure 3: loops for three orders, force [N] against displacement [mm]."""
    figure, (ax,) = new_figure(3.6)
    finish_axes(ax, x="displacement x [mm]", y="force F [N]")
    _loops(ax, curves["by_order"], "α = ")
    return figure


@styled
def loops_by_test(curves: Curves) -> Figure:
    """Nguyen 2024, Figures 11 and 12, and what their claims come down to.

    Returns:
        Four panels: both families of loops, dynamic stiffness and relative width over frequency.
    """
    figure, (first, second, stiffness, width) = new_figure(6.2, 2, 2)
    for ax, key, title in (
        (first, "by_amplitude", "3.5 Hz, four amplitudes"),
        (second, "by_frequency", "125 N, four frequencies"),
    ):
        finish_axes(ax, x="displacement [mm]", y="force [N]", title=title)
        _loops(ax, curves[key])
    frequency = curves["frequency_hz"]
    finish_axes(
        stiffness, x="frequency [Hz]", y="|K*| [N/m]", title="dynamic stiffness", zero=False
    )
    stiffness.plot(frequency, curves["stiffness_n_per_m"], color=BLUE)
    finish_axes(
        width, x="frequency [Hz]", y="[% of amplitude]", title="half width of the loop at F = 0"
    )
    width.plot(frequency, curves["loss_percent"], color=VERMILION)
    width.set_ylim(0.0, None)
    return figure


def _loops(ax: Axes, loops: Mapping[str, Any], prefix: str = "") -> None:
    for index, (label, (x, force)) in enumerate(loops.items()):
        dashes = _DASHES[index % len(_DASHES)]
        ax.plot(x, force, color=series_look(index)[0], linestyle=dashes, label=prefix + label)
    ax.axvline(0.0, color=MUTED, linewidth=0.7, zorder=1)
    ax.legend(loc="upper left")  # every loop runs from the lower left to the upper right


@styled
def nguyen2024_bench(curves: Curves) -> Figure:
    """The slow stroke on shut-in air, and cycles of the fractional Maxwell element.

    Returns:
        Four panels: pressure [bar] and force [N] over length [mm], loops [N over mm], lost work
        [mJ] over frequency [Hz].
    """
    figure, (pressure, force, loops, area) = new_figure(6.2, 2, 2)
    own = curves["bench"]
    length = own["stroke"]["length_mm"]
    for ax, key, label, title in (
        (pressure, "pressure_bar", "gauge pressure [bar]", "Figure 7: air shut in"),
        (force, "force_n", "force from the start [N]", "Figure 9: force of that air"),
    ):
        finish_axes(ax, x="length [mm]", y=label, title=title)
        _beside(ax, length, own["stroke"][key], "(2) to (5)", every=20)
    pressure.legend(loc="upper left")
    finish_axes(loops, x="displacement [mm]", y="force of the rubber [N]", title="cycles of ±2 mm")
    for index, (label, each) in enumerate(own["loops"].items()):
        colour, marker = series_look(index)
        x = each["displacement_mm"]
        loops.plot(x, each["law_n"], color=colour)
        loops.plot(x[::10], each["force_n"][::10], marker, color=colour, markersize=3, label=label)
    loops.plot([], [], color=INK, label="(9)")
    loops.legend(loc="upper left", title="engine at")
    finish_axes(area, x="frequency [Hz]", y="lost per cycle [mJ]", title="area of the loop")
    _beside(area, own["frequency_hz"], own["area_mj"], "(9)", every=1)
    area.set_xscale("log")
    area.set_ylim(0.0, None)
    area.legend(loc="upper right")
    return figure


def _beside(ax: Axes, x: Any, both: Mapping[str, Any], law: str, *, every: int) -> None:
    """A law as a line, and the engine at every so many points."""
    look: dict[str, Any] = {"color": VERMILION, "markersize": 4}
    ax.plot(x, both["law"], color=BLUE, label=law)
    ax.plot(x[::every], both["engine"][::every], "o", **look, label="engine")


@styled
def plane_and_loop(curves: Curves) -> Figure:
    """Van Damme 2008, Figures 13 and 11: the plane with its staircase, the loop with its line.

    Returns:
        Two panels: alpha against beta, and output against input.
    """
    figure, (left, right) = new_figure(3.7, columns=2)
    plane, major = curves["plane"], curves["major"]
    levels = plane["levels"]
    below = np.tril(np.ones_like(plane["weight"])) > 0
    weight, relays = (np.where(below, plane[key], np.nan) for key in ("weight", "relays"))
    finish_axes(
        left, x="switches down at β", y="switches up at α", title="plane and staircase", zero=False
    )
    mesh = left.pcolormesh(
        levels, levels, weight, cmap="Greys", vmin=0.0, vmax=1.4, rasterized=True
    )
    mesh.set_edgecolor("face")
    left.contourf(levels, levels, relays, levels=[0.0, 2.0], colors=[BLUE], alpha=0.35)
    left.contour(levels, levels, weight, levels=5, colors=INK, linewidths=0.5)
    left.annotate("$P_+$", (-0.85, -0.2), color=INK, fontsize=12)
    left.annotate("$P_-$", (-0.85, 0.85), color=INK, fontsize=12)
    left.set_aspect("equal")
    left.grid(False)
    finish_axes(right, x="input $ε_s$ [-]", y="output W [-]", title="major loop")
    right.plot(major["input"], major["rising"], color=BLUE, label="rising")
    right.plot(major["input"], major["falling"], color=VERMILION, label="falling")
    right.plot(major["input"], major["line"], "--", color=INK, linewidth=1.0, label="$W^{fit}$")
    right.legend(loc="upper left")
    return figure


@styled
def force_loops(curves: Curves) -> Figure:
    """Van Damme 2008, Figures 14 and 15: loops of the force function, and of the force.

    Returns:
        Three panels over contraction [%]: f_t0 with 40 and with 25 fibres, and the force [N].
    """
    figure, (*panels, force) = new_figure(3.4, columns=3)
    x = curves["contraction_percent"]
    for ax, (fibres, loop), colour in zip(
        panels, curves["loops"].items(), (BLUE, GREEN), strict=True
    ):
        title = f"N = {fibres}, δ = {loop['delta']:g}"
        finish_axes(ax, x="contraction [%]", y="$f_{t0}$ [-]", title=title)
        ax.axvspan(7.0, 20.0, color=FAINT, zorder=0)
        ax.plot(x, loop["value"], color=colour, label="major")
        inner = loop["inner_percent"], loop["inner_value"]
        ax.plot(*inner, color=VERMILION, linewidth=1.1, label="7–20 %")
        ax.plot(x, curves["static"], "--", **_THIN, label="(2)")
        ax.set_ylim(0.0, 1.75)
        ax.legend(loc="upper right")
    finish_axes(force, x="contraction [%]", y="force [N]", title="N = 25")
    for index, (label, each) in enumerate(curves["forces"].items()):
        force.plot(x, each, color=series_look(index)[0], label=label)
    force.legend(loc="upper right")
    return figure


@styled
def exact_shape(curves: Curves) -> Figure:
    """Van Damme 2008, Figure 2: the exact force function and the polynomial (2) fitted to it.

    Returns:
        Force function [-] above, relative difference [%] below, over contraction [%].
    """
    figure, (upper, lower) = new_figure(4.6, rows=2, sharex=True, height_ratios=(1.7, 1.0))
    data = curves["exact"]
    x, exact, polynomial = data["contraction_percent"], data["exact"], data["polynomial"]
    finish_axes(upper, y="$f_{t0}$ [-]")
    finish_axes(lower, x="contraction [%]", y="(2) over exact − 1 [%]")
    for ax in (upper, lower):
        ax.axvspan(*data["range_percent"], color=FAINT, zorder=0)
    upper.plot(x, exact, color=BLUE, label="exact shape, many fibres")
    upper.plot(x, polynomial, "--", color=VERMILION, label="(2), fitted in the grey range")
    upper.set_ylim(-0.2, 4.0)
    upper.legend(loc="upper right")
    pulls = exact > 0.02  # at the end of the stroke a relative difference has no meaning
    lower.plot(x[pulls], 100.0 * (polynomial[pulls] / exact[pulls] - 1.0), color=MUTED)
    lower.set_ylim(-5.0, 10.0)
    return figure


@styled
def vandamme2008_bench(curves: Curves) -> Figure:
    """Tensile loops: Figures 3, 9 and 10.

    Returns:
        Three panels over contraction [%]: force [N], force function [-], relative error [%].
    """
    figure, (forces, function, error) = new_figure(4.0, columns=3)
    own = curves["bench"]
    x, whole = own["contraction_percent"], slice(*own["whole"])
    finish_axes(forces, x="contraction [%]", y="force [N]", title="Figure 3, N = 25")
    for index, (label, force) in enumerate(own["force_n"].items()):
        forces.plot(x[whole], force[whole], color=series_look(index)[0], label=label)
        forces.plot(x[whole], own["static_n"][label][whole], "--", **_THIN)
    forces.plot([], [], "--", **_THIN, label="(1), (2)")
    forces.legend(loc="upper right")
    finish_axes(function, x="contraction [%]", y="$f_{t0}$ [-]", title="Figure 9, 1.5 bar")
    finish_axes(error, x="contraction [%]", y="e [%]", title="Figure 10, 1.5 bar")
    for (fibres, each), colour in zip(own["loops"].items(), (BLUE, GREEN), strict=True):
        engine: dict[str, Any] = {"color": colour, "label": f"engine, N = {fibres}"}
        function.plot(x[whole], each["function"][whole], **engine)
        error.plot(x, each["law_percent"], color=colour, linewidth=1.0)
        error.plot(x[::8], each["error_percent"][::8], "o", markersize=2.5, **engine)
    function.plot(x[whole], own["fit"][whole], "--", **_THIN, label="(2)")
    function.legend(loc="upper right")
    error.plot([], [], color=MUTED, linewidth=1.0, label="(6), relay by relay")
    error.set_ylim(-16.0, 11.0)
    error.legend(loc="lower center")
    return figure


@styled
def force_laws(curves: Curves) -> Figure:
    """Sarosi, Figures 4 and 6: force [N] over contraction [%] by three laws, on one scale."""
    figure, panels = new_figure(3.7, columns=3, sharey=True)
    laws = (
        ("ideal", "(1) ideal"),
        ("corrected", "(2) corrected"),
        ("exponential", "(4) exponential"),
    )
    for ax, (key, title) in zip(panels, laws, strict=True):
        finish_axes(ax, x="contraction [%]", title=title)
        _family(ax, curves["contraction_percent"], curves[key])
    panels[0].set_ylabel("force [N]")
    panels[0].set_ylim(-150.0, 1900.0)
    panels[2].legend(loc="upper right")
    return figure


@styled
def inverse_law(curves: Curves) -> Figure:
    """Sarosi (5): the gauge pressure [bar] that gives a wanted force, over contraction [%]."""
    figure, (ax,) = new_figure(3.6)
    finish_axes(ax, x="contraction [%]", y="gauge pressure by (5) [bar]")
    _family(ax, curves["contraction_percent"], curves["inverse"])
    ax.set_ylim(0.0, 8.2)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), title="wanted force")
    return figure


def _family(ax: Axes, x: Any, family: Mapping[str, Any]) -> None:
    """Curves of one rising quantity: one scale of colours, dark for the largest."""
    colours = matplotlib.colormaps["viridis_r"]
    for index, (label, y) in enumerate(family.items()):
        # From 0.15: the lightest end of the scale is too pale for a line on white.
        ax.plot(x, y, color=colours(0.15 + 0.85 * index / max(1, len(family) - 1)), label=label)


@styled
def sarosi_bench(curves: Curves) -> Figure:
    """Isometric and isotonic curves of the six-parameter law.

    Returns:
        Two panels: force [N] over contraction [%], and contraction [%] over pressure [bar].
    """
    figure, (held, hung) = new_figure(3.8, columns=2)
    own, colours = curves["bench"], matplotlib.colormaps["viridis_r"]
    finish_axes(held, x="contraction [%]", y="force [N]", title="held at a length")
    for index, (label, force) in enumerate(own["isometric"].items()):
        colour = colours(0.15 + 0.17 * index)
        held.plot(curves["contraction_percent"], curves["exponential"][label], color=colour)
        held.plot(own["held_percent"], force, "o", color=colour, markersize=3.5, label=label)
    held.set_ylim(-100.0, 1900.0)
    held.legend(loc="upper right", title="engine at")
    finish_axes(hung, x="gauge pressure [bar]", y="contraction [%]", title="under a weight")
    for index, (label, each) in enumerate(own["isotonic"].items()):
        colour, marker = series_look(index)
        x, half = each["contraction_percent"], len(each["contraction_percent"]) // 2 + 1
        hung.plot(each["inverse_bar"][:half], x[:half], color=colour)
        name = "rod alone" if index == 0 else label
        look = {"color": colour, "marker": marker, "linestyle": "", "markersize": 3.5}
        hung.plot(each["pressure_bar"][::16], x[::16], label=f"engine, {name}", **look)
    hung.plot([], [], color=INK, label="(4) and its inverse (5)")
    hung.legend(loc="lower right")
    return figure
