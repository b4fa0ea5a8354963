"""Pictures of the documents, small enough to be kept in the repository."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from pamsim.report.style import save_png

DOCUMENTS = Path(__file__).parents[1] / "docs" / "images"
COLOURS = 64
"""A third of the size of all colours, and no difference to be seen."""


def save_small_png(figure: Figure, name: str) -> None:
    """Write a figure as a picture of the documents, in few colours."""
    path = DOCUMENTS / f"{name}.png"
    save_png(figure, path)
    with Image.open(path) as picture:
        few = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")
