"""Colours of curves, and of the muscles drawn beside them: a muscle has the colour of its curve."""

from __future__ import annotations

SERIES = ("#0072B2", "#009E73", "#D55E00", "#AA4499", "#5c6670")
"""Blue, green, vermilion, purple (Okabe and Ito 2008) and grey.

They stay apart under the common colour-vision deficiencies and in grey print.
"""
BLUE, GREEN, VERMILION, PURPLE, MUTED = SERIES
INK = "#1d232a"

Rgb = tuple[float, float, float]


def rgb(colour: str) -> Rgb:
    """Red, green and blue of a colour such as ``#0072B2``, 0 to 1 each."""
    red, green, blue = (int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5))
    return red, green, blue


def series_rgb(index: int) -> Rgb:
    """Colour of the index-th muscle and of its curves, 0 to 1 each."""
    return rgb(SERIES[index % len(SERIES)])
