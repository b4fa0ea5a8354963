"""The page of a diagnosis by link: where comes first, then what is certain, in words."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.diagnosis.diagnose import diagnose
from pamsim.report.link_figure import link_bars
from pamsim.report.link_page import headline, write_link_diagnosis
from pamsim.report.numbers import unit
from pamsim.report.style import BLUE, VERMILION
from pamsim.report.trial_signals import trial_channels, worst_trials
from tests.unit.diagnosis.by_link.reports import NOISE, VERDICTS, effect, report


def page_of(one, folder, **more):
    return write_link_diagnosis(one.to_dict(), one.comparisons, folder, **more)[0].read_text(
        "utf-8"
    )


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("verdict", list(VERDICTS))
def test_every_verdict_makes_a_page_that_begins_with_where(verdict, tmp_path):
    one = VERDICTS[verdict]
    page = page_of(one, tmp_path)
    words = re.sub(r"<[^>]+>", " ", page)
    first = page.index('<figure id="links">')
    assert first < page.index(f'<p class="verdict">{unit(one.sentence)}</p>') < page.index("<h2>")
    assert "None" not in words
    assert "nan" not in words
    assert ('<th scope="col">after</th>' in page) is bool(one.effects)
    assert "no body&#39;s tilt is stated" in page
    assert "Forces were not measured." in page
    assert ("What to measure next: shut hold" in page) is (verdict == "ambiguous")


@pytest.mark.parametrize(
    ("one", "expected"),
    [
        (report(), "No gap: nothing is missing that these data can show"),
        (report(effect("form")), "Missing: a leak of air from the muscles"),
        (report(effect("place")), "Missing: something at the valves and the air"),
        (report(more_left=True), "No effect tried explains the gap in muscle and joint"),
    ],
)
def test_the_headline_claims_no_more_than_is_certain(one, expected):
    assert headline(one.to_dict()) == expected


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
    def part(trial, protocol, off, held=True, channel="angle"):
        still = np.zeros(50)
        return SimpleNamespace(
            trial=trial, protocol=protocol, channel=channel, held_out=held, time=still,
            measured=still, before=still + off, after=None,
        )  # fmt: skip

    signals = [part("a_1", "a", 1.0), part("a_2", "a", 2.0), part("b_1", "b", 3.0),
               part("c_1", "c", 9.0, held=False)]  # fmt: skip
    assert worst_trials(signals, {"angle": 0.1}) == ["b_1", "a_2"]
    signals.append(part("d_1", "d", 300.0, channel="pressure_1"))  # large, but only one noise floor
    assert worst_trials(signals, {"angle": 0.1, "pressure_1": 300.0}) == ["b_1", "a_2", "d_1"]


def test_a_trial_is_drawn_with_both_simulations_and_what_each_misses():
    parts = [p for p in VERDICTS["named"].comparisons if p.trial == "swing_check_1"]
    figure = trial_channels(parts, NOISE)
    assert [ax.get_ylabel() for ax in figure.axes[::2]] == ["pressure 1 [kPa]", "angle [deg]"]
    left = figure.axes[1]
    before, after = (
        next(line for line in left.lines if line.get_color() == colour)
        for colour in (VERMILION, BLUE)
    )
    assert np.mean(before.get_ydata()) == pytest.approx(-2.0, abs=0.1)  # measured less simulated
    assert np.mean(after.get_ydata()) == pytest.approx(0.0, abs=0.1)


@pytest.mark.usefixtures("quick")
def test_levels_that_are_open_and_rivals_that_tie_are_shown(tmp_path):
    page = page_of(report(effect("place", ties=True)), tmp_path)
    assert re.findall(r'class="tag (\w+)">([\w ]+)<', page) == [
        ("identified", "place"), ("assumed", "family open"), ("assumed", "effect open"),
        ("assumed", "formula open"),
    ]  # fmt: skip
    row = page[page.index("supply sag") :]
    assert '<td class="text">yes</td>' in row[: row.index("</tr>")]


@pytest.mark.usefixtures("quick")
def test_text_is_escaped(tmp_path):
    assert "<arm>" not in page_of(replace(report(), rig="<arm>", warnings=("<b>",)), tmp_path)


@pytest.mark.usefixtures("quick")
def test_a_film_is_in_the_page_and_waits_to_be_opened(tmp_path):
    film = tmp_path / "gap.gif"
    film.write_bytes(b"GIF89a of an arm")
    page = page_of(VERDICTS["named"], tmp_path, film=film)
    (opened,) = re.findall(r'<details class="film">(.*?)</details>', page, re.DOTALL)
    assert "data:image/gif;base64,R0lGODlhIG9mIGFuIGFybQ==" in opened
    assert "swing check 2" in opened  # missed by more than the first
    assert "<details" not in page_of(VERDICTS["named"], tmp_path)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("name", ["alraouf2025", "alraouf2025_equations"])
def test_a_loop_gets_the_same_page_with_the_parts_that_it_has(name, tmp_path):
    one = diagnose(name)
    page = page_of(one, tmp_path)
    assert unit(one.sentence) in page
    assert "The loop and the difference of its branches." in page
    assert "Where the gap is." not in page
    assert "Nuisance parameters" not in page
    assert "None" not in page
