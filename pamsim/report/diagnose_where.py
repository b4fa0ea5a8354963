"""Figures of where a simulation misses: channels against protocols, residuals over quantities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from pamsim.recordings.signals import kind_of
from pamsim.report.numbers import p_is, significant, unit, words
from pamsim.report.style import (
    BLUE,
    INK,
    MUTED,
    finish_axes,
    new_figure,
    styled,
)

MOST_MAPS = 6
SIGNIFICANT = 0.05
"""p-value up to which a cell or a map counts as a significant gap."""

_FULL = (4.0, 20.0)  # range of the noise floors at which the colour is full
_DARK = 0.6  # share of the colours, from pale to full, from which on text must be white


@styled
def where_map(where: Sequence[Mapping[str, Any]], given: Sequence[Mapping[str, Any]]) -> Figure:
    """Residual of the base model in noise floors, channel by protocol.

    Args:
        where: entries of a result of schema ``pamsim-diagnosis/2``.
        given: the same with the simulation driven by the measured pressures; may be empty.
    """
    panels = [("whole simulation", where)]
    if given:
        panels.append(("arm alone, driven by the measured pressures", given))
    rows = [len(_names(cells, "channel")) for _, cells in panels]
    figure, axes = new_figure(
        1.7 + 0.36 * sum(rows) + 0.35 * len(panels),
        rows=len(panels),
        sharex=True,
        height_ratios=tuple(float(count) for count in rows),
    )
    protocols = _names(where, "protocol")
    most = max((_ratio(cell) for _, cells in panels for cell in cells), default=2.0)
    full = min(max(most, _FULL[0]), _FULL[1])
    norm = LogNorm(vmin=1.0, vmax=full)
    image = None
    for ax, (title, cells) in zip(axes, panels, strict=True):
        image = _heat(ax, cells, protocols, norm, dark=full**_DARK)
        ax.set_title(title)
    axes[-1].set_xticks(
        range(len(protocols)), [words(p) for p in protocols], rotation=35, ha="right",
        rotation_mode="anchor",
    )  # fmt: skip
    assert image is not None
    bar = figure.colorbar(image, ax=axes, shrink=0.9, label="RMS / noise floor", extend="max")
    ticks = [t for t in (1.0, 2.0, 5.0, 10.0, 20.0) if t <= full]
    bar.set_ticks(ticks, labels=[f"{t:g}" for t in ticks])
    bar.minorticks_off()
    return figure


def _names(cells: Sequence[Mapping[str, Any]], key: str) -> list[str]:
    return sorted({str(cell[key]) for cell in cells})


def _ratio(cell: Mapping[str, Any]) -> float:
    return float(np.sqrt(max(1.0 + cell["excess"], 0.0)))


def _heat(
    ax: Axes,
    cells: Sequence[Mapping[str, Any]],
    protocols: Sequence[str],
    norm: LogNorm,
    *,
    dark: float,
) -> Any:
    channels = _names(cells, "channel")
    values = np.full((len(channels), len(protocols)), np.nan)
    for cell in cells:
        i, j = channels.index(cell["channel"]), protocols.index(cell["protocol"])
        values[i, j] = max(_ratio(cell), 1.0)
        significant_cell = cell["p_value"] <= SIGNIFICANT
        ax.text(
            j, i, significant(_ratio(cell), 2), ha="center", va="center", fontsize=8,
            fontweight="bold" if significant_cell else "normal",
            color="white" if values[i, j] > dark else INK if significant_cell else MUTED,
        )  # fmt: skip
    image = ax.imshow(values, cmap="OrRd", norm=norm, aspect="auto")
    ax.set_yticks(range(len(channels)), [words(c) for c in channels])
    ax.tick_params(length=0)
    for spine in ax.spines.values():
        spine.set_visible(False)
    return image


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
