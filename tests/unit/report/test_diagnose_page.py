"""The page of a diagnosis: every verdict makes one, figures carry units and both states."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.rig_estimates import estimates
from pamsim.report.diagnose_gap import gap_bars, nuisance_by_protocol
from pamsim.report.diagnose_loops import loop_areas, residual_lines
from pamsim.report.diagnose_page import headline, write_diagnosis
from pamsim.report.diagnose_signals import trial_channels, worst_trials
from pamsim.report.diagnose_where import binned_maps, significant_maps, where_map
from pamsim.report.numbers import interval, significant
from pamsim.report.page import page_image
from pamsim.report.physical_words import physical_words
from pamsim.report.style import BLUE, VERMILION, new_figure, page_style
from tests.unit.diagnosis.diagnosed import VERDICTS, following, report

TIME = np.linspace(0.0, 1.0, 50)


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


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
@pytest.mark.parametrize("verdict", list(Verdict))
def test_headline_figure_sentence_and_json_agree(rig, verdict, tmp_path):
    one = report(rig, verdict, **VERDICTS[verdict], following=following())
    result = one.to_dict()
    levels = [significant(x, 3) for x in result["gap_over_floor"].values() if x is not None]
    (shown,) = re.findall(r'<b id="headline">(.*?)</b>', page_of(one, tmp_path))
    assert shown == " → ".join(levels)
    (ax,) = gap_bars(result).axes
    assert ax.get_title(loc="left") == f"all channels: {shown} times the noise floor"
    bars = {bar.get_facecolor() for bar in ax.patches}
    assert len(bars) == len(levels)
    if verdict in (Verdict.NO_GAP, Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER):
        assert all(level in one.summary() for level in levels)


@pytest.mark.usefixtures("quick")
def test_nothing_is_repaired_where_nothing_is_missing(rig, tmp_path):
    one = report(rig, Verdict.NO_GAP)
    page = page_of(one, tmp_path)
    assert '<h1 class="ok">No gap' in page
    assert "repair" not in page[page.index("<body>") :]
    labels = gap_bars(one.to_dict()).legends[0].get_texts()
    assert [text.get_text() for text in labels][:2] == ["simulated", "noise floor"]


@pytest.mark.usefixtures("quick")
def test_a_rejected_effect_is_shown_by_its_share_and_not_by_a_size(rig, tmp_path):
    one = report(rig, Verdict.UNEXPLAINED, **VERDICTS[Verdict.UNEXPLAINED], following=following())
    page = page_of(one, tmp_path)
    best = one.method.conclusion.best
    (rejected,) = estimates(rig, best, ["chamber.leak_conductance"]).values()
    assert interval(rejected.interval95, 4) == "1.260 to 1.540"
    assert "1.260 to 1.540" not in page
    assert "Most similar: air leak, with 40 % [34 %, 41 %] of the gap" in page
    assert "Record shut hold, which shows what leaves a chamber" in page


@pytest.mark.usefixtures("quick")
def test_limits_stand_apart_from_what_these_data_cannot_tell(rig, tmp_path):
    page = page_of(report(rig, Verdict.NO_GAP), tmp_path)
    ruled_out, cannot_tell = re.split("<h2>These data cannot tell", page)
    ruled_out = ruled_out[ruled_out.index("<h2>Ruled out above") :]
    assert "load torque" in ruled_out
    assert "<b>added inertia</b>: the data do not show it" in cannot_tell
    assert "added inertia" not in ruled_out


@pytest.mark.parametrize(
    ("verdict", "more", "shown"),
    [
        (Verdict.NAMED, {"best": ["air_leak"]}, "Missing: air leak"),
        (Verdict.NAMED_WITH_REMAINDER, {"best": ["air_leak"]},
         "Missing: air leak, or something that resembles it"),
        (Verdict.AMBIGUOUS, {"best": ["coulomb_friction"], "tied": [["viscous_friction"]]},
         "Missing: joint friction, of a kind that is open"),
        (Verdict.AMBIGUOUS, {"best": ["air_leak"], "tied": [["supply_sag"], ["angle_bias"],
         ["angle_scale"]]}, "Missing: one of 4 models"),
    ],
)  # fmt: skip
def test_the_headline_claims_no_more_than_the_verdict(rig, verdict, more, shown):
    assert headline(report(rig, verdict, **more).to_dict()) == shown


def test_an_image_is_small_and_knows_what_its_panels_show(tmp_path):
    figure, (upper, lower) = new_figure(3.0, rows=2, sharex=True)
    with page_style():
        upper.plot([0.0, 4.0], [1.0, 100.0])
        upper.set_yscale("log")
        upper.set_ylim(1.0, 100.0)
        lower.plot([0.0, 4.0], [0.0, 1.0])
        lower.set_xlim(0.0, 4.0)
        lower.set_xlabel("time [s]")
        lower.set_yticks([0.0, 1.0], ["off", "on"])
    image = page_image(figure, tmp_path / "a.png")
    assert len(image.source) < (tmp_path / "a.png").stat().st_size
    ((x, y),) = image.panels  # the other has names along an axis
    assert (x["low"], x["high"], x["log"], x["label"]) == (0.0, 4.0, False, "time [s]")
    assert (y["low"], y["high"], y["log"], y["label"]) == (1.0, 100.0, True, "y")
    assert 0.0 < x["from"] < 0.2 < 0.9 < x["to"] <= 1.0
    assert 0.5 < y["from"] < y["to"] <= 1.0


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
        "What leaves a chamber whose", "no body&#39;s tilt is stated",
        "Forces were not measured.", "swing_check (3)", "at a limit of its range",
        "3 models predict as well; the best explains 98 % [92 %, 99 %] of the gap",
        "Missing: air leak or supply sag or angle bias",
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
    (ax,) = gap_bars(result).axes
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
@pytest.mark.parametrize("gain", [1.5, None])
def test_a_column_of_the_models_tried_is_there_if_it_has_numbers(rig, gain, tmp_path):
    result = report(rig, Verdict.NAMED, ["air_leak"]).to_dict()
    for row in result["tried"]:
        row["gain"] = row["gain_error"] = gain
    page = write_diagnosis(result, [], tmp_path)[0].read_text("utf-8")
    assert ('<th scope="col">standard error</th>' in page) is (gain is not None)


@pytest.mark.usefixtures("quick")
def test_a_model_whose_size_is_not_known_carries_a_warning(rig, tmp_path):
    result = report(rig, Verdict.NAMED, ["air_leak"]).to_dict()
    result["tried"][0]["size_known"] = False
    page = write_diagnosis(result, [], tmp_path)[0].read_text("utf-8")
    assert "the interval includes its absence" in page


@pytest.mark.usefixtures("quick")
def test_a_film_is_in_the_page_and_waits_to_be_opened(rig, tmp_path):
    one = report(rig, Verdict.NAMED, **VERDICTS[Verdict.NAMED])
    film = tmp_path / "gap.gif"
    film.write_bytes(b"GIF89a of an arm")
    without = page_of(one, tmp_path)
    page, *_ = write_diagnosis(one.to_dict(), one.comparisons, tmp_path, film=film)
    shown = page.read_text("utf-8")
    assert "<details" not in without
    (opened,) = re.findall(r'<details class="film">(.*?)</details>', shown, re.DOTALL)
    assert "data:image/gif;base64,R0lGODlhIG9mIGFuIGFybQ==" in opened
