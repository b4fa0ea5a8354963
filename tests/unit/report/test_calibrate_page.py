"""The page of a calibration: numbered figures, legends beside the data, units, warnings."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.report.calibrate_page import (
    correlations,
    headline,
    parameter_ranges,
    profile_curves,
    rest_errors,
    write_calibration,
)
from pamsim.report.style import series_look
from pamsim.report.trial_signals import shown_trials, trial_signals
from pamsim.scene.series_colours import BLUE, VERMILION

TIME = np.linspace(0.0, 1.0, 50)


def parameter(name, value, interval, *, flags=(), scale="linear"):
    written = {"unit": "N/bar", "value": value, "before": 4.0, "interval95": interval,
               "bounds": [1.0, 16.0]}  # fmt: skip
    return {
        "name": name, "value": value * 1e-5, "unit": "N/Pa", "scale": scale,
        "tied": [], "flags": list(flags),
        "range_source": "a factor 4 either way", "sentence": "at its bound" if flags else "",
        "written": written,
    }  # fmt: skip


def compared(trial, channel, *, held, off):
    measured = np.sin(6.0 * TIME) * (1e4 if channel.startswith("p") else 0.1)
    return SimpleNamespace(
        trial=trial, protocol=trial[0], channel=channel, held_out=held, time=TIME,
        measured=measured, before=0.8 * measured, after=(1.0 + off) * measured,
    )  # fmt: skip


COMPARISONS = [
    compared(trial, channel, held=held, off=off)
    for trial, held, off in (("a_1", False, 0.01), ("a_2", False, 0.02), ("b_1", True, 0.0))
    for channel in ("angle", "pressure_1", "pressure_2")
]
ROWS = [
    {"row": f"row {i}", "measured_deg": 10.0 * i, "before_deg": 10.0 * i + 1.0,
     "after_deg": 10.0 * i - 0.5}
    for i in (1, 2, 3)
]  # fmt: skip
TABLE = {"trial": "table", "held_out": False, "rows": ROWS}
PARAMETERS = [
    parameter("force.e", 8.0, [7.0, 9.0], scale="log"),
    parameter("force.a", 16.0, None, flags=["at_bound"]),
]
CORRELATION = [[1.0, None], [None, None]]


@pytest.fixture
def result():
    misfit = {"channel": "pressure_1", "unit": "kPa", "before": 10.02, "after": 0.376,
              "held_out_before": None, "held_out_after": None}  # fmt: skip
    return {
        "schema": "pamsim-calibrate/1", "rig": "<arm>", "data": ["table"], "status": "converged",
        "sentence": "no parameter at a limit", "notes": ["force_1 was <not> measured"],
        "misfit": [misfit], "parameters": PARAMETERS,
        "trials": [TABLE], "profiles": [], "calibrated_rig": "out/rig", "seed": 0,
        "simulations": 12, "seconds": 1.0, "versions": {"pamsim": "0.1.0"},
        "fit": {
            "correlation": CORRELATION, "determined": [], "evaluations": 3,
            "interval_method": "linear", "iterations": 2, "diverged": 0, "same_optimum": 1,
            "noise": {"pressure_1": {"noise_sd": 400.0, "noise_source": "repeats"}},
            "starts": [{"objective": 1.0, "converged": True, "iterations": 2,
                        "same_optimum": True}],
        },
    }  # fmt: skip


@pytest.mark.usefixtures("quick")
def test_page_numbers_its_figures_is_escaped_and_gives_every_warning(result, tmp_path):
    for shown, count in (([], 3), (COMPARISONS, 4)):
        page = write_calibration(result, shown, tmp_path).read_text(encoding="utf-8")
        found = re.findall(r"<figcaption><b>Figure (\d+)\.", page)
        assert list(map(int, found)) == list(range(1, count + 1))
    for words in ("&lt;not&gt;", "at its bound", "no interval", "0.400 kPa (from: repeats)"):
        assert words in page, words
    assert "<arm>" not in page
    assert "None" not in page


def test_headline_is_made_of_sentences(result):
    assert headline(result) == (
        "2 parameters fitted. RMS misfit, pressure 1: 10 → 0.38 kPa. No parameter at a limit."
    )
    result["misfit"][0]["after"] = None
    assert headline(result) == "2 parameters fitted. No parameter at a limit."


def test_held_out_trials_are_drawn_first_and_of_repeats_the_worst_beside_a_legend():
    assert shown_trials(COMPARISONS) == ["b_1", "a_2"]
    # A channel that never moved has no range to measure an error by.
    still = compared("a_1", "pressure_2", held=False, off=0.0)
    still.measured, still.after = 0.0 * TIME, 300.0 + 0.0 * TIME
    assert shown_trials([*COMPARISONS[:-1], still]) == ["b_1", "a_2"]
    figure = trial_signals(COMPARISONS)
    assert all(ax.get_legend() is None for ax in figure.axes)
    titles = [ax.get_title(loc="left") for ax in figure.axes[::2]]
    assert titles == ["b_1 (held out)", "a_2 (fitted)"]
    assert {ax.get_ylabel() for ax in figure.axes} == {"angle β [deg]", "gauge\npressure [kPa]"}
    for left_out, muscles in (((), ["muscle 1", "muscle 2"]), (("pressure_1", "pressure_2"), []),
                              (("pressure_2",), [])):  # fmt: skip
        some = [part for part in COMPARISONS if part.channel not in left_out]
        (legend,) = trial_signals(some).legends
        shown = [text.get_text() for text in legend.get_texts()]
        assert shown == ["measured", "before", "after", *muscles], left_out


def test_a_muscle_has_one_colour_whatever_of_it_was_measured():
    channels = ["knee.angle", *(f"{m}.pressure" for m in "abc"), *(f"{m}.force" for m in "bc")]
    figure = trial_signals([compared("a_1", one, held=False, off=0.0) for one in channels])
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()][3:] == ["a", "b", "c"]
    _, pressures, forces = ([line.get_color() for line in ax.lines[::3]] for ax in figure.axes)
    assert forces == pressures[1:]
    # By its number, if it has no name.
    figure = trial_signals([compared("a_1", f"pressure_{n}", held=True, off=0.0) for n in (3, 2)])
    (ax,) = figure.axes
    assert [line.get_color() for line in ax.lines[::3]] == [series_look(2)[0], series_look(1)[0]]
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    assert named == ["measured", "before", "after", "muscle 2", "muscle 3"]


def test_errors_at_rest_are_simulated_minus_measured():
    (ax,) = rest_errors([TABLE]).axes
    drawn = {line.get_label(): list(line.get_ydata()) for line in ax.lines}
    assert drawn["before: 1.00 deg RMS"] == pytest.approx([1.0] * 3)
    assert drawn["after: 0.50 deg RMS"] == pytest.approx([-0.5] * 3)
    (alone,) = rest_errors([{**TABLE, "rows": TABLE["rows"][:1]}]).axes  # a table may be that short
    assert alone.get_xlabel() == ax.get_xlabel() == "row of the table"


def test_places_in_the_range_follow_its_scale():
    (ax,) = parameter_ranges(PARAMETERS).axes
    marks = {
        (line.get_marker(), line.get_ydata()[0]): (line.get_xdata()[0], line.get_color())
        for line in ax.lines
        if line.get_marker() in "oD" and len(line.get_xdata())
    }
    assert marks["D", 1][0] == pytest.approx(0.75)  # 8 in 1 to 16, by factors
    assert marks["o", 1][0] == pytest.approx(0.5)
    assert marks["o", 0][0] == pytest.approx(0.2)  # 4 in 1 to 16, by differences
    assert (marks["D", 1][1], marks["D", 0][1]) == (BLUE, VERMILION)
    assert [*ax.get_xticks()] == [0.0, 1.0]
    (ends,) = (
        line.get_xdata() for line in ax.lines if len(set(line.get_xdata()) - {0.0, 1.0}) == 2
    )
    assert ends == pytest.approx(np.log([7.0, 9.0]) / np.log(16.0))
    written = {text.get_text() for text in ax.texts}
    assert written == {"7.00 to 9.00 N/bar", "no interval", "1.00", "16.0"}


def test_correlations_without_a_number_stay_empty_and_profiles_have_the_unit_of_the_file():
    figure = correlations(PARAMETERS, CORRELATION)
    assert [text.get_text() for text in figure.axes[0].texts] == ["1.00"]
    (image,) = figure.axes[0].images
    assert image.get_clim() == (-1.0, 1.0)
    assert image.to_rgba(0.0)[:3] == pytest.approx([0.97] * 3, abs=0.01)  # none is white
    profile = {"name": "force.e", "values": [6e-5, 8e-5, 1e-4], "rise": [4.0, 0.0, None],
               "threshold": 3.84, "sentence": "closed"}  # fmt: skip
    (ax,) = profile_curves([profile], {p["name"]: p for p in PARAMETERS}).axes
    assert list(ax.lines[0].get_xdata()) == pytest.approx([6.0, 8.0, 10.0])
    assert ax.get_xlabel() == "force.e [N/bar]"
