"""The ladder of static models: which physical term lowers the error at rows it has not seen."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator, ScalarFormatter

from pamsim.report.numbers import fixed, interval, number_or_none, significant, unit, words
from pamsim.report.style import BLUE, INK, MUTED, VERMILION, finish_axes, new_figure, styled

TORQUE_LAW_DEG = 1.22
"""Error at unseen rows of the best torque law of three terms without any muscle model [deg]."""

_TICKS = (0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0)
_LABEL = 38  # characters of a model's name that leave the marks two thirds of the width


@dataclass(frozen=True)
class RungView:
    """One line of the table of static models."""

    name: str
    climbed: bool
    rms: str
    left_out: str
    parameters: list[str]


def rung_views(rungs: Sequence[Mapping[str, Any]]) -> list[RungView]:
    """Prepare the table of static models.

    Args:
        rungs: each with ``name``, ``climbed``, ``rms_deg``, ``loo_rms_deg``, ``parameters``.

    Returns:
        One line per model, the climbed ones first as in the figure.
    """
    return [
        RungView(
            name=_name(rung),
            climbed=bool(rung.get("climbed")),
            rms=fixed(rung.get("rms_deg"), 2),
            left_out=fixed(rung.get("loo_rms_deg"), 2),
            parameters=[_parameter(found) for found in rung.get("parameters") or ()],
        )
        for rung in _ordered(rungs)
    ]


def rivals(rungs: Sequence[Mapping[str, Any]]) -> list[RungView]:
    """Models that were not taken although they predict unseen rows better than the one used.

    Args:
        rungs: as for `rung_views`; the last one climbed is the one used.

    Returns:
        One line per such model; none if no model was climbed.
    """
    views = rung_views(rungs)
    errors = [number_or_none(rung.get("loo_rms_deg")) for rung in _ordered(rungs)]
    used = [error for view, error in zip(views, errors, strict=True) if view.climbed][-1:]
    if not used or used[0] is None:
        return []
    return [
        view
        for view, error in zip(views, errors, strict=True)
        if not view.climbed and error is not None and error < used[0]
    ]


def _ordered(rungs: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    return sorted(rungs, key=lambda rung: not rung.get("climbed"))


def _name(rung: Mapping[str, Any]) -> str:
    return str(rung.get("name") or "unnamed model")


def _parameter(found: Mapping[str, Any]) -> str:
    value = f"{significant(found.get('value'), 3)} {unit(found.get('unit'))}".rstrip()
    text = f"{found.get('name')} = {value}"
    between = interval(found.get("interval95"), 3)
    flags = ", ".join(words(flag) for flag in found.get("flags") or ())
    return text + (f" ({between})" if between else "") + (f"; {flags}" if flags else "")


@styled
def static_ladder(rungs: Sequence[Mapping[str, Any]]) -> Figure:
    """Errors of every model in sample and at unseen rows.

    Args:
        rungs: each with ``name``, ``climbed``, ``rms_deg``, ``loo_rms_deg``; an error that is
            missing has no mark.

    Returns:
        One panel: a line per model against RMS error [deg], logarithmic.
    """
    ordered = _ordered(rungs)
    names = ["\n".join(textwrap.wrap(_name(rung), _LABEL)) for rung in ordered]
    lines = sum(name.count("\n") + 1 for name in names)
    figure, (ax,) = new_figure(0.13 * (len(rungs) + lines) + 1.2)
    finish_axes(ax, x="RMS error of the end angle [deg]", zero=False)
    ax.grid(True, axis="x")
    ax.axvline(TORQUE_LAW_DEG, color=MUTED, linewidth=1.0, linestyle=(0, (4, 3)), zorder=1)
    for place, rung in enumerate(ordered):
        inside, outside = (number_or_none(rung.get(key)) for key in ("rms_deg", "loo_rms_deg"))
        look = 1.0 if rung.get("climbed") else 0.45
        if inside is not None and outside is not None:
            ax.plot([inside, outside], [place, place], color=MUTED, linewidth=1.0, zorder=2)
        for error, marker, colour in ((inside, "o", BLUE), (outside, "D", VERMILION)):
            if error is not None:
                ax.plot(error, place, marker, color=colour, alpha=look, markersize=5, zorder=3)
    for marker, colour, label in (
        ("o", BLUE, "in sample"),
        ("D", VERMILION, "rows left out in turn"),
    ):
        ax.plot([], [], marker, color=colour, label=label)
    ax.plot(
        [], [], color=MUTED, linestyle=(0, (4, 3)),
        label=f"torque law of three terms, left out: {TORQUE_LAW_DEG:g} deg",
    )  # fmt: skip
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(FixedLocator(_TICKS))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_yticks(range(len(ordered)), names, fontsize=8, linespacing=1.0)
    for label, rung in zip(ax.get_yticklabels(), ordered, strict=True):
        label.set_color(INK if rung.get("climbed") else MUTED)
    ax.set_ylim(len(ordered) - 0.4, -0.6)
    ax.grid(False, axis="y")
    figure.legend(loc="outside upper right", ncols=3)
    return figure
