"""The page of a demonstration: what was hidden, how one knows, what next; one interval a number."""

from __future__ import annotations

import re
import threading
from dataclasses import replace

import matplotlib
import pytest

from pamsim.diagnosis.by_link.result import Verdict
from pamsim.diagnosis.physical_size import PhysicalSize
from pamsim.report.link_page import SUPPORTED, Hidden, physical_words, write_link_diagnosis
from pamsim.report.numbers import digits, p_is, p_value
from pamsim.report.page import page_image
from pamsim.report.style import finish_axes, new_figure, styled
from tests.records import page
from tests.unit.diagnosis.by_link.reports import LEAK, VERDICTS, effect, report

HIDDEN = Hidden(
    effect="air_leak",
    missing="a leak of air from the muscles",
    parameters={LEAK: (2.0, "mm^3/(s*kPa)")},
    tried=("air_leak", "supply_sag"),
)


def page_of(one, folder, **more):
    page = write_link_diagnosis(one.to_dict(), one.comparisons, folder, **more)
    return page.read_text("utf-8")


@pytest.mark.parametrize(
    ("one", "hidden", "expected"),
    [
        (report(effect("form")), HIDDEN,
         "We hid 2.00 mm³/(s·kPa) of air leak in a synthetic recording."
         " pamsim found 1.98 [1.92, 2.07] mm³/(s·kPa)."),
        (report(effect("form")), HIDDEN._replace(parameters={"other": (0.3, "1")}),
         "We hid 0.300 of air leak in a synthetic recording. pamsim named it by another formula."
         " Missing: a leak of air from the muscles"),
        (report(more_left=True), HIDDEN,
         "We hid 2.00 mm³/(s·kPa) of air leak in a synthetic recording. pamsim did not name it."
         " No effect tried explains the gap in muscle and joint"),
    ],
)  # fmt: skip
def test_the_headline_is_what_was_hidden_and_what_was_found(one, hidden, expected):
    assert hidden.headline(one.to_dict()) == expected


def test_settings_are_the_user_s_again_though_pages_are_drawn_at_once():
    inside, outside = threading.Event(), threading.Event()

    @styled
    def draw():
        inside.set()
        outside.wait(0.5)

    with matplotlib.rc_context({"font.size": 17.0}):
        first = threading.Thread(target=draw)
        first.start()
        inside.wait()
        second = threading.Thread(target=draw)
        second.start()
        first.join()
        outside.set()
        second.join()
        assert matplotlib.rcParams["font.size"] == 17.0


@pytest.mark.usefixtures("quick")
def test_three_questions_are_answered_before_the_first_figure(tmp_path):
    picture, film = tmp_path / "arm.jpg", tmp_path / "gap.gif"
    picture.write_bytes(b"a picture")
    film.write_bytes(b"a film")
    hidden = HIDDEN._replace(picture=picture)
    page = page_of(VERDICTS["named"], tmp_path, hidden=hidden, film=film)
    opening = page[page.index("<h1") : page.index("<figure")]
    questions = re.findall(r"<dt>(.*?)</dt>", opening)
    assert questions == ["What was hidden", "How you know that it is right", "What to do next"]
    assert "Its 95 % interval holds what was hidden." in opening
    assert "data:image/jpeg;base64," in opening
    assert page.count('<details class="film" open>') == page.count("<details") == 1
    assert "pamsim tried 2 effects that look like each other: air leak, supply sag." in page
    assert 'id="hidden"' not in page_of(VERDICTS["named"], tmp_path)


@pytest.mark.usefixtures("quick")
def test_a_quantity_has_one_interval(tmp_path):
    found = effect("form")
    size = replace(found.sizes[LEAK], unit_si="m^3/(s*Pa)")
    same = PhysicalSize(value=size.value_si, unit=size.unit_si, interval95=size.interval95_si)
    physical = {"conductance": same, **found.physical}
    found = replace(found, sizes={LEAK: size}, physical=physical)
    page = page_of(report(found), tmp_path, hidden=HIDDEN)
    assert set(re.findall(r"1\.9\d+(?:, | to )2\.\d+", page)) == {"1.92, 2.07", "1.92 to 2.07"}
    assert "Conductance" not in page
    assert "Mass flow" in page


def test_a_size_stands_with_the_conditions_of_its_test_and_is_named_once():
    def entry(value, unit, half=0.0):
        ends = [value - half, value + half] if half else None
        return {"value": value, "unit": unit, "interval95": ends}

    width, same = entry(15.0, "N", 1.8), entry(15.0, "N", 1.8)
    physical = {
        "flexor.loop_half_width": width, "of_another_name": same,
        "energy_per_cycle": entry(0.16, "J", 0.02), "flexor.at_pressure": entry(2.5e5, "Pa"),
        "contraction_amplitude": entry(0.015, "1"),
    }  # fmt: skip
    assert physical_words(physical, {}) == (
        "flexor: loop half width 15.0 [13.2, 16.8] N; energy per cycle 0.160 [0.140, 0.180] J"
        " (test: pressure 2.5 bar, contraction amplitude 1.5 %)"
    )
    parameter = {"value_si": 15.0, "unit_si": "N", "interval95_si": width["interval95"]}
    assert physical_words({"loop_half_width": width}, {"force": parameter}) == ""


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("verdict", list(VERDICTS))
def test_every_verdict_says_what_it_supports(verdict, tmp_path):
    assert SUPPORTED[verdict][0] in page_of(VERDICTS[verdict], tmp_path)


def test_the_questions_state_of_every_verdict_what_its_page_supports():
    assert list(SUPPORTED) == [verdict.value for verdict in Verdict]
    rows = [f"| `{name}` | {may} | {may_not} |" for name, (may, may_not) in SUPPORTED.items()]
    assert "\n".join(rows) in page("faq")


def test_a_p_value_at_the_least_that_can_be_is_a_bound():
    assert p_is(2.0**-10, 2.0**-10) == "p ≤ 0.00098"
    assert p_value(2.0**-9, 2.0**-10) == "0.0020"
    assert p_value(0.01, 0.5) == "0.010"  # more units than trials: parts of them
    assert p_is(1e-4) == "p ≤ 0.00010"
    assert p_is(0.0) == "p < 0.0001"


def test_digits_are_two_of_half_the_width():
    assert digits(0.09013, [0.08856, 0.09112]) == 3
    assert digits(1234.5, [1234.4, 1234.6]) == 6
    assert digits(1.0, None) == digits(1.0, [None, None]) == digits(1.0, [1.0, 1.0]) == 3


def test_vectors_lie_beside_the_picture_the_same_for_the_same_data(tmp_path):
    for folder in ("one", "other"):
        figure, (ax,) = new_figure(2.0)
        ax.plot([0.0, 1.0], [0.0, 1.0])
        finish_axes(ax, x="time [s]", y="angle [deg]")
        page_image(figure, tmp_path / folder / "curve.png")
    for suffix, begins in ((".svg", b"<?xml"), (".pdf", b"%PDF")):
        one, other = ((tmp_path / f / f"curve{suffix}").read_bytes() for f in ("one", "other"))
        assert one == other
        assert one.startswith(begins)


def test_a_place_is_read_where_the_scale_between_its_ends_is_known(tmp_path):
    for scale, known in (("linear", [False]), ("log", [True]), ("symlog", [])):
        figure, (ax,) = new_figure(2.0)
        ax.plot([1.0, 2.0], [1.0, 1e4])
        ax.set_yscale(scale)
        panels = page_image(figure, tmp_path / f"{scale}.png").panels
        assert [y["log"] for _, y in panels] == known, scale
