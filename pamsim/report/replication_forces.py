"""Figures of Sarosi: its force laws at 1 to 6 bar, and the inverse."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from pamsim.report.style import finish_axes, new_figure, styled


@styled
def force_laws(curves: Mapping[str, Any]) -> Figure:
    """Figures 4 and 6: force over contraction by three laws.

    Args:
        curves: ``contraction_percent`` (n,) [%]; ``ideal``, ``corrected``, ``exponential``:
            pressure -> force (n,) [N].

    Returns:
        Three panels of one scale, force [N] against contraction [%].
    """
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
def inverse_law(curves: Mapping[str, Any]) -> Figure:
    """Equation (5): the pressure that gives a wanted force.

    Args:
        curves: ``contraction_percent`` (n,) [%]; ``inverse``: force -> pressure (n,) [bar], NaN
            where none gives it.

    Returns:
        One panel, gauge pressure [bar] against contraction [%].
    """
    figure, (ax,) = new_figure(3.6)
    finish_axes(ax, x="contraction [%]", y="gauge pressure by (5) [bar]")
    _family(ax, curves["contraction_percent"], curves["inverse"])
    ax.set_ylim(0.0, 8.2)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), title="wanted force")
    return figure


def _family(ax: Any, x: Any, family: Mapping[str, Any]) -> None:
    """Curves of one rising quantity: one scale of colours, dark for the largest."""
    colours = matplotlib.colormaps["viridis_r"]
    for index, (label, y) in enumerate(family.items()):
        # From 0.15: the lightest end of the scale is too pale for a line on white.
        ax.plot(x, y, color=colours(0.15 + 0.85 * index / max(1, len(family) - 1)), label=label)
