"""Figures of Nguyen 2024: force-displacement loops of the fractional Maxwell element."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamsim.report.style import BLUE, MUTED, VERMILION, finish_axes, new_figure, series_look, styled

_DASHES = ("-", (0, (5, 2)), (0, (1, 1.4)), (0, (5, 1.5, 1, 1.5)))


@styled
def loops_by_order(curves: Mapping[str, Any]) -> Figure:
    """Figure 3: loops for three orders.

    Args:
        curves: ``by_order``: alpha -> displacement (n,) [mm] and force (n,) [N].

    Returns:
        One panel, force [N] against displacement [mm].
    """
    figure, (ax,) = new_figure(3.6)
    finish_axes(ax, x="displacement x [mm]", y="force F [N]")
    _draw(ax, curves["by_order"], "α = ")
    return figure


@styled
def loops_by_test(curves: Mapping[str, Any]) -> Figure:
    """Figures 11 and 12, and what their claims come down to.

    Args:
        curves: ``by_amplitude`` and ``by_frequency``: label -> displacement (n,) [mm] and force
            (n,) [N]; ``frequency_hz`` (m,), ``stiffness_n_per_m`` (m,), ``loss_percent`` (m,).

    Returns:
        Four panels: both families of loops, dynamic stiffness and relative width over frequency.
    """
    figure, (first, second, stiffness, width) = new_figure(6.2, 2, 2)
    finish_axes(first, x="displacement [mm]", y="force [N]", title="3.5 Hz, four amplitudes")
    _draw(first, curves["by_amplitude"])
    finish_axes(second, x="displacement [mm]", y="force [N]", title="125 N, four frequencies")
    _draw(second, curves["by_frequency"])
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


def _draw(ax: Axes, loops: Mapping[str, Any], prefix: str = "") -> None:
    for index, (label, (x, force)) in enumerate(loops.items()):
        dashes = _DASHES[index % len(_DASHES)]
        ax.plot(x, force, color=series_look(index)[0], linestyle=dashes, label=prefix + label)
    ax.axvline(0.0, color=MUTED, linewidth=0.7, zorder=1)
    ax.legend(loc="upper left")  # every loop runs from the lower left to the upper right
