"""Colours of pages and figures can be read in light and in dark: WCAG 2.2, 1.4.3 and 1.4.11."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pamsim.report.page import page_template
from pamsim.report.style import BLUE, GREEN, INK, MUTED, PURPLE, VERMILION

TEXT, GRAPHICS = 4.5, 3.0  # least contrasts
BASE = page_template("base.html").render()
# Of a CSS filter hue-rotate(180deg): Filter Effects Module Level 1, feColorMatrix, hueRotate.
HALF_TURN = np.array(
    [[-0.574, 1.430, 0.144], [0.426, 0.430, 0.144], [0.426, 1.430, -0.856]]
)  # fmt: skip


def rgb(colour):
    digits = colour.removeprefix("#")
    digits = digits if len(digits) == 6 else "".join(2 * digit for digit in digits)
    return np.array([int(digits[i : i + 2], 16) for i in (0, 2, 4)]) / 255.0


def luminance(colour):
    linear = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    return linear @ [0.2126, 0.7152, 0.0722]


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def palette(mode):
    """Names and colours of the page in one mode."""
    blocks = re.findall(r":root \{(.*?)\}", BASE, re.S)
    return dict(re.findall(r"--(\w+): (#\w+)", blocks[("light", "dark", "print").index(mode)]))


def test_the_formula_gives_the_contrasts_that_are_known():
    assert contrast(rgb("#000"), rgb("#fff")) == pytest.approx(21.0)
    assert contrast(rgb("#777777"), rgb("#ffffff")) == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("mode", ["light", "dark", "print"])
@pytest.mark.parametrize("name", ["ink", "muted", "link", "ok", "bad"])
def test_text_of_a_page_stands_out(mode, name):
    colours = palette(mode)
    for behind in ("page", "soft"):
        assert contrast(rgb(colours[name]), rgb(colours[behind])) >= TEXT


def test_dark_figures_are_inverted_ones():
    dark = BASE[BASE.index("prefers-color-scheme: dark") :]
    assert "--figure: invert(1) hue-rotate(180deg); --blend: screen" in dark


@pytest.mark.parametrize(
    ("colour", "least"),
    [(INK, TEXT), (MUTED, TEXT), (BLUE, GRAPHICS), (GREEN, GRAPHICS), (VERMILION, GRAPHICS),
     (PURPLE, GRAPHICS)],
)  # fmt: skip
def test_lines_and_labels_of_a_figure_stand_out(colour, least):
    assert contrast(rgb(colour), rgb("#fff")) >= least
    page = rgb(palette("dark")["page"])
    inverted = np.clip(HALF_TURN @ (1.0 - rgb(colour)), 0.0, 1.0)
    screened = 1.0 - (1.0 - inverted) * (1.0 - page)
    assert contrast(screened, page) >= least
