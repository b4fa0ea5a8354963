"""Figures that separate families of effects: loop areas, and spectral lines of the residual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pamsim.report.numbers import unit, words
from pamsim.report.style import (
    BLUE,
    INK,
    MUTED,
    VERMILION,
    finish_axes,
    new_figure,
    styled,
)

_AGAINST = (
    ("amplitude_deg", "amplitude [deg]"),
    ("common_pressure_kpa", "common pressure [kPa]"),
    ("period_s", "period [s]"),
)
_BELOW = 0.05  # of an axis below zero, so that marks on it are whole
_LINES = (("excited", "o"), ("even", "s"), ("odd", "^"))


@styled
def loop_areas(loops: Sequence[Mapping[str, Any]]) -> Figure:
    """Areas of measured and simulated loops against amplitude, common pressure and period.

    Args:
        loops: entries of a result of schema ``pamsim-diagnosis/2``.
    """
    drives = list(dict.fromkeys(loop["drive"] for loop in loops))
    columns = len(_AGAINST)
    repaired = any(loop["after"] is not None for loop in loops)
    figure, axes = new_figure(
        0.55 + 2.0 * len(drives), rows=len(drives), columns=columns, sharey="row", sharex="col"
    )
    for row, drive in enumerate(drives):
        members = [loop for loop in loops if loop["drive"] == drive]
        for column, (key, label) in enumerate(_AGAINST):
            ax = axes[row * columns + column]
            _areas(ax, members, key)
            shown = unit(members[0]["unit"])
            finish_axes(
                ax,
                x=label if row == len(drives) - 1 else "",
                y=f"loop area [{shown}]" if column == 0 else "",
                title=f"angle over {words(drive)}" if column == 0 else "",
            )
            ax.margins(x=0.15)
    handles = [
        Line2D([], [], color=INK, marker="_", markersize=9, linestyle="none", label="measured"),
        Line2D([], [], color=VERMILION, marker="o", markerfacecolor="none", linestyle="none",
               label="before" if repaired else "simulated"),
    ]  # fmt: skip
    if repaired:
        handles.append(
            Line2D([], [], color=BLUE, marker="D", markersize=4, linestyle="none",
                   label="after the repair")
        )  # fmt: skip
    figure.legend(handles=handles, loc="outside upper right", ncols=3)
    return figure


def _areas(ax: Axes, loops: Sequence[Mapping[str, Any]], key: str) -> None:
    for loop in loops:
        at = loop[key]
        ax.errorbar(
            at, loop["measured"], yerr=loop["spread"], color=INK, marker="_", markersize=9,
            linewidth=1.0,
        )  # fmt: skip
        ax.plot(at, loop["before"], "o", color=VERMILION, markerfacecolor="none", markersize=5)
        if loop["after"] is not None:
            ax.plot(at, loop["after"], "D", color=BLUE, markersize=3.2)


@styled
def residual_lines(spectrum: Sequence[Mapping[str, Any]]) -> Figure:
    """Residuals of periodic protocols at excited, even and odd lines, beside their noise.

    Args:
        spectrum: entries of a result of schema ``pamsim-diagnosis/2``.
    """
    protocols = list(dict.fromkeys(entry["protocol"] for entry in spectrum))
    channels = list(dict.fromkeys(entry["channel"] for entry in spectrum))
    repaired = any(entry["after"] is not None for entry in spectrum)
    figure, axes = new_figure(
        0.7 + 2.1 * -(-len(channels) // 3), rows=-(-len(channels) // 3),
        columns=min(len(channels), 3),
    )  # fmt: skip
    for ax in axes[len(channels) :]:
        ax.set_axis_off()
    for ax, channel in zip(axes, channels, strict=False):
        members = [entry for entry in spectrum if entry["channel"] == channel]
        for at, protocol in enumerate(protocols):
            for entry in (e for e in members if e["protocol"] == protocol):
                _lines(ax, at, entry)
        ax.set_xticks(range(len(protocols)), [words(p).replace(" ", "\n") for p in protocols])
        ax.set_xlim(-0.5, len(protocols) - 0.5)
        finish_axes(ax, y=f"RMS [{members[0]['unit']}]", title=words(channel))
        ax.set_ylim(bottom=-_BELOW * ax.get_ylim()[1])
    handles = [
        Line2D([], [], color=INK, marker=marker, markersize=5, linestyle="none",
               label=f"{name} lines")
        for name, marker in _LINES
    ]  # fmt: skip
    handles += [
        Line2D([], [], color=VERMILION, linewidth=4, label="before" if repaired else "simulated"),
        *([Line2D([], [], color=BLUE, linewidth=4, label="after")] if repaired else []),
        Line2D([], [], color=MUTED, linestyle=":", label="noise"),
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=6)
    return figure


def _lines(ax: Axes, at: int, entry: Mapping[str, Any]) -> None:
    for side, key, colour in ((-0.08, "before", VERMILION), (0.08, "after", BLUE)):
        levels = entry[key]
        if levels is None:
            continue
        for step, (name, marker) in enumerate(_LINES):
            place = at + 0.22 * (step - 1) + side / 2
            inside = "none" if key == "before" else colour
            ax.plot(place, levels[name], marker, color=colour, markersize=5, markerfacecolor=inside)
    noise = entry["before"]["noise"]
    if noise is not None:
        ax.plot([at - 0.4, at + 0.4], [noise, noise], color=MUTED, linestyle=":", linewidth=1.2)
