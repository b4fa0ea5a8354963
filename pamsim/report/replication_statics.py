"""Figures of Matiskova 2021 and Alraouf 2025: an end position or stiffness over pressure.

Each draws what `pamsim.papers.replicate.replication_figures` returns of its paper.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamsim.report.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    MUTED,
    PURPLE,
    VERMILION,
    finish_axes,
    new_figure,
    series_look,
    styled,
)

Curves = Mapping[str, Any]

_BRANCHES = (("up", "rising", BLUE, "^"), ("down", "falling", VERMILION, "v"))
DOTTED, DASHED = (0, (1, 1.6)), (0, (5, 2.5))
_LENGTH, _PRESSURE = "length [cm]", "gauge pressure [kPa]"


def equation_23(ax: Axes, figure6: Curves, bar: str, scaled: str) -> None:
    """Label the axes of Figure 6 and draw equation (23) in both units of pressure.

    Args:
        ax: the axes.
        figure6: what `static_characteristic` of the paper's room returns.
        bar: label of the curve read in bar.
        scaled: label of that with the scale that fits best.
    """
    finish_axes(ax, x="pressure difference $p_{svd} = p_1 - p_2$ [kPa]", y="end angle β [deg]")
    ax.axvline(0.0, color=MUTED, linewidth=0.7, zorder=1)
    for unit, label, colour, dashes in (
        ("bar", bar, PURPLE, DOTTED),
        ("scaled", scaled, GREEN, DASHED),
    ):
        text = f"{label}: {figure6[f'rms_{unit}_deg']:.1f} deg RMS"
        y = figure6[f"eq23_{unit}_deg"]
        ax.plot(figure6["p_svd_kpa"], y, color=colour, linestyle=dashes, label=text)


@styled
def static_law(curves: Curves) -> Figure:
    """Figure 6: equation (23) and the printed tables, angle [deg] against p1 - p2 [kPa]."""
    figure, (ax,) = new_figure(4.0)
    equation_23(ax, curves, "(23), p in bar", f"(23), unit {curves['scale_kpa']:.0f} kPa")
    for index, size in enumerate(("large", "medium", "small")):
        colour, marker = series_look(index)
        chosen = [row for row in curves["rows"] if row["size"] == size]
        points = ([row[key] for row in chosen] for key in ("p_svd_kpa", "beta_deg"))
        ax.plot(*points, marker, color=colour, markersize=5, label=f"tables, {size} steps")
    ax.legend(loc="lower right")  # the characteristic rises: the lower right is free
    return figure


@styled
def joint_stiffness(curves: Curves) -> Figure:
    """Stiffness of the joint at the reference point, of the rig and of the ideal pair.

    Returns:
        Two panels, stiffness [N m/rad] against p1 + p2 [kPa].
    """
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


@styled
def arctangent_loop(curves: Curves) -> Figure:
    """Figures 5 to 7: lengths, arctangent branches and their residuals.

    Returns:
        Length [cm] against pressure [kPa] above, model minus mean [cm] below.
    """
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


@styled
def bouc_wen_loop(curves: Curves) -> Figure:
    """Figure 8: a static Bouc-Wen loop fitted to Table 2, free and held passive.

    Returns:
        Two panels, length [cm] against pressure [kPa].
    """
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


@styled
def alraouf2025_bench(curves: Curves) -> Figure:
    """The pressure loop of a hung muscle, beside Table 2 and the printed equations.

    Returns:
        Length [cm] over pressure [kPa] above, distance from the means of Table 2 [cm] below.
    """
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
