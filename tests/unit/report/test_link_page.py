"""The page of a diagnosis by link: where comes first, then what is certain, in words."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.report.link_page import (
    headline,
    link_bars,
    loop_branches,
    row_errors,
    write_link_diagnosis,
)
from pamsim.report.numbers import unit
from pamsim.report.trial_signals import worst_trials
from tests.unit.diagnosis.by_link.reports import VERDICTS, effect, report


def page_of(one, folder, **more):
    return write_link_diagnosis(one.to_dict(), one.comparisons, folder, **more).read_text("utf-8")


@pytest.mark.usefixtures("quick")
def test_every_verdict_makes_a_page_that_begins_with_where(tmp_path):
    for verdict, one in VERDICTS.items():
        page = page_of(one, tmp_path / verdict)
        first = page.index('<figure id="links">')
        stated = page.index(f'<p class="verdict">{unit(one.sentence)}</p>')
        assert first < stated < page.index("<h2>"), verdict
        assert not re.search("None|nan", re.sub(r"<[^>]+>", " ", page)), verdict
        assert ('<th scope="col">after</th>' in page) is bool(one.effects), verdict
        assert "no body&#39;s tilt is stated" in page
        assert "swing_check (2)" in page  # trials held out, repeats together
        assert "Forces were not measured." in page
        assert ("What to measure next: shut hold" in page) is (verdict == "ambiguous")


def test_the_headline_claims_no_more_than_is_certain():
    for one, expected in (
        (report(), "No gap: nothing is missing that these data can show"),
        (report(effect("form")), "Missing: a leak of air from the muscles"),
        (report(effect("place")), "Missing: something at the valves and the air"),
        (report(more_left=True), "No effect tried explains the gap in muscle and joint"),
        (
            report(more_left=None),
            "Undecided: what is left may be noise or a missing effect",
        ),
    ):
        assert headline(one.to_dict()) == expected


@pytest.mark.usefixtures("quick")
def test_levels_that_are_open_and_rivals_that_tie_are_shown_and_text_is_escaped(tmp_path):
    tied = replace(report(effect("place", ties=True)), rig="<arm>", warnings=("<b>",))
    page = page_of(tied, tmp_path)
    assert "<arm>" not in page
    assert re.findall(r'class="tag (\w+)">([\w ]+)<', page) == [
        ("identified", "place"), ("assumed", "family open"), ("assumed", "effect open"),
        ("assumed", "formula open"),
    ]  # fmt: skip
    row = page[page.index("supply sag") :]
    assert '<td class="text">yes</td>' in row[: row.index("</tr>")]


@pytest.mark.usefixtures("quick")
def test_a_film_waits_to_be_opened(tmp_path):
    film = tmp_path / "gap.gif"
    film.write_bytes(b"GIF89a of an arm")
    page = page_of(VERDICTS["named"], tmp_path, film=film)
    (opened,) = re.findall(r'<details class="film">(.*?)</details>', page, re.DOTALL)
    assert "data:image/gif;base64,R0lGODlhIG9mIGFuIGFybQ==" in opened
    assert "trial swing_check_2:" in opened  # missed by more than the first
    plain = page_of(VERDICTS["named"], tmp_path)
    assert "<details" not in plain


def test_bars_are_the_misfits_of_the_links_from_the_command_on():
    result = VERDICTS["named"].to_dict()
    (ax,) = link_bars(result["links"], repaired=True).axes
    ends = [bar.get_x() + bar.get_width() for bar in ax.patches]
    assert ends == pytest.approx([7.5, 1.02, 1.4, 1.4])
    assert [label.get_text() for label in ax.get_yticklabels()] == [
        "valves and air\ncommand → pressure", "muscle and joint\npressure → position"
    ]  # fmt: skip
    (ax,) = link_bars(result["links"], repaired=False).axes
    assert len(ax.patches) == 2


def test_trials_are_ranked_by_what_the_base_model_misses_in_noise():
    def part(trial, off, held=True, channel="angle"):
        still = np.zeros(50)
        return SimpleNamespace(
            trial=trial, protocol=trial[0], channel=channel, held_out=held, time=still,
            measured=still, before=still + off, after=None,
        )  # fmt: skip

    signals = [part("a_1", 1.0), part("a_2", 2.0), part("b_1", -3.0), part("c_1", 9.0, held=False)]
    assert worst_trials(signals, {"angle": 0.1}) == ["b_1", "a_2"]
    signals.append(part("d_1", 300.0, channel="pressure_1"))  # large, but only one noise floor
    assert worst_trials(signals, {"angle": 0.1, "pressure_1": 300.0}) == ["b_1", "a_2", "d_1"]
    assert worst_trials(signals, {"angle": 0.1}) == ["b_1", "a_2"]  # of no known noise


@pytest.mark.usefixtures("quick")
def test_a_channel_whose_noise_is_not_known_or_0_does_not_cost_the_page(tmp_path):
    result = VERDICTS["named"].to_dict()
    for floor in (0.0, None):
        result["gap"]["angle"]["floor"] = floor
        page = write_link_diagnosis(result, VERDICTS["named"].comparisons, tmp_path)
        assert '<figure id="trial_1">' in page.read_text("utf-8")


FOUND = [{"effect": "muscle_hysteresis:stop"}]
ROWS = [
    {"row": "row 1", "pressure_kpa": [300.0, 0.0], "before_deg": 4.0, "after_deg": 0.5},
    {"row": "row 2", "pressure_kpa": [300.0, 200.0], "before_deg": -8.0, "after_deg": -1.5},
]


def test_rows_lie_over_the_pressure_they_share_and_those_that_stand_out_are_named():
    near = [{**ROWS[1], "row": f"row {n}", "before_deg": 0.5} for n in range(3, 7)]
    before, after = row_errors({"rows": ROWS, "effects": FOUND}).axes
    assert before.lines[0].get_xdata().tolist() == [0.0, 200.0]
    assert after.lines[0].get_ydata().tolist() == [0.5, -1.5]
    assert before.get_ylim() == after.get_ylim()
    assert "6.32 deg" in before.get_title(loc="left")
    (alone,) = row_errors({"rows": ROWS, "effects": []}).axes
    assert alone.lines[0].get_ydata().tolist() == [4.0, -8.0]
    before, after = row_errors({"rows": [*ROWS, *near], "effects": FOUND}).axes
    assert [text.get_text() for text in before.texts] == ["row 2"]
    assert not after.texts


def labels(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_a_loop_is_drawn_with_its_base_and_what_was_found():
    branches = {
        "pressure_kpa": [0.0, 50.0], "rising_mm": [300.1, 279.0], "falling_mm": [300.0, 282.5],
        "opened_mm": [0.5, -2.0], "error_mm": None,
    }  # fmt: skip
    above, below = loop_branches({"effects": FOUND, "branches": branches}).axes
    assert np.allclose([bar.get_height() for bar in below.patches], [0.1, -3.5])
    drawn = [line.get_ydata() for line in above.lines]
    for wanted in ([300.05, 280.75], [300.1, 279.0], [300.0, 282.5], [300.3, 279.75]):
        assert any(np.allclose(wanted, line) for line in drawn)
    assert any(np.array_equal([0.5, -2.0], line.get_ydata()) for line in below.lines)
    assert "muscle hysteresis: stop" in labels(above)
    # Where nothing was found the reversible curve stands alone.
    branches |= {"opened_mm": None, "error_mm": [1.0, 2.0]}
    above, below = loop_branches({"effects": [], "branches": branches}).axes
    assert labels(above) == ["reversible curve", "readings, rising", "readings, falling"]
    assert labels(below) == ["readings ± standard error", "reversible curve"]
