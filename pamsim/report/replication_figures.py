"""Figures of the five source papers, redrawn from what their rooms compute.

Each draws what ``figures.curves`` and ``figures.bench_curves`` of the paper's room return.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.recordings.printed import distinct_steps
from pamsim.report.style import FAINT, finish_axes, new_figure, series_look, styled
from pamsim.scene.series_colours import BLUE, GREEN, INK, MUTED, PURPLE, VERMILION

Curves = Mapping[str, Any]
Drawing = Callable[[Curves], Figure]

FIGURES: dict[str, dict[str, Drawing]] = {}
"""Name of a paper -> file without ``.png`` -> what draws it from the paper's curves."""

DOTTED, DASHED = (0, (1, 1.6)), (0, (5, 2.5))
_DASHES = ("-", (0, (5, 2)), (0, (1, 1.4)), (0, (5, 1.5, 1, 1.5)))
_THIN: dict[str, Any] = {"color": INK, "linewidth": 0.8}
_BRANCHES = (("up", "rising", BLUE, "^"), ("down", "falling", VERMILION, "v"))
_LENGTH, _PRESSURE = "length [cm]", "gauge pressure [kPa]"


def _drawn(paper: str, name: str) -> Callable[[Drawing], Drawing]:
    def register(draw: Drawing) -> Drawing:
        return FIGURES.setdefault(paper, {}).setdefault(f"{paper}_{name}", styled(draw))

    return register


def equation_23(ax: Axes, figure6: Curves, bar: str, scaled: str) -> None:
    """Label the axes of Figure 6 and draw (23), read in bar and with the scale that fits best."""
    finish_axes(ax, x="pressure difference $p_{svd} = p_1 - p_2$ [kPa]", y="end angle β [deg]")
    ax.axvline(0.0, color=MUTED, linewidth=0.7, zorder=1)
    for unit, label, colour, dashes in (
        ("bar", bar, PURPLE, DOTTED),
        ("scaled", scaled, GREEN, DASHED),
    ):
        text = f"{label}: {figure6[f'rms_{unit}_deg']:.1f} deg RMS"
        y = figure6[f"eq23_{unit}_deg"]
        ax.plot(figure6["p_svd_kpa"], y, color=colour, linestyle=dashes, label=text)


@_drawn("matiskova2021", "static")
def static_law(curves: Curves) -> Figure:
    """Figure 6: equation (23) and the printed tables."""
    figure, (ax,) = new_figure(4.0)
    equation_23(ax, curves, "(23), p in bar", f"(23), unit {curves['scale_kpa']:.0f} kPa")
    for index, size in enumerate(("large", "medium", "small")):
        colour, marker = series_look(index)
        steps = [step for step in distinct_steps() if step.size == size]
        x = [(step.pressure[0] - step.pressure[1]) / PA_PER_KPA for step in steps]
        y = [step.angle * DEG_PER_RAD for step in steps]
        ax.plot(x, y, marker, color=colour, markersize=5, label=f"tables, {size} steps")
    ax.legend(loc="lower right")  # the characteristic rises: the lower right is free
    return figure


@_drawn("matiskova2021", "stiffness")
def joint_stiffness(curves: Curves) -> Figure:
    """Stiffness of the joint at the reference point, of the rig and of the ideal pair."""
    figure, panels = new_figure(3.2, columns=2)
    own = curves["stiffness"]
    titles = (("", "muscles of the rig"), ("ideal_", "ideal pair, equation (5)"))
    for ax, (kind, title) in zip(panels, titles, strict=True):
        finish_axes(ax, x="sum of pressures $p_1 + p_2$ [kPa]", title=title, zero=False)
        shut, held = own[f"{kind}shut"], own[f"{kind}held"]
        ax.plot(own["sum_kpa"], shut, color=BLUE, label="chambers shut")
        look = {"color": VERMILION, "linestyle": DASHED}
        ax.plot(own["sum_kpa"], held, **look, label="pressures held")
        ax.set_ylim(0.0, 1.15 * max(shut))
    panels[0].set_ylabel("stiffness at E [N m/rad]")
    panels[1].legend(loc="upper left")
    return figure


@_drawn("alraouf2025", "arctangent")
def arctangent_loop(curves: Curves) -> Figure:
    """Figures 5 to 7: lengths, arctangent branches and their residuals."""
    figure, (loop, published, refitted) = new_figure(6.4, 3, sharex=True, height_ratios=(2, 1, 1))
    finish_axes(loop, y=_LENGTH, zero=False)
    finish_axes(published, y="published −\nmean [cm]")
    finish_axes(refitted, x=_PRESSURE, y="refitted −\nmean [cm]")
    pressure, fine = curves["pressure_kpa"], curves["fine_kpa"]
    for shift, (branch, word, colour, marker) in enumerate(_BRANCHES):
        own = curves[branch]
        loop.errorbar(
            pressure + 6.0 * shift - 3.0,  # side by side, or the bars of both branches would merge
            own["mean_cm"],
            own["half_interval_cm"],
            fmt=marker,
            color=colour,
            markersize=5,
            elinewidth=0.8,
            label=f"Table 2, {word}",
        )
        loop.plot(fine, own["published_cm"], color=colour, linestyle=DOTTED)
        loop.plot(fine, own["refitted_cm"], color=colour, linewidth=1.2)
        for ax, key in ((published, "published"), (refitted, "refitted")):
            residual = own[f"{key}_residual_cm"]
            ax.plot(pressure, residual, color=colour, marker=marker, markersize=4.5, linewidth=0.9)
            ax.set_ylim(-0.5, 0.5)
            ax.axhspan(-0.3, 0.3, color=FAINT, zorder=0)
    loop.plot([], [], color=INK, linestyle=DOTTED, label="published (3), (4)")
    loop.plot([], [], color=INK, linewidth=1.2, label="refitted to Table 2")
    loop.legend(loc="upper right")
    return figure


@_drawn("alraouf2025", "bouc_wen")
def bouc_wen_loop(curves: Curves) -> Figure:
    """Figure 8: a static Bouc-Wen loop fitted to Table 2, free and held passive."""
    figure, panels = new_figure(3.4, columns=2, sharey=True)
    pressure = curves["pressure_kpa"]
    titles = (("bouc_wen", "best fit"), ("passive", "held passive, σ ≥ 1/2"))
    for ax, (key, title) in zip(panels, titles, strict=True):
        width = curves["width_cm"][key]
        finish_axes(ax, x=_PRESSURE, title=f"{title}: width {width:.3f} cm", zero=False)
        for branch, word, colour, marker in _BRANCHES:
            mean = curves[branch]["mean_cm"]
            fitted = mean + curves[branch][f"{key}_residual_cm"]
            ax.plot(pressure, mean, marker, color=colour, markersize=5, label=f"Table 2, {word}")
            dashes = "-" if branch == "up" else DASHED
            ax.plot(pressure, fitted, color=colour, linestyle=dashes, label=f"model, {word}")
    panels[0].set_ylabel(_LENGTH)
    panels[0].legend(loc="upper right")
    return figure


@_drawn("alraouf2025", "bench")
def alraouf2025_bench(curves: Curves) -> Figure:
    """The pressure loop of a hung muscle, beside Table 2 and the printed equations."""
    figure, (loop, off) = new_figure(5.0, 2, sharex=True, height_ratios=(2, 1))
    finish_axes(loop, y=_LENGTH, zero=False)
    finish_axes(off, x=_PRESSURE, y="less Table 2 [cm]")
    off.axhspan(-0.3, 0.3, color=FAINT, zorder=0)
    pressure = curves["pressure_kpa"]
    for branch, word, colour, marker in _BRANCHES:
        own, printed = curves["bench"][branch], curves[branch]
        mean = printed["mean_cm"]
        loop.plot(pressure, mean, marker, color=colour, markersize=5, label=f"Table 2, {word}")
        loop.plot(curves["fine_kpa"], printed["published_cm"], color=colour, linestyle=DOTTED)
        loop.plot(own["pressure_kpa"], own["length_cm"], color=colour, linewidth=1.2)
        look = {"color": colour, "marker": marker, "markersize": 3.5, "linewidth": 1.0}
        off.plot(pressure, own["mean_off_cm"], **look)
        off.plot(pressure, printed["published_residual_cm"], linestyle=DOTTED, **look)
    loop.plot([], [], color=INK, linewidth=1.2, label="engine")
    loop.plot([], [], color=INK, linestyle=DOTTED, label="printed (3), (4)")
    loop.legend(loc="upper right")
    return figure


@_drawn("nguyen2024", "order")
def loops_by_order(curves: Curves) -> Figure:
    """Figure 3: loops for three orders."""
    figure, (ax,) = new_figure(3.6)
    finish_axes(ax, x="displacement x [mm]", y="force F [N]")
    _loops(ax, curves["by_order"], "α = ")
    return figure


@_drawn("nguyen2024", "tests")
def loops_by_test(curves: Curves) -> Figure:
    """Figures 11 and 12, and what their claims come down to."""
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


@_drawn("nguyen2024", "bench")
def nguyen2024_bench(curves: Curves) -> Figure:
    """The slow stroke on shut-in air, and cycles of the fractional Maxwell element."""
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


@_drawn("vandamme2008", "plane")
def plane_and_loop(curves: Curves) -> Figure:
    """Figures 13 and 11: the plane with its staircase, the loop with its line."""
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


@_drawn("vandamme2008", "force")
def force_loops(curves: Curves) -> Figure:
    """Figures 14 and 15: loops of the force function with 40 and 25 fibres, and of the force."""
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


@_drawn("vandamme2008", "exact")
def exact_shape(curves: Curves) -> Figure:
    """Figure 2: the exact force function and the polynomial (2) fitted to it."""
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


@_drawn("vandamme2008", "bench")
def vandamme2008_bench(curves: Curves) -> Figure:
    """Tensile loops: Figures 3, 9 and 10."""
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


@_drawn("sarosi", "laws")
def force_laws(curves: Curves) -> Figure:
    """Figures 4 and 6: forces by three laws, on one scale."""
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


@_drawn("sarosi", "inverse")
def inverse_law(curves: Curves) -> Figure:
    """The gauge pressure that gives a wanted force, by (5)."""
    figure, (ax,) = new_figure(3.6)
    finish_axes(ax, x="contraction [%]", y="gauge pressure by (5) [bar]")
    _family(ax, curves["contraction_percent"], curves["inverse"])
    ax.set_ylim(0.0, 8.2)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), title="wanted force")
    return figure


def _family(ax: Axes, x: Any, family: Mapping[str, Any], line: str = "-", **look: Any) -> None:
    """Curves of one rising quantity: one scale of colours, dark for the largest."""
    colours = matplotlib.colormaps["viridis_r"]
    for index, (label, y) in enumerate(family.items()):
        # From 0.15: the lightest end of the scale is too pale for a line on white.
        colour = colours(0.15 + 0.85 * index / max(1, len(family) - 1))
        ax.plot(x, y, line, color=colour, label=label, **look)


@_drawn("sarosi", "bench")
def sarosi_bench(curves: Curves) -> Figure:
    """Isometric and isotonic curves of the six-parameter law."""
    figure, (held, hung) = new_figure(3.8, columns=2)
    own = curves["bench"]
    finish_axes(held, x="contraction [%]", y="force [N]", title="held at a length")
    _family(held, curves["contraction_percent"], curves["exponential"])
    _family(held, own["held_percent"], own["isometric"], "o", markersize=3.5)
    held.set_ylim(-100.0, 1900.0)
    held.legend(handles=held.lines[-len(own["isometric"]) :], loc="upper right", title="engine at")
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
