"""One look for every figure: palette, sizes, axes, and a way to draw without touching globals."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import (
    LogFormatter,
    LogLocator,
    NullLocator,
    ScalarFormatter,
    StrMethodFormatter,
)

from pamsim.core.files import complete_file
from pamsim.scene.series_colours import INK, MUTED, SERIES

RULE = "#d5dae0"
FAINT = "#f1f3f5"

MARKERS = ("o", "s", "^", "D", "v")

WIDTH_IN = 7.2
DPI = 200
# Browsers count 96 pixels to the inch: a figure shown at this size has the font sizes set below.
CSS_PER_PIXEL = 96 / DPI

_RC: dict[str, Any] = {
    "font.size": 9.5,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.5,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.8,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 8.5,
    "legend.framealpha": 1.0,
    "legend.edgecolor": "white",
    "legend.borderpad": 0.2,
    "lines.linewidth": 1.5,
    "lines.solid_capstyle": "round",
    "grid.color": RULE,
    "grid.linewidth": 0.6,
    "svg.hashsalt": "pamsim",  # names of its parts do not change from run to run
    "pdf.fonttype": 42,  # TrueType: journals refuse Type 3
}

_UNSTATED: dict[str, dict[str, Any]] = {
    ".png": {"Software": None},
    ".svg": {"Creator": None, "Date": None},
    ".pdf": {"Creator": None, "Producer": None, "CreationDate": None},
}
"""Left out of a file, which then does not change with the day or with matplotlib's version."""

_NUMBERS = (ScalarFormatter, LogFormatter)

_settings = threading.RLock()
"""Held while matplotlib's settings, which all threads share, are a page's."""

P = ParamSpec("P")
R = TypeVar("R")


@contextmanager
def page_style() -> Iterator[None]:
    """Hold the page's look for the time of a ``with`` block.

    It starts from matplotlib's own defaults, not from the user's settings, so that a page looks
    the same on every machine; the user's settings are back afterwards.
    """
    with _settings, matplotlib.style.context(["default", _RC]):
        yield


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Run a drawing function inside ``page_style``."""

    @functools.wraps(draw)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
        with page_style():
            return draw(*args, **kwargs)

    return wrapper


def new_figure(
    height_in: float,
    rows: int = 1,
    columns: int = 1,
    *,
    width_in: float = WIDTH_IN,
    **grid: Any,
) -> tuple[Figure, list[Axes]]:
    """Make a figure with its own canvas, unknown to pyplot, and its axes row by row.

    Height and width are in inches, the width is that of the page if left out; the others are those
    of ``Figure.subplots``.
    """
    figure = Figure(figsize=(width_in, height_in), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, columns, squeeze=False, **grid).flat)


def finish_axes(ax: Axes, *, x: str = "", y: str = "", title: str = "", zero: bool = True) -> None:
    """Give axes their labels, such as ``time [s]``, a light grid and a line at y = 0."""
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    if title:
        ax.set_title(title)
    ax.grid(True, axis="y")
    ax.tick_params(length=3)
    if zero:
        ax.axhline(0.0, color=MUTED, linewidth=0.7, zorder=1)


def plain_log_scale(ax: Axes) -> None:
    """Make the x-axis logarithmic, with plain numbers at 1, 2 and 5 of every decade."""
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    ax.xaxis.set_minor_locator(NullLocator())


def series_look(index: int) -> tuple[str, str]:
    """Colour and marker of the index-th series: two cues, so that neither is needed alone."""
    return SERIES[index % len(SERIES)], MARKERS[index % len(MARKERS)]


def say_empty(ax: Axes, text: str) -> None:
    """Write in empty axes why they are empty."""
    ax.text(
        0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color=MUTED, wrap=True
    )


def save_png(figure: Figure, path: Path) -> tuple[int, int]:
    """Write a figure of `new_figure` as PNG, the same bytes for the same data.

    Width and height at which a page should show it are returned [CSS pixel].
    """
    _save(figure, path)
    width, height = figure.canvas.get_width_height()
    return round(width * CSS_PER_PIXEL), round(height * CSS_PER_PIXEL)


def save_vectors(figure: Figure, path: Path) -> None:
    """Write a figure beside its PNG as SVG and PDF, the same bytes for the same data."""
    for suffix in (".svg", ".pdf"):
        _save(figure, path.with_suffix(suffix))


def _save(figure: Figure, path: Path) -> None:
    # Ticks are made while drawing and read the settings of the page then.
    with page_style(), complete_file(path) as part:
        figure.savefig(part, dpi=DPI, metadata=_UNSTATED[path.suffix])


def readable_panels(figure: Figure) -> list[list[dict[str, Any]]]:
    """The panels of a drawn figure where a place can be read as two numbers, each with its axes.

    An axis goes ``from`` one share of the figure ``to`` another, from the lower left, and there
    from the value ``low`` to ``high``. Panels with names or colours along an axis, or a scale that
    is neither linear nor logarithmic, are left out.
    """
    panels: list[list[dict[str, Any]]] = []
    for ax in figure.axes:
        sides = [
            (ax.xaxis, ax.get_xlim(), ax.get_position().intervalx, ax.get_shared_x_axes()),
            (ax.yaxis, ax.get_ylim(), ax.get_position().intervaly, ax.get_shared_y_axes()),
        ]
        numbers = all(
            isinstance(a.get_major_formatter(), _NUMBERS) and a.get_scale() in ("linear", "log")
            for a, *_ in sides
        )
        if ax.axison and ax.lines and not ax.images and numbers:
            panels.append([_axis(ax, *side) for side in sides])
    return panels


def _axis(ax: Axes, axis: Any, limits: Any, place: Any, shared: Any) -> dict[str, Any]:
    """One axis of a panel; its label may stand at a panel that shares it."""
    labels = [axis, *(getattr(other, f"{axis.axis_name}axis") for other in shared.get_siblings(ax))]
    label = next((one.get_label_text() for one in labels if one.get_label_text()), axis.axis_name)
    start, end = (round(float(side), 4) for side in place)
    low, high = (float(f"{limit:.6g}") for limit in limits)
    log = axis.get_scale() == "log"
    return {"from": start, "to": end, "low": low, "high": high, "log": log,
            "label": " ".join(label.split())}  # fmt: skip
