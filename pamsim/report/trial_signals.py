"""Figures of trials: measured signals beside the simulations before and after."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.recordings.signals import JOINT_KINDS, KINDS, kind_of, owner_of
from pamsim.report.numbers import unit, words
from pamsim.report.style import RULE, finish_axes, new_figure, say_empty, series_look, styled
from pamsim.scene.series_colours import BLUE, INK, MUTED, VERMILION

_MOST_SHOWN, _MOST_WORST = 5, 3  # trials
_MOST_POINTS, _FEW_POINTS = 1600, 400  # drawn of a signal; more only make the file larger
_PALE = 0.7  # opacity of measured dots, through which the lines of their colour are seen
_BEFORE: dict[str, Any] = {"linestyle": (0, (3, 2)), "linewidth": 1.0}
_AFTER: dict[str, Any] = {"linewidth": 1.1}


def shown_trials(comparisons: Sequence[Comparison]) -> list[str]:
    """Names of the trials that are drawn: held-out first, then the worst; of repeats, one."""

    def badness(trial: str) -> float:
        parts = [c for c in comparisons if c.trial == trial]
        ends = [(c.measured, c.before if c.after is None else c.after) for c in parts]
        off = [
            float(np.sqrt(np.mean((end - measured) ** 2)) / np.ptp(measured))
            for measured, end in ends
            if end is not None and np.ptp(measured) > 0.0
        ]
        return max(off, default=0.0 if any(end is not None for _, end in ends) else np.inf)

    held = {c.trial: c.held_out for c in comparisons}
    ordered = sorted(held, key=lambda trial: (not held[trial], -badness(trial)))
    return _one_of_each_protocol(ordered, comparisons)[:_MOST_SHOWN]


def worst_trials(comparisons: Sequence[Comparison], noise: Mapping[str, float]) -> list[str]:
    """Held-out trials that the base model misses most in noise [SI], one of each protocol.

    Channels without a noise do not count.
    """
    missed: dict[str, list[float]] = {}
    for part in comparisons:
        if part.held_out and part.before is not None and part.channel in noise:
            ratio = float(np.mean((part.before - part.measured) ** 2)) / noise[part.channel] ** 2
            missed.setdefault(part.trial, []).append(ratio)
    ordered = sorted(missed, key=lambda trial: -float(np.mean(missed[trial])))
    return _one_of_each_protocol(ordered, comparisons)[:_MOST_WORST]


def _one_of_each_protocol(trials: Sequence[str], comparisons: Sequence[Comparison]) -> list[str]:
    protocol = {c.trial: c.protocol for c in comparisons}
    first: dict[str, str] = {}
    for trial in trials:
        first.setdefault(protocol[trial], trial)
    return list(first.values())


@styled
def trial_signals(
    comparisons: Sequence[Comparison], names: tuple[str, str] = ("before", "after")
) -> Figure:
    """One row per trial of `shown_trials`, one column per kind of channel: measured, simulated.

    The names are those of the two simulations, where there are any.
    """
    chosen = shown_trials(comparisons)
    drawn = {kind_of(c.channel) for c in comparisons if c.trial in chosen}
    kinds = [kind for kind in KINDS if kind in drawn]
    figure, axes = new_figure(
        0.9 + 1.75 * len(chosen), rows=len(chosen), columns=len(kinds), sharex="row"
    )
    held_out = {c.trial: c.held_out for c in comparisons}
    places = _places(comparisons)
    several = {kind for kind, n in Counter(map(kind_of, places)).items() if n > 1}
    for place, ax in enumerate(axes):
        row, column = divmod(place, len(kinds))
        trial, kind = chosen[row], kinds[column]
        parts = [c for c in comparisons if c.trial == trial and kind_of(c.channel) == kind]
        for part in parts:
            colour = series_look(places[part.channel])[0] if kind in several else INK
            _draw(ax, part, colour, colour, measured=colour, dots=_FEW_POINTS)
        if not parts:
            say_empty(ax, "not measured")
        quantity = {"angle": "angle β", "pressure": "gauge\npressure"}.get(kind, kind)
        finish_axes(
            ax,
            x="time [s]" if row == len(chosen) - 1 else "",
            y=f"{quantity} [{unit(KINDS[kind].shown)}]",
            title="" if column else f"{trial} ({'held out' if held_out[trial] else 'fitted'})",
            zero=False,
        )
    owners: dict[int, dict[str, None]] = {}  # place of a colour -> joints and muscles in it
    for channel, i in places.items():
        if kind_of(channel) in several:
            owners.setdefault(i, {})[owner_of(channel) or f"muscle {i + 1}"] = None
    after = names[1] if any(c.after is not None for c in comparisons) else ""
    handles = _handles(names[0], after, INK, INK) + [
        Line2D([], [], color=series_look(i)[0], linewidth=4, label=", ".join(own))
        for i, own in sorted(owners.items())
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=5)
    return figure


def _places(comparisons: Sequence[Comparison]) -> dict[str, int]:
    """Channel -> place of its colour: one of its joint or muscle."""
    places: dict[str, int] = {}
    channels = list(dict.fromkeys(c.channel for c in comparisons))
    moving = {owner_of(one) for one in channels if kind_of(one) in JOINT_KINDS}
    joints, muscles = (
        list(dict.fromkeys(name for name in map(owner_of, channels) if (name in moving) is joint))
        for joint in (True, False)
    )
    for channel in channels:
        owner, number = owner_of(channel), channel.rpartition("_")[2]
        place = (joints if owner in moving else muscles).index(owner)
        places[channel] = int(number) - 1 if number.isdigit() else place
    return places


@styled
def trial_channels(parts: Sequence[Comparison], noise: Mapping[str, Any]) -> Figure:
    """One trial, a row per channel: the signals, and measured minus simulated beside them.

    Grey is the noise [SI] of each channel.
    """
    figure, axes = new_figure(0.75 + 1.35 * len(parts), rows=len(parts), columns=2, sharex=True)
    for row, part in enumerate(parts):
        signal, left = axes[2 * row], axes[2 * row + 1]
        shown, scale = shown_unit(part.channel)
        _draw(signal, part, VERMILION, BLUE)
        band = 2.0 * noise.get(part.channel, 0.0) * scale
        left.axhspan(-band, band, color=RULE, linewidth=0, zorder=0)
        every = _every(part)
        for simulated, colour in ((part.before, VERMILION), (part.after, BLUE)):
            if simulated is not None:
                off = (part.measured - simulated)[every] * scale
                left.plot(part.time[every], off, color=colour, linewidth=0.8)
        owner, _, name = part.channel.rpartition(".")
        label = f"{words(owner)}\n{name}" if owner else words(name)  # of a joint or muscle
        time = "time [s]" if row == len(parts) - 1 else ""
        titles = ("", "") if row else ("signal", "measured − simulated")
        finish_axes(signal, x=time, y=f"{label} [{shown}]", title=titles[0], zero=False)
        finish_axes(left, x=time, y=f"[{shown}]", title=titles[1])
    repaired = any(part.after is not None for part in parts)
    names = ("before", "after the repair") if repaired else ("simulated", "")
    handles = [*_handles(*names, VERMILION, BLUE), Patch(color=RULE, label="± 2 noise floors")]
    figure.legend(handles=handles, loc="outside upper right", ncols=len(handles))
    figure.align_ylabels()
    return figure


def _draw(
    ax: Axes,
    part: Comparison,
    before: str,
    after: str,
    *,
    measured: str = MUTED,
    dots: int = _MOST_POINTS,
) -> None:
    """One channel: measured as pale dots, simulated as lines of two colours."""
    scale = shown_unit(part.channel)[1]
    some, every = _every(part, dots), _every(part)
    dot: dict[str, Any] = {"color": measured, "markersize": 1.6, "alpha": _PALE}
    ax.plot(part.time[some], part.measured[some] * scale, ".", **dot)
    if part.before is not None:
        ax.plot(part.time[every], part.before[every] * scale, color=before, **_BEFORE)
    if part.after is not None:
        ax.plot(part.time[every], part.after[every] * scale, color=after, **_AFTER)


def _every(part: Comparison, most: int = _MOST_POINTS) -> slice:
    return slice(None, None, max(1, part.time.size // most))


def _handles(before: str, after: str, *colours: str) -> list[Line2D]:
    dot: dict[str, Any] = {"color": MUTED, "marker": ".", "linestyle": "none", "markersize": 4}
    return [
        Line2D([], [], label="measured", **dot),
        Line2D([], [], color=colours[0], label=before, **_BEFORE),
        *([Line2D([], [], color=colours[1], label=after, **_AFTER)] if after else []),
    ]
