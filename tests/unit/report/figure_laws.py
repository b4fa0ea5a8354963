"""What every figure keeps to: its words lie inside its edges, its data inside its axes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text

from pamsim.scene.series_colours import INK, MUTED

LEAST = 0.3
"""Share of a linear axis that its data fill."""


def courses(ax: Axes) -> list[tuple[Any, Any]]:
    """Places (n,) and values (n,) of each line of data: not those across a whole panel."""
    lines = [line for line in ax.lines if line.get_transform() == ax.transData]
    pairs = [[np.asarray(data, dtype=float) for data in line.get_data()] for line in lines]
    return [(x, y) for x, y in pairs if x.size > 2]


def same(one: Any, other: Any) -> bool:
    """Whether two courses are one."""
    return all(
        len(a) == len(b) and np.allclose(a, b, rtol=1e-9, atol=1e-9, equal_nan=True)
        for a, b in zip(one, other, strict=True)
    )


def draws(ax: Axes, *wanted: tuple[Any, Any]) -> bool:
    """Whether a panel draws these courses, and no other."""
    found = courses(ax)
    wanted = tuple(tuple(np.asarray(a, dtype=float) for a in pair) for pair in wanted)
    return all(any(same(one, other) for other in wanted) for one in found) and all(
        any(same(one, other) for one in found) for other in wanted
    )


def _look(line: Line2D) -> tuple[str, str, Any]:
    return str(line.get_color()), line.get_linestyle(), line.get_marker()


def check_figure(figure: Figure, cut: Iterable[str] = ()) -> None:
    """Fail a figure that cuts off words or data, or whose legend has another look than they.

    Axes of which title or label holds one of some words are cut on purpose, as their figure says.
    """
    figure.draw_without_rendering()
    width, height = figure.bbox.size
    hidden = {
        id(tick.label1)
        for ax in figure.axes
        for axis in (ax.xaxis, ax.yaxis)
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())
        if not min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())
    }
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text().strip() and id(text) not in hidden:
            box, words = text.get_window_extent(), text.get_text()
            assert -2.0 <= box.x0 <= box.x1 <= width + 2.0, f"{words!r} is cut off"
            assert -2.0 <= box.y0 <= box.y1 <= height + 2.0, f"{words!r} is cut off"
    legends = [*figure.findobj(Legend)]
    for legend in legends:
        names = [text.get_text() for text in legend.get_texts()]
        assert len(set(names)) == len(names), f"a name stands twice in a legend: {names}"
    shown = {_look(line) for ax in figure.axes for line in ax.lines if len(line.get_xdata()) > 0}
    for line in (one for legend in legends for one in legend.get_lines()):
        neutral = line.get_color() in (INK, MUTED) or line.get_linewidth() > 3.0
        assert neutral or _look(line) in shown, f"{line.get_label()!r} of a legend is not drawn"
    for ax in figure.axes:
        for place, axis in enumerate((ax.xaxis, ax.yaxis)):
            shared = getattr(ax, f"get_shared_{axis.axis_name}_axes")().get_siblings(ax)
            data = [pair[place] for one in shared for pair in courses(one)]
            if not data:
                continue
            values = np.concatenate(data)
            low, high = sorted(axis.get_view_interval())
            seen = values[(values >= low) & (values <= high)]
            where = f"{axis.axis_name} of {ax.get_title(loc='left')}, {axis.get_label_text()}"
            if not any(words in where for words in cut):
                assert seen.size == np.isfinite(values).sum(), f"data are cut off: {where}"
            if axis.get_scale() == "linear":
                assert np.ptp(seen) >= LEAST * (high - low), f"mostly empty: {where}"
