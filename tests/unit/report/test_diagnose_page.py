"""The page of a diagnosis: every verdict makes one, figures carry units and both states."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.diagnosis.diagnose import diagnose
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.report.diagnose_gap import gap_bars, nuisance_by_protocol
from pamsim.report.diagnose_loops import loop_areas, residual_lines
from pamsim.report.diagnose_page import write_diagnosis
from pamsim.report.diagnose_signals import trial_channels, worst_trials
from pamsim.report.diagnose_where import binned_maps, significant_maps, where_map
from pamsim.report.physical_words import physical_words
from pamsim.report.style import BLUE, VERMILION
from tests.unit.diagnosis.diagnosed import VERDICTS, following, report

TIME = np.linspace(0.0, 1.0, 50)


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr("pamsim.report.page.save_png", lambda figure, path: (691, 400))


def page_of(one, folder):
    return write_diagnosis(one.to_dict(), one.comparisons, folder)[0].read_text("utf-8")


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("verdict", list(Verdict))
def test_every_verdict_makes_a_page_that_begins_with_its_sentence(rig, verdict, tmp_path):
    one = report(rig, verdict, **VERDICTS[verdict], following=following())
    page = page_of(one, tmp_path)
    sentence = one.summary()
    assert f'<p class="verdict">{sentence}</p>' in page
    assert page.index(sentence) < page.index("<h2>")
    assert "None" not in page
    assert "nan" not in re.sub(r"<[^>]+>", " ", page)
    found = [int(n) for n in re.findall(r"<figcaption><b>Figure (\d+)\.", page)]
    assert found == list(range(1, len(found) + 1))
    assert ("after<br>" in page) is (one.verdict in (
        Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER, Verdict.AMBIGUOUS
    ))  # fmt: skip


@pytest.mark.usefixtures("quick")
def test_what_the_reader_needs_is_on_the_page(rig, tmp_path):
    one = report(
        rig,
        Verdict.AMBIGUOUS,
        **VERDICTS[Verdict.AMBIGUOUS],
        following=following(),
        at_bound=("force.scale",),
    )
    page = page_of(one, tmp_path)
    for words in (
        "Possible causes", "supply sag", "What to measure next: shut_hold",
        "What leaves a chamber whose", "cannot tell", "no body&#39;s tilt is stated",
        "Forces were not measured.", "swing_check (3)", "at a limit of its range",
        "Most similar to what is missing: air leak (family: leak; explains 98 %"
        " [92 %, 99 %]",
    ):  # fmt: skip
        assert words in page, words


@pytest.mark.usefixtures("quick")
def test_the_size_in_physical_terms_comes_before_the_formula_s_parameters(rig, tmp_path):
    page = page_of(report(rig, Verdict.NAMED, ["air_leak"], lack=(-0.01, 0.5, 0.0001)), tmp_path)
    size = "mass flow 0.583 [0.525, 0.641] mg/s (test: pressure 2.5 bar)"
    assert page.index(size) < page.index("chamber.leak_conductance</td>")
    assert page.count("leak</span></th>") == 1


def test_a_size_is_written_in_common_units_without_what_the_effect_cannot_change():
    physical = {
        "loop_half_width": {"value": 15.0, "unit": "N", "interval95": [13.2, 16.8]},
        "lost_travel": {"value": 3e-4, "unit": "m", "interval95": None},
        "force_per_pressure_ratio": {"value": 1.0, "unit": "1", "interval95": [1.0, 1.0]},
        "at_pressure": {"value": 2.5e5, "unit": "Pa", "interval95": None},
        "contraction_amplitude": {"value": 0.015, "unit": "1", "interval95": None},
    }
    assert physical_words(physical) == (
        "loop half width 15.0 [13.2, 16.8] N; lost travel 0.300 mm"
        " (test: pressure 2.5 bar, contraction amplitude 1.5 %)"
    )
    two = {f"chain_backlash.{name}": entry for name, entry in physical.items()}
    assert physical_words(two) == (
        "chain backlash: loop half width 15.0 [13.2, 16.8] N; chain backlash: lost travel 0.300 mm"
        " (test: pressure 2.5 bar, contraction amplitude 1.5 %)"
    )
    assert physical_words({}) == ""


@pytest.mark.usefixtures("quick")
def test_text_of_the_result_is_escaped(rig, tmp_path):
    result = report(rig, Verdict.NO_GAP).to_dict()
    result |= {"rig": "<arm>", "warnings": ["<b>"], "sentence": "No <gap>."}
    page = write_diagnosis(result, [], tmp_path)[0].read_text("utf-8")
    assert "<arm>" not in page
    assert "No &lt;gap&gt;." in page


def test_another_schema_and_a_bad_place_are_refused(rig, tmp_path):
    result = report(rig, Verdict.NO_GAP).to_dict()
    with pytest.raises(InputError, match="reads 'pamsim-diagnosis/2'"):
        write_diagnosis({**result, "schema": "x"}, [], tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file; name a folder"):
        write_diagnosis(result, [], tmp_path / "file")


@pytest.fixture(scope="module")
def named(rig):
    one = report(rig, Verdict.NAMED, ["air_leak"])
    return one.to_dict(), one.comparisons


def test_the_heat_map_has_a_cell_per_channel_and_protocol_and_marks_what_is_sure(named):
    result, _ = named
    figure = where_map(result["where"], result["where_with_measured_pressures"])
    upper, lower = figure.axes[:2]
    assert len(upper.texts) == len(result["where"]) == 6
    assert len(lower.texts) == 1
    weights = {text.get_text(): text.get_fontweight() for text in upper.texts}
    assert weights["4.6"] == "bold"  # excess 20, p = 0.001
    assert weights["4.0"] == "normal"  # excess 15, p = 0.4
    assert figure.axes[-1].get_ylabel() == "RMS / noise floor"
    assert len(where_map(result["where"], []).axes) == 2  # the map and its scale


def test_only_significant_maps_are_drawn(named):
    result, _ = named
    chosen = significant_maps(result["maps"])
    assert [one["quantity"] for one in chosen] == ["common_pressure", "elapsed"]
    ax, _ = binned_maps(chosen).axes
    assert ax.get_xlabel() == "common pressure [kPa]"
    assert ax.get_ylabel() == "mean residual [noise SD]"
    assert ax.get_xlim()[1] == pytest.approx(300.0, rel=0.05)


def test_gaps_are_drawn_over_the_floor_of_their_channel(named):
    result, _ = named
    (ax,) = gap_bars(result["gap"]).axes
    widths = [bar.get_width() for bar in ax.patches]
    gaps = list(result["gap"].values())[::-1]
    expected = [
        gap[key]["value"] / gap["floor"]["value"] for gap in gaps for key in ("before", "after")
    ]
    assert widths == pytest.approx(expected)
    assert ax.get_yticklabels()[-1].get_text().startswith("pressure 1\n2.0")


def test_the_worst_held_out_trial_of_each_protocol_is_drawn_with_both_simulations(named):
    result, signals = named
    noise = {name: entry["sd_si"] for name, entry in result["noise_floor"]["channels"].items()}
    (worst,) = worst_trials(signals, noise)
    assert worst.startswith("swing_check")
    figure = trial_channels([part for part in signals if part.trial == worst], noise)
    assert [ax.get_ylabel() for ax in figure.axes[::2]] == [
        "pressure 1 [kPa]", "pressure 2 [kPa]", "angle [deg]"
    ]  # fmt: skip
    left = figure.axes[1]
    before, after = (
        next(line for line in left.lines if line.get_color() == colour)
        for colour in (VERMILION, BLUE)
    )
    assert np.mean(before.get_ydata()) == pytest.approx(-2.0, abs=0.1)  # measured less simulated
    assert np.mean(after.get_ydata()) == pytest.approx(0.0, abs=0.1)


def test_trials_are_ranked_by_what_the_base_model_misses_in_noise():
    def part(trial, protocol, off, held=True, channel="angle"):
        still = np.zeros(TIME.size)
        return SimpleNamespace(
            trial=trial, protocol=protocol, channel=channel, held_out=held, time=TIME,
            measured=still, before=still + off, after=None,
        )  # fmt: skip

    signals = [part("a_1", "a", 1.0), part("a_2", "a", 2.0), part("b_1", "b", 3.0),
               part("c_1", "c", 9.0, held=False)]  # fmt: skip
    assert worst_trials(signals, {"angle": 0.1}) == ["b_1", "a_2"]
    signals.append(part("d_1", "d", 300.0, channel="pressure_1"))  # large, but only one noise floor
    assert worst_trials(signals, {"angle": 0.1, "pressure_1": 300.0}) == ["b_1", "a_2", "d_1"]


def test_loops_lines_and_regimes_have_units_and_both_states(named):
    result, _ = named
    loops = loop_areas(result["loop_areas"])
    assert loops.axes[0].get_ylabel() == "loop area [kPa·deg]"
    assert [ax.get_xlabel() for ax in loops.axes] == [
        "amplitude [deg]", "common pressure [kPa]", "period [s]"
    ]  # fmt: skip
    lines = residual_lines(result["spectrum"])
    assert [ax.get_ylabel() for ax in lines.axes] == ["RMS [kPa]", "RMS [kPa]", "RMS [deg]"]
    (regime,) = nuisance_by_protocol(result["nuisance_by_protocol"]).axes
    assert regime.get_xlabel() == "force.scale"
    assert regime.get_title(loc="left") == "p = 0.020"


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("name", ["alraouf2025", "alraouf2025_equations"])
def test_a_loop_gets_the_same_page_with_the_parts_that_it_has(name, tmp_path):
    one = diagnose(name)
    page = page_of(one, tmp_path)
    assert one.summary() in page
    assert "The loop and the difference of its branches." in page
    assert "Nuisance parameters" not in page
    assert "None" not in page
    assert "held out one at a time" in page


@pytest.mark.usefixtures("quick")
def test_a_model_whose_size_is_not_known_carries_a_warning(rig, tmp_path):
    result = report(rig, Verdict.NAMED, ["air_leak"]).to_dict()
    result["tried"][0]["size_known"] = False
    page = write_diagnosis(result, [], tmp_path)[0].read_text("utf-8")
    assert "the interval includes its absence" in page
