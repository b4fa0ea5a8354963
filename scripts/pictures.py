"""Pictures of the documents, small enough to be kept in the repository."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from pamsim.core.files import complete_file
from pamsim.report.style import save_png

DOCUMENTS = Path(__file__).parents[1] / "docs" / "images"
COLOURS = 64
"""A third of the size of all colours, and no difference to be seen."""
GREY = "#78828c"
"""Can be read on white and on black."""


def save_small_png(figure: Figure, name: str) -> None:
    """Write a figure as a picture of the documents, in few colours."""
    path = DOCUMENTS / f"{name}.png"
    save_png(figure, path)
    with Image.open(path) as picture:
        few = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")


def on_any_ground(figure: Figure, axes: Axes) -> None:
    """Let what lies behind the axes show through, and write beside them in grey."""
    figure.patch.set_alpha(0.0)
    axes.patch.set_alpha(0.0)
    axes.grid(True, axis="y", color=GREY, alpha=0.35)
    axes.tick_params(colors=GREY, labelcolor=GREY)
    for text in (axes.xaxis.label, axes.yaxis.label):
        text.set_color(GREY)


def save_small_svg(figure: Figure, path: Path) -> None:
    """Write a figure as an SVG whose letters are text, with places to a tenth of a point."""
    fixed = {
        "svg.fonttype": "none",
        "font.sans-serif": ["DejaVu Sans"],
        "svg.hashsalt": "pamsim",  # names of its parts do not change from run to run
    }
    with complete_file(path) as part, matplotlib.rc_context(fixed):
        figure.savefig(part, format="svg", metadata={"Date": None, "Creator": None})
        text = part.read_text(encoding="utf-8")
        # Inside the tags alone: between them stand the labels.
        short = re.sub(r"<[^>]+>", lambda tag: re.sub(r"(\.\d)\d+", r"\1", tag[0]), text)
        part.write_text(short, encoding="utf-8")
