"""Figures of residuals over quantities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pamsim.recordings.signals import kind_of
from pamsim.report.numbers import p_is, unit, words
from pamsim.report.style import (
    BLUE,
    finish_axes,
    new_figure,
    styled,
)

MOST_MAPS = 6
SIGNIFICANT = 0.05
"""p-value up to which a map counts as a significant gap."""


def significant_maps(maps: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Maps that are drawn: the significant ones, entry per quantity and kind of channel.

    Args:
        maps: entries of a result of schema ``pamsim-diagnosis/2``, the most significant first.
    """
    chosen: dict[tuple[str, str], Mapping[str, Any]] = {}
    for entry in maps:
        if entry["p_value"] <= SIGNIFICANT:
            chosen.setdefault((kind_of(entry["channel"]), entry["quantity"]), entry)
    return list(chosen.values())[:MOST_MAPS]


@styled
def binned_maps(maps: Sequence[Mapping[str, Any]]) -> Figure:
    """Mean residual over bins of entry quantity, a panel per map.

    Args:
        maps: from `significant_maps`.
    """
    columns = min(2, len(maps))
    rows = -(-len(maps) // columns)
    figure, axes = new_figure(0.3 + 2.1 * rows, rows=rows, columns=columns)
    for ax in axes[len(maps) :]:
        ax.set_axis_off()
    for i, (ax, entry) in enumerate(zip(axes, maps, strict=False)):
        mean = np.array([np.nan if m is None else m for m in entry["mean"]], dtype=float)
        ax.stairs(np.nan_to_num(mean), entry["edges"], fill=True, color=BLUE, alpha=0.25)
        ax.stairs(mean, entry["edges"], baseline=None, color=BLUE, linewidth=1.4)
        shown = unit(entry["unit"])
        if entry["quantity"].endswith("direction"):
            ax.set_xticks([-1.0, 0.0, 1.0])
        finish_axes(
            ax,
            x=f"{words(entry['quantity'])}{f' [{shown}]' if shown else ''}",
            y=f"mean residual [{entry['mean_unit']}]" if i % columns == 0 else "",
            title=f"{words(entry['channel'])}, {p_is(entry['p_value'])}",
        )
    return figure
