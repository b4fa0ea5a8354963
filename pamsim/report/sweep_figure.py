"""The figure of a sweep: each output over each factor, a point for every run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pamsim.report.style import finish_axes, new_figure, save_png, say_empty, series_look, styled
from pamsim.sweeps.result import SweepResult
from pamsim.sweeps.varied_rig import RIG

_MOST = 4
"""Outputs and factors that are drawn."""

_POINTS = 5_000
"""Runs that are drawn; of more, evenly spaced ones."""


def write_sweep_figure(result: SweepResult, folder: Path) -> Path:
    """Draw a sweep into ``sweep.png`` of a folder.

    Returns:
        The path written.

    Raises:
        InputError: if the place cannot be written.
    """
    path = folder / "sweep.png"
    save_png(sweep_figure(result), path)
    return path


@styled
def sweep_figure(result: SweepResult) -> Figure:
    """A row of panels per output that varies, a column per factor, those that matter first."""
    columns = result.columns()
    outputs = list(result.rank_correlations)[:_MOST]  # without those that do not vary
    if not outputs:
        figure, (ax,) = new_figure(2.5)
        say_empty(ax, "no output varies: see the column message of the table")
        return figure
    factors = _first(result, outputs)
    figure, axes = new_figure(0.6 + 2.0 * len(outputs), rows=len(outputs), columns=len(factors))
    every = max(1, result.runs // _POINTS)
    for place, ax in enumerate(axes):
        row, column = divmod(place, len(factors))
        output, factor = outputs[row], factors[column]
        x, names = _places(columns[factor][::every])
        colour, _ = series_look(column)
        ax.plot(x, columns[output][::every], ".", markersize=3, color=colour, alpha=0.6)
        if names:
            ax.set_xticks(range(len(names)), names)
        last = row == len(outputs) - 1
        unit = result.factors[factor]
        finish_axes(
            ax,
            x=f"{factor}\n[{unit}]" if last and unit else factor if last else "",
            y=f"{output} [{result.outputs[output].unit}]" if column == 0 else "",
            zero=False,
        )
    return figure


def _first(result: SweepResult, outputs: list[str]) -> list[str]:
    """Factors with the largest rank correlations with these outputs."""
    ranks = result.rank_correlations

    def most(name: str) -> float:
        own = [abs(ranks[output].get(name, 0.0)) for output in outputs]
        return -max(own) if name != RIG else -np.inf

    return sorted(result.factors, key=most)[:_MOST]


def _places(values: NDArray[np.generic]) -> tuple[NDArray[np.float64], list[str]]:
    """Where points lie; of names, their numbers and the names."""
    if values.dtype.kind in "fi":
        return values.astype(float), []
    names, places = np.unique(values.astype(str), return_inverse=True)
    return places.astype(float), names.tolist()
