"""The frequency response of an identified model with its 95 % band."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from pamsim.report.identify_figures import label
from pamsim.report.identify_view import model_title
from pamsim.report.style import MUTED, VERMILION, finish_axes, new_figure, styled


@styled
def bode(result: Mapping[str, Any], curves: Mapping[str, Any]) -> Figure:
    """Magnitude and phase of the shown model.

    Args:
        result: of schema ``pamsim-identify/1``.
        curves: ``frequency`` (k,) [rad/s], ``magnitude`` (k,) [gain], ``phase`` (k,) [deg], their
            bands (2, k) or None, and ``nyquist`` [rad/s].

    Returns:
        Two panels on one logarithmic axis of frequency in Hz.
    """
    figure, (upper, lower) = new_figure(4.6, rows=2, sharex=True)
    model = next(m for m in result["models"] if m["name"] == result["shown"])
    unit = next(p for p in model["parameters"].values() if p["name"] == "K")["unit"]
    hertz = np.asarray(curves["frequency"]) / (2.0 * np.pi)
    for ax, key in ((upper, "magnitude"), (lower, "phase")):
        band = curves[f"{key}_band"]
        if band is not None:
            ax.fill_between(
                hertz, band[0], band[1], color=VERMILION, alpha=0.2, linewidth=0, label="95 % band"
            )
        ax.plot(hertz, curves[key], color=VERMILION, label=model_title(model["name"]))
        ax.set_xscale("log")
        ax.grid(True, axis="x")
    nyquist = curves["nyquist"] / (2.0 * np.pi)
    corners = sorted({round(abs(complex(*p)), 9) for p in model["poles_rad_per_s"]})
    for number, corner in enumerate(corners):
        for ax in (upper, lower):
            ax.axvline(
                corner / (2.0 * np.pi),
                color=MUTED,
                linewidth=0.8,
                linestyle=":",
                label="corner frequency" if number == 0 else None,
            )
    upper.set_yscale("log")
    finish_axes(upper, y=label("magnitude", unit), zero=False)
    finish_axes(lower, x="frequency [Hz]", y="phase [deg]", zero=False)
    span = float(np.ptp(curves["phase"]))
    if span < 720.0:
        lower.yaxis.set_major_locator(MultipleLocator(45.0 if span < 300.0 else 90.0))
    lower.set_xlim(hertz[0], min(hertz[-1], nyquist))
    upper.legend(loc="lower left")
    return figure
