"""Figures of Matiskova 2021 and Alraouf 2025: an end position or stiffness over pressure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from pamsim.report.style import (
    BLUE,
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

_BRANCHES = (("up", "rising", BLUE, "^"), ("down", "falling", VERMILION, "v"))
_DOTTED, _DASHED = (0, (1, 1.6)), (0, (5, 2.5))


@styled
def static_law(curves: Mapping[str, Any]) -> Figure:
    """Figure 6: equation (23) and the printed tables.

    Args:
        curves: ``p_svd_kpa`` (n,) [kPa], ``eq23_bar_deg``, ``eq23_scaled_deg`` (n,) [deg],
            ``scale_kpa``, both RMS [deg], and ``rows``: size, p_svd_kpa, beta_deg.

    Returns:
        One panel, angle [deg] against p1 - p2 [kPa].
    """
    figure, (ax,) = new_figure(4.0)
    finish_axes(ax, x="pressure difference $p_{svd} = p_1 - p_2$ [kPa]", y="end angle β [deg]")
    ax.axvline(0.0, color=MUTED, linewidth=0.7, zorder=1)
    x, scale = curves["p_svd_kpa"], curves["scale_kpa"]
    bar = f"(23), p in bar: {curves['rms_bar_deg']:.1f} deg RMS"
    scaled = f"(23), unit {scale:.0f} kPa: {curves['rms_scaled_deg']:.1f} deg RMS"
    ax.plot(x, curves["eq23_bar_deg"], color=PURPLE, linestyle=_DOTTED, label=bar)
    ax.plot(x, curves["eq23_scaled_deg"], color=GREEN, linestyle=_DASHED, label=scaled)
    for index, size in enumerate(("large", "medium", "small")):
        colour, marker = series_look(index)
        chosen = [row for row in curves["rows"] if row["size"] == size]
        ax.plot(
            [row["p_svd_kpa"] for row in chosen],
            [row["beta_deg"] for row in chosen],
            marker,
            color=colour,
            markersize=5,
            label=f"tables, {size} steps",
        )
    ax.legend(loc="lower right")  # the characteristic rises: the lower right is free
    return figure


@styled
def joint_stiffness(curves: Mapping[str, Any]) -> Figure:
    """Stiffness of the joint at the reference point, of the rig and of the ideal pair.

    Args:
        curves: under ``stiffness``: ``sum_kpa`` (n,) [kPa]; ``held``, ``shut``, ``ideal_held``,
            ``ideal_shut`` (n,) [N m/rad].

    Returns:
        Two panels, stiffness [N m/rad] against p1 + p2 [kPa].
    """
    figure, panels = new_figure(3.2, columns=2)
    own = curves["stiffness"]
    titles = (("", "muscles of the rig"), ("ideal_", "ideal pair, equation (5)"))
    for ax, (kind, title) in zip(panels, titles, strict=True):
        finish_axes(ax, x="sum of pressures $p_1 + p_2$ [kPa]", title=title, zero=False)
        ax.plot(own["sum_kpa"], own[f"{kind}shut"], color=BLUE, label="chambers shut")
        ax.plot(
            own["sum_kpa"],
            own[f"{kind}held"],
            color=VERMILION,
            linestyle=_DASHED,
            label="pressures held",
        )
        ax.set_ylim(0.0, 1.15 * max(own[f"{kind}shut"]))
    panels[0].set_ylabel("stiffness at E [N m/rad]")
    panels[1].legend(loc="upper left")
    return figure


@styled
def arctangent_loop(curves: Mapping[str, Any]) -> Figure:
    """Figures 5 to 7: lengths, arctangent branches and their residuals.

    Args:
        curves: ``pressure_kpa`` (n,), ``fine_kpa`` (m,) [kPa]; under ``up`` and ``down`` the means
            with half intervals (n,), both curves (m,) and both residuals (n,) [cm].

    Returns:
        Length [cm] against pressure [kPa] above, model minus mean [cm] below.
    """
    figure, (loop, published, refitted) = new_figure(6.4, 3, sharex=True, height_ratios=(2, 1, 1))
    finish_axes(loop, y="length [cm]", zero=False)
    finish_axes(published, y="published −\nmean [cm]")
    finish_axes(refitted, x="gauge pressure [kPa]", y="refitted −\nmean [cm]")
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
        loop.plot(fine, own["published_cm"], color=colour, linestyle=_DOTTED)
        loop.plot(fine, own["refitted_cm"], color=colour, linewidth=1.2)
        for ax, key in ((published, "published"), (refitted, "refitted")):
            residual = own[f"{key}_residual_cm"]
            ax.plot(pressure, residual, color=colour, marker=marker, markersize=4.5, linewidth=0.9)
            ax.set_ylim(-0.5, 0.5)
            ax.axhspan(-0.3, 0.3, color="#f1f3f5", zorder=0)
    loop.plot([], [], color=INK, linestyle=_DOTTED, label="published (3), (4)")
    loop.plot([], [], color=INK, linewidth=1.2, label="refitted to Table 2")
    loop.legend(loc="upper right")
    return figure


@styled
def bouc_wen_loop(curves: Mapping[str, Any]) -> Figure:
    """Figure 8: a static Bouc-Wen loop fitted to Table 2, free and held passive.

    Args:
        curves: as in `arctangent_loop`, with ``bouc_wen_residual_cm`` and ``passive_residual_cm``
            (n,) [cm] of both branches, ``width_cm`` and ``sigma`` of both fits.

    Returns:
        Two panels, length [cm] against pressure [kPa].
    """
    figure, panels = new_figure(3.4, columns=2, sharey=True)
    pressure = curves["pressure_kpa"]
    titles = (("bouc_wen", "best fit"), ("passive", "held passive, σ ≥ 1/2"))
    for ax, (key, title) in zip(panels, titles, strict=True):
        width = curves["width_cm"][key]
        finish_axes(
            ax, x="gauge pressure [kPa]", title=f"{title}: width {width:.3f} cm", zero=False
        )
        for branch, word, colour, marker in _BRANCHES:
            mean = curves[branch]["mean_cm"]
            fitted = mean + curves[branch][f"{key}_residual_cm"]
            ax.plot(pressure, mean, marker, color=colour, markersize=5, label=f"Table 2, {word}")
            dashes = "-" if branch == "up" else _DASHED
            ax.plot(pressure, fitted, color=colour, linestyle=dashes, label=f"model, {word}")
    panels[0].set_ylabel("length [cm]")
    panels[0].legend(loc="upper right")
    return figure
