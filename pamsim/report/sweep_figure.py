"""Page and figure of a sweep: each output over each factor, a point for every run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.report.numbers import fixed, plain, significant, unit
from pamsim.report.page import write_page
from pamsim.report.style import finish_axes, new_figure, say_empty, styled
from pamsim.scene.series_colours import INK
from pamsim.sweeps.job import RIG
from pamsim.sweeps.result import SCHEMA, SweepResult

_MOST = 4
"""Outputs and factors that are drawn."""

_POINTS = 5_000
"""Runs that are drawn; of more, evenly spaced ones."""


def write_sweep(result: SweepResult, out: Path) -> Path:
    """Write page and figure of a sweep as `write_page` does; return the page."""
    content = result.to_dict()
    outputs, ranks, sobol = (content[key] for key in ("outputs", "rank_correlations", "sobol"))
    return write_page(
        out,
        "summary.html",
        content,
        lambda: {"sweep": sweep_figure(result)},
        schema=SCHEMA,
        headline=f"Sweep over {', '.join(result.factors)}",
        under=f"Every run: {content['table']}, beside this page",
        tone="open" if result.failed else "found",
        facts=[
            ("runs", plain(result.runs), f"{result.failed} of them failed"),
            ("wall time", f"{fixed(result.seconds, 1)} s", f"{result.kept} runs kept from before"),
        ],
        caption=(
            "Outputs over factors.",
            "Each output against each factor, a point for every run",
            "Outputs that vary, over the factors with the largest rank correlations.",
        ),
        tables=[
            {
                "title": "Outputs",
                "columns": ("output", "unit", "least", "median", "largest", "runs"),
                "rows": [_summed(name, one) for name, one in outputs.items()],
            },
            _per_factor("Rank correlations (Spearman)", ranks),
            _per_factor(
                "Share of the variance (total Sobol' index)",
                {name: {f: i["total"] for f, i in own.items()} for name, own in sobol.items()},
            ),
        ],
    )


def _summed(name: str, one: Mapping[str, Any]) -> tuple[str, ...]:
    numbers = (significant(one[key], 4) for key in ("low", "median", "high"))
    return name, unit(one["unit"]), *numbers, plain(one["runs"])


def _per_factor(title: str, entries: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    factors = list(dict.fromkeys(factor for own in entries.values() for factor in own))
    rows = [(n, *(fixed(own.get(f), 2) for f in factors)) for n, own in entries.items()]
    return {"title": title, "columns": ("output", *factors), "rows": rows}


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
        ax.plot(x, columns[output][::every], ".", markersize=3, color=INK, alpha=0.6)
        if names:
            ax.set_xticks(range(len(names)), names)
        last = row == len(outputs) - 1
        of, made = unit(result.factors[factor]), unit(result.outputs[output].unit)
        finish_axes(
            ax,
            x=f"{factor}\n[{of}]" if last and of else factor if last else "",
            y=f"{output} [{made}]" if column == 0 and made else output if column == 0 else "",
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


def _places(values: NDArray[np.generic]) -> tuple[FloatArray, list[str]]:
    """Where points lie; of names, their numbers and the names."""
    if values.dtype.kind in "fi":
        return values.astype(float), []
    names, places = np.unique(values.astype(str), return_inverse=True)
    return places.astype(float), names.tolist()
