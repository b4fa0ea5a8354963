"""Figures of Van Damme 2008: Preisach plane, major loop and force of a pleated muscle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
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


@styled
def plane_and_loop(curves: Mapping[str, Any]) -> Figure:
    """Figures 13 and 11: the plane with its staircase, and the major loop with its line.

    Args:
        curves: ``plane``: levels (n,), weight and relays (n, n), row alpha, column beta;
            ``major``: input, rising, falling, line (n,) [-].

    Returns:
        Two panels: alpha against beta, and output against input.
    """
    figure, (left, right) = new_figure(3.7, columns=2)
    plane, major = curves["plane"], curves["major"]
    levels, weight = plane["levels"], plane["weight"]
    below = np.tril(np.ones_like(weight)) > 0
    finish_axes(
        left, x="switches down at β", y="switches up at α", title="plane and staircase", zero=False
    )
    mesh = left.pcolormesh(
        levels,
        levels,
        np.where(below, weight, np.nan),
        cmap="Greys",
        vmin=0.0,
        vmax=1.4,
        rasterized=True,
    )
    mesh.set_edgecolor("face")
    left.contourf(
        levels,
        levels,
        np.where(below, plane["relays"], np.nan),
        levels=[0.0, 2.0],
        colors=[BLUE],
        alpha=0.35,
    )
    left.contour(
        levels, levels, np.where(below, weight, np.nan), levels=5, colors=INK, linewidths=0.5
    )
    left.annotate("$P_+$", (-0.85, -0.2), color=INK, fontsize=12)
    left.annotate("$P_-$", (-0.85, 0.85), color=INK, fontsize=12)
    left.set_aspect("equal")
    left.grid(False)
    finish_axes(right, x="input $ε_s$ [-]", y="output W [-]", title="major loop")
    right.plot(major["input"], major["rising"], color=BLUE, label="rising")
    right.plot(major["input"], major["falling"], color=VERMILION, label="falling")
    right.plot(
        major["input"], major["line"], color=INK, linewidth=1.0, linestyle="--", label="$W^{fit}$"
    )
    right.legend(loc="upper left")
    return figure


@styled
def force_loops(curves: Mapping[str, Any]) -> Figure:
    """Figures 14 and 15: loops of the force function, and of the force.

    Args:
        curves: ``loops``: fibres -> contraction_percent, value, inner_percent, inner_value;
            ``static``: contraction_percent, value; ``delta`` by fibres; ``forces``: pressure ->
            contraction_percent [%], force_n [N].

    Returns:
        Three panels over contraction [%]: f_t0 with 40 and with 25 fibres, and the force [N].
    """
    figure, panels = new_figure(3.4, columns=3)
    for ax, (fibres, loop), colour in zip(
        panels[:2], curves["loops"].items(), (BLUE, GREEN), strict=True
    ):
        delta = curves["delta"][fibres]
        finish_axes(ax, x="contraction [%]", y="$f_{t0}$ [-]", title=f"N = {fibres}, δ = {delta:g}")
        ax.axvspan(7.0, 20.0, color=FAINT, zorder=0)
        ax.plot(loop["contraction_percent"], loop["value"], color=colour, label="major")
        ax.plot(
            loop["inner_percent"],
            loop["inner_value"],
            color=VERMILION,
            linewidth=1.1,
            label="7–20 %",
        )
        static = curves["static"]
        ax.plot(
            static["contraction_percent"],
            static["value"],
            "--",
            color=INK,
            linewidth=0.8,
            label="(2)",
        )
        ax.set_ylim(0.0, 1.75)
        ax.legend(loc="upper right")
    finish_axes(panels[2], x="contraction [%]", y="force [N]", title="N = 25")
    for index, (label, each) in enumerate(curves["forces"].items()):
        panels[2].plot(
            each["contraction_percent"], each["force_n"], color=series_look(index)[0], label=label
        )
    panels[2].legend(loc="upper right")
    return figure


@styled
def exact_shape(curves: Mapping[str, Any]) -> Figure:
    """Figure 2: the exact force function and the polynomial (2) fitted to it.

    Args:
        curves: ``exact``: contraction_percent (n,) [%], exact and polynomial (n,) [-],
            range_percent (2,) of the fit.

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
