"""Figures of the papers' muscles on the bench: what the engine gives, beside law and print."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib
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

_DOTTED, _DASHED = (0, (1, 1.6)), (0, (5, 2.5))


@styled
def sarosi_bench(curves: Mapping[str, Any]) -> Figure:
    """Isometric and isotonic curves of the six-parameter law.

    Args:
        curves: of Sarosi, with ``bench``.

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


@styled
def alraouf2025_bench(curves: Mapping[str, Any]) -> Figure:
    """The pressure loop of a hung muscle, beside Table 2 and the printed equations.

    Args:
        curves: of Alraouf 2025, with ``bench``.

    Returns:
        Length [cm] over pressure [kPa] above, distance from the means of Table 2 [cm] below.
    """
    figure, (loop, off) = new_figure(5.0, 2, sharex=True, height_ratios=(2, 1))
    finish_axes(loop, y="length [cm]", zero=False)
    finish_axes(off, x="gauge pressure [kPa]", y="less Table 2 [cm]")
    off.axhspan(-0.3, 0.3, color=FAINT, zorder=0)
    for branch, word, colour, marker in (
        ("up", "rising", BLUE, "^"),
        ("down", "falling", VERMILION, "v"),
    ):
        own, printed = curves["bench"][branch], curves[branch]
        loop.plot(
            curves["pressure_kpa"],
            printed["mean_cm"],
            marker,
            color=colour,
            markersize=5,
            label=f"Table 2, {word}",
        )
        loop.plot(curves["fine_kpa"], printed["published_cm"], color=colour, linestyle=_DOTTED)
        loop.plot(own["pressure_kpa"], own["length_cm"], color=colour, linewidth=1.2)
        for values, dashes in (
            (own["mean_off_cm"], "-"),
            (printed["published_residual_cm"], _DOTTED),
        ):
            off.plot(
                curves["pressure_kpa"],
                values,
                color=colour,
                linestyle=dashes,
                marker=marker,
                markersize=3.5,
                linewidth=1.0,
            )
    loop.plot([], [], color=INK, linewidth=1.2, label="engine")
    loop.plot([], [], color=INK, linestyle=_DOTTED, label="printed (3), (4)")
    loop.legend(loc="upper right")
    return figure


@styled
def nguyen2024_bench(curves: Mapping[str, Any]) -> Figure:
    """The slow stroke on shut-in air, and cycles of the fractional Maxwell element.

    Args:
        curves: of Nguyen 2024, with ``bench``.

    Returns:
        Four panels: pressure [bar] and force [N] over length [mm], loops [N over mm], lost work
        [mJ] over frequency [Hz].
    """
    figure, (pressure, force, loops, area) = new_figure(6.2, 2, 2)
    own = curves["bench"]
    stroke = own["stroke"]
    for ax, key, label, title in (
        (pressure, "pressure_bar", "gauge pressure [bar]", "Figure 7: air shut in"),
        (force, "force_n", "force from the start [N]", "Figure 9: force of that air"),
    ):
        finish_axes(ax, x="length [mm]", y=label, title=title)
        ax.plot(stroke["length_mm"], stroke[key]["law"], color=BLUE, label="(2) to (5)")
        ax.plot(
            stroke["length_mm"][::20],
            stroke[key]["engine"][::20],
            "o",
            color=VERMILION,
            markersize=4,
            label="engine",
        )
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
    area.plot(own["frequency_hz"], own["area_mj"]["law"], color=BLUE, label="(9)")
    area.plot(
        own["frequency_hz"],
        own["area_mj"]["engine"],
        "o",
        color=VERMILION,
        markersize=4,
        label="engine",
    )
    area.set_xscale("log")
    area.set_ylim(0.0, None)
    area.legend(loc="upper right")
    return figure


@styled
def vandamme2008_bench(curves: Mapping[str, Any]) -> Figure:
    """Tensile loops: Figures 3, 9 and 10.

    Args:
        curves: of Van Damme 2008, with ``bench``.

    Returns:
        Three panels over contraction [%]: force [N], force function [-], relative error [%].
    """
    figure, (forces, function, error) = new_figure(4.0, columns=3)
    own = curves["bench"]
    x, whole = own["contraction_percent"], slice(*own["whole"])
    finish_axes(forces, x="contraction [%]", y="force [N]", title="Figure 3, N = 25")
    for index, (label, force) in enumerate(own["force_n"].items()):
        colour = series_look(index)[0]
        forces.plot(x[whole], force[whole], color=colour, label=label)
        forces.plot(x[whole], own["static_n"][label][whole], "--", color=INK, linewidth=0.8)
    forces.plot([], [], "--", color=INK, linewidth=0.8, label="(1), (2)")
    forces.legend(loc="upper right")
    finish_axes(function, x="contraction [%]", y="$f_{t0}$ [-]", title="Figure 9, 1.5 bar")
    finish_axes(error, x="contraction [%]", y="e [%]", title="Figure 10, 1.5 bar")
    for (fibres, each), colour in zip(own["loops"].items(), (BLUE, GREEN), strict=True):
        function.plot(
            x[whole], each["function"][whole], color=colour, label=f"engine, N = {fibres}"
        )
        error.plot(x, each["law_percent"], color=colour, linewidth=1.0)
        error.plot(
            x[::8],
            each["error_percent"][::8],
            "o",
            color=colour,
            markersize=2.5,
            label=f"engine, N = {fibres}",
        )
    function.plot(x[whole], own["fit"][whole], "--", color=INK, linewidth=0.8, label="(2)")
    function.legend(loc="upper right")
    error.plot([], [], color=MUTED, linewidth=1.0, label="(6), relay by relay")
    error.set_ylim(-16.0, 11.0)
    error.legend(loc="lower center")
    return figure
