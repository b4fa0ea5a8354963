"""Numbers on a page read well, text is escaped, and colours can be read in light and in dark."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pamsim.report.numbers import (
    FILTERS,
    fixed,
    interval,
    p_value,
    percent,
    plain,
    quantity,
    sentence,
    significant,
    unit,
    words,
)
from pamsim.report.page import page_template, write_page
from pamsim.scene.series_colours import BLUE, GREEN, INK, MUTED, PURPLE, VERMILION
from tests.unit.core.refusals import refused

WRITTEN = (
    (fixed(-1.504, 2), "−1.50"),
    (fixed(-0.001, 2), "0.00"),
    (fixed(None, 2), "–"),
    (fixed(True, 2), "–"),
    (fixed(float("inf"), 2), "–"),
    (significant(float("nan"), 2), "–"),
    (significant(0.09, 3), "0.0900"),
    (significant(123.4, 3), "123"),
    (significant(22150.2, 3), "22150"),
    (significant(99.6, 2), "100"),
    (significant(-999.7, 3), "−1000"),
    (significant(999700.0, 3), "999700"),
    (significant(-0.0, 2), "0.0"),
    (significant(-1.2e-8, 3), "−1.20×10⁻⁸"),
    (plain(24000), "24000"),
    (plain(0.64595), "0.64595"),
    (plain(True), "yes"),
    (plain(None), "–"),
    (interval([0.668, 0.676], 3), "0.668 to 0.676"),
    (interval(None, 3), ""),
    (interval([0.1, None], 3), ""),
    (words("output_error"), "output error"),
    (words("coulomb_friction:rigid"), "Coulomb friction: rigid"),
    (words("bouc_wen"), "Bouc-Wen"),
    (words(None), ""),
    (unit("dm^3/(s*bar)"), "dm³/(s·bar)"),
    (unit("s^-1"), "s⁻¹"),
    (unit("percent"), "%"),
    (unit("1"), ""),
    (quantity(487.04, "kPa", 4), "487.0 kPa"),
    (quantity(0.5, "1", 2), "0.50"),
    (quantity(None, "kPa", 4), "–"),
    (percent(0.934), "93 %"),
    (percent(0.0016, 1), "0.2 %"),
    (percent(None), "–"),
    (p_value(0.0132), "0.013"),
    (p_value(0.0), "< 0.0001"),
    (p_value(None), "–"),
    (sentence("no parameter at a limit"), "No parameter at a limit."),
    (sentence("Done."), "Done."),
    (sentence("however, no parameter"), "However, no parameter."),
    (sentence("short/step_1 has no load"), "short/step_1 has no load."),
    (sentence("payload: no interval"), "payload: no interval."),
    (sentence(None), ""),
)


def test_numbers_read_well():
    assert [written for written, _ in WRITTEN] == [wanted for _, wanted in WRITTEN]


def test_every_function_is_a_filter_and_its_text_is_escaped():
    environment = page_template("base.html").environment
    assert all(environment.filters[function.__name__] is function for function in FILTERS)
    written = environment.from_string("{{ ends | interval(2) }} {{ p | p_value }} {{ n | words }}")
    assert written.render(ends=[0.5, 1.5], p=1e-9, n="<b>") == "0.50 to 1.5 &lt; 0.0001 &lt;b&gt;"


def test_a_page_is_refused_a_result_of_another_schema_and_a_file_for_a_folder(tmp_path):
    with refused("schema 'other/1'; this page reads 'mine/1'"):
        write_page(tmp_path, "base.html", {"schema": "other/1"}, dict, schema="mine/1")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("")
    with refused("is a file; name a folder"):
        write_page(tmp_path / "file", "base.html", {"schema": "mine/1"}, dict, schema="mine/1")


# Least contrasts of WCAG 2.2, 1.4.3 and 1.4.11.
TEXT, GRAPHICS = 4.5, 3.0
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


def test_text_of_a_page_stands_out():
    assert contrast(rgb("#777777"), rgb("#ffffff")) == pytest.approx(4.48, abs=0.01)  # known
    for mode in ("light", "dark", "print"):
        colours = palette(mode)
        for name in ("ink", "muted", "link", "ok", "bad"):
            for behind in ("page", "soft"):
                seen = contrast(rgb(colours[name]), rgb(colours[behind]))
                assert seen >= TEXT, (mode, name, behind)


def test_lines_and_labels_of_a_figure_stand_out_and_dark_ones_are_inverted():
    dark = BASE[BASE.index("prefers-color-scheme: dark") :]
    assert "--figure: invert(1) hue-rotate(180deg); --blend: screen" in dark
    page = rgb(palette("dark")["page"])
    for colour in (INK, MUTED, BLUE, GREEN, VERMILION, PURPLE):
        least = TEXT if colour in (INK, MUTED) else GRAPHICS
        assert contrast(rgb(colour), rgb("#fff")) >= least, colour
        inverted = np.clip(HALF_TURN @ (1.0 - rgb(colour)), 0.0, 1.0)
        screened = 1.0 - (1.0 - inverted) * (1.0 - page)
        assert contrast(screened, page) >= least, colour
