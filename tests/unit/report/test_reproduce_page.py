"""The page of the reproduction: complete, escaped, with a word for what is absent."""

from __future__ import annotations

import csv
import itertools
import math
import re
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.image import imread

from pamsim.report import reproduce_figures
from pamsim.report.reproduce_figures import static_models_figure
from pamsim.report.reproduce_page import (
    better_models,
    not_lowered,
    source_tag,
    verdict_sentence,
    write_reproduction,
)
from pamsim.report.style import CSS_PER_PIXEL, new_figure, save_png
from pamsim.scene.series_colours import BLUE, GREEN, VERMILION
from tests.unit.report.figure_laws import check_figure
from tests.unit.report.page_laws import Page

FIGURES = ("figure_6_static", "figure_7_large_medium", "figure_8_small", "figure_9_models",
           "errors", "pressures", "static_models")  # fmt: skip
FILES = {"index.html", "rows.csv", *(f"{name}.png" for name in FIGURES)}


def write(result, recordings, out: Path) -> Page:
    write_reproduction(result, recordings, out)
    page = Page((out / "index.html").read_text(encoding="utf-8"))
    assert not re.search(r"\b(nan|inf|None)\b", page.text)
    return page


def table(folder):
    with (folder / "rows.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def distinct(result):
    return [row for row in result["rows"] if row["repeats"] is None]


@pytest.fixture
def rows(result):
    return distinct(result)


def test_every_file_is_written_and_is_the_same_whatever_else_the_result_holds(
    result, recordings, tmp_path, monkeypatch
):
    monkeypatch.setattr("pamsim.report.page.save_vectors", lambda figure, path: None)
    out = tmp_path / "new" / "folder"
    assert write_reproduction(result, recordings, out) == out / "index.html"
    assert {path.name for path in out.iterdir()} == FILES
    assert all(path.stat().st_size > 500 for path in out.iterdir())
    for name, image in images(out).items():
        pixels = imread(out / f"{name}.png")
        size = [int(image[side]) / CSS_PER_PIXEL for side in ("height", "width")]
        assert pixels.shape[:2] == pytest.approx(size, abs=2)
        assert pixels.shape[1] == 1440
        assert 0.002 < np.mean(pixels[..., :3].min(axis=2) < 0.7) < 0.4  # neither blank nor black
    result["future"] = {"x": [1]}
    for place in (result["rows"][3], result["g1"], result["paper"], result["parameters"][0]):
        place["future"] = object()
    # Nor do settings of the process matter, which stay.
    with matplotlib.rc_context({"font.size": 30, "axes.facecolor": "red", "xtick.color": "red"}):
        before = dict(matplotlib.rcParams)
        write_reproduction(result, recordings, tmp_path / "again")
        assert dict(matplotlib.rcParams) == before
    for name in FILES:
        assert (out / name).read_bytes() == (tmp_path / "again" / name).read_bytes(), name


def images(folder):
    """Attributes of the images of a page, by the names of their figures."""
    page = Page((folder / "index.html").read_text(encoding="utf-8"))
    names = [attrs["id"] for attrs in page.all("figure")]
    assert set(names) == set(FIGURES)
    return dict(zip(names, page.all("img"), strict=True))


@pytest.mark.usefixtures("quick")
def test_page_and_table_have_every_row_and_the_page_marks_repeats_and_slips(
    result, recordings, tmp_path
):
    page = write(result, recordings, tmp_path)
    rows = [attrs for attrs in page.all("tr") if "id" in attrs]
    assert [attrs["id"] for attrs in rows] == [f"row-{row}" for row in range(1, 25)]
    repeated = [attrs["id"] for attrs in rows if attrs.get("class") == "repeat"]
    assert repeated == ["row-22", "row-23", "row-24"]
    for row in result["rows"]:
        for key in ("measured_deg", "simulated_deg"):
            assert f"{row[key]:.2f}".replace("-", "−") in page.text
    assert f"Row 22: {result['rows'][21]['slip']}; counted once in the RMS." in page.text
    assert f"Row 4: {result['rows'][3]['slip']}." in page.text
    files = [a["href"] for a in page.all("a") if not a["href"].startswith("#")]
    assert files
    assert all((tmp_path / name).is_file() for name in files)
    lines = table(tmp_path)
    assert list(lines[0]) == list(result["rows"][0])
    for line, row in zip(lines, result["rows"], strict=True):
        for key in ("p1_kpa", "load_kg", "measured_deg", "simulated_deg", "error_deg"):
            assert float(line[key]) == row[key]
        assert line["monotonic"] == str(row["monotonic"]).lower()
        assert line["repeats"] == ("" if row["repeats"] is None else str(row["repeats"]))


@pytest.mark.usefixtures("quick")
def test_verdict_is_made_of_the_result_s_numbers(result, recordings, tmp_path):
    page = write(result, recordings, tmp_path)
    seen = f"{result['rms_deg']:.2f} deg RMS"
    nested = result["calibration"]["nested_leave_one_out"]["rms_deg"]
    g1, g2 = (result[name] for name in ("g1", "g2"))
    for words in (
        f"21 distinct operating points predicted with {nested:.2f} deg RMS, each by a model",
        f"(nested leave-one-out); {seen} in sample (worst: row",
        f"G₁: T = {g1['T_s']:.3f} s (output error, unit gain) against 0.646 s printed",
        f"T₁ = {g2['T1_s']:.3g} s, T₂ = {g2['T2_s']:.3f} s (output error, unit gain)"
        " against 0.0903 s and 0.579 s",
        "Checks: 1 of 10 fail",
    ):
        assert words in page.text, words
    # Held-out errors of another arm are no headline.
    seen = f"21 distinct operating points reproduced with {seen} (worst"
    for calibration in ({**result["calibration"], "applies": False}, None):
        assert verdict_sentence({**result, "calibration": calibration}).startswith(seen)


@pytest.mark.usefixtures("quick")
def test_hostile_text_is_escaped_on_the_page_and_kept_in_the_table(result, recordings, tmp_path):
    attack = "<script>alert('x')</script>\n<img src=x onerror=y>\"&"
    result["rig"] = result["start"] = result["start_meaning"] = attack
    result["rows"][0].update(message=attack, outcome="engine_warning", slip=attack)
    result["checks"][0].update(name=attack, sentence=attack)
    result["g1"]["method"] = result["g2"]["status"] = attack
    result["paper"]["source"] = attack
    result["paper"]["notes"] = [attack]
    result["parameters"][0].update(name=attack, unit=attack, source=attack, note=attack)
    result["versions"][attack] = attack
    page = write(result, recordings, tmp_path)
    assert len(page.all("script")) == 1  # the page's own
    assert len(page.all("img")) == len(FIGURES)
    assert page.text.count(attack) >= 15
    assert table(tmp_path)[0]["message"] == attack


@pytest.mark.usefixtures("quick")
def test_what_is_absent_is_left_out_or_a_dash(result, recordings, tmp_path):
    for value in (math.nan, math.inf, None):
        result["wall_s"] = result["rows"][0]["settling_s"] = value
        write(result, recordings, tmp_path)
    result["g2"]["arx"]["free_gain"] = {
        "method": "arx", "status": "complex_poles", "K": None, "T1_s": None, "T2_s": None,
        "fit_percent": None,
    }  # fmt: skip
    result["figure9"]["g2_arx"] = None
    result["rows"][12].update(
        simulated_deg=None, error_deg=None, settling_s=None, outcome="not_finite",
        message="the angle is not finite at 0.21 s",
    )  # fmt: skip
    result["rms_deg"] = None
    page = write(result, recordings, tmp_path)
    assert "complex poles" in page.text
    assert "20 of 21 distinct operating points" in page.text
    assert "the run ended early (not finite): the angle is not finite at 0.21 s" in page.text
    line = table(tmp_path)[12]
    assert line["simulated_deg"] == line["error_deg"] == ""
    for key in ("g1", "g2", "figure9", "worst", "fit_percent", "parameters"):
        result[key] = None
    page = write(result, recordings, tmp_path)
    assert "against 0.646 s" not in page.text
    assert "as printed" in page.text


def test_source_tags():
    for source, tag in (
        ("Matiskova 2021, Table 1 (MAS-20-250)", "paper"),
        ("published constants for DMSP-20-200", "paper"),
        ("identified", "identified"),
        ("Assumed: never printed", "assumed"),
        ("Festo datasheet", "datasheet"),
        ("", "other"),
    ):
        assert source_tag(source) == tag, source


def test_figures_show_what_the_result_holds_with_units(result, recordings, rows):
    responses = reproduce_figures.large_medium_responses(rows, recordings)
    small = reproduce_figures.small_responses(rows, recordings)
    models = reproduce_figures.model_responses(result["figure9"])
    for figure in (
        reproduce_figures.static_characteristic(rows, result["figure6"]),
        responses,
        small,
        models,
        reproduce_figures.errors_by_row(rows, result["rms_deg"]),
        reproduce_figures.pressure_courses(rows, recordings),
    ):
        labels = [text for ax in figure.axes for text in (ax.get_xlabel(), ax.get_ylabel()) if text]
        assert len(labels) >= 2
        assert all(text.endswith("]") or text == "row of Tables 1 and 2" for text in labels)
    courses = [line for ax in responses.axes for line in ax.lines if len(line.get_xdata()) > 100]
    ends = sorted(line.get_ydata()[-1] for line in courses)
    wanted = sorted(np.degrees(recordings[row].angle[-1]) for row in range(1, 13))
    assert ends == pytest.approx(wanted, rel=1e-4)  # all but settled where the axis ends
    for figure, sizes in ((responses, ("large", "medium")), (small, ("small",))):
        texts = {text.get_text() for ax in figure.axes for text in ax.texts}
        assert texts == {str(row["row"]) for row in rows if row["size"] in sizes}
    data = result["figure9"]  # differences are to the simulation
    wanted = np.subtract(data["g1_paper"], data["simulated"])
    lower = [line.get_ydata() for line in models.axes[1].get_lines()]
    assert any(len(y) == len(wanted) and np.allclose(y, wanted) for y in lower)


def test_time_axis_is_cut_only_after_everything_settled_and_absence_is_stated(
    result, recordings, rows
):
    for row in result["rows"]:
        row["settling_s"] = 0.8
    cut = reproduce_figures.small_responses(rows, recordings)
    assert 2.0 < cut.axes[0].get_xlim()[1] < 3.0
    result["rows"][13]["settling_s"] = None
    whole = reproduce_figures.small_responses(rows, recordings)
    assert whole.axes[0].get_xlim()[1] > 5.0
    none = reproduce_figures.model_responses({"time_s": None, "simulated": None})
    assert any("no simulated response" in text.get_text() for text in none.axes[0].texts)


def test_a_figure_is_whole_or_not_there(tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    figure, _ = new_figure(2.0)

    def interrupted(part, **options):
        part.write_bytes(b"half")
        raise KeyboardInterrupt

    figure.savefig = interrupted
    with pytest.raises(KeyboardInterrupt):
        save_png(figure, path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_pyplot_and_the_engine_are_never_imported():
    code = (
        "import sys, pamsim.report.reproduce_page; "
        "sys.exit('matplotlib.pyplot' in sys.modules or 'mujoco' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def model(name, accepted, rms, unseen):
    found = {"term": "locks", "name": "passive.locking", "unit": "N/Pa", "value": -4.5678e-4,
             "interval95": [-5.0e-4, -4.0e-4], "flags": ["trade_off"]}  # fmt: skip
    return {
        "name": name, "accepted": accepted, "rms_deg": rms, "leave_one_out_rms_deg": unseen,
        "left_out_block_rms_deg": {"small steps": 2.0 * unseen, "large steps": 9.0},
        "parameters": [found],
    }  # fmt: skip


@pytest.fixture
def models():
    return [
        model("published law", True, 8.4, 8.4),
        model("published law, radius fitted, a name much longer than others", False, 4.1, 4.2),
        model("+ locking: the model used", True, 0.8, 1.0),
        model("used, and <b>friction</b>", False, 0.7, 1.1),
        model("another law", False, 0.75, 0.9),
    ]


IDLE, BEST = model("+ idle term", True, 0.7, 1.0), "best_torque_laws"


def marks(figure, marker, colour):
    """Errors of the marks of one kind by their places, the legend's left out."""
    return {
        round(line.get_ydata()[0]): line.get_xdata()[0]
        for line in figure.axes[0].lines
        if line.get_marker() == marker and line.get_color() == colour and len(line.get_xdata())
    }


def test_every_model_has_its_marks_on_its_own_line_accepted_ones_first(models, result):
    models[1]["left_out_block_rms_deg"]["small steps"] = None  # cannot be predicted: no mark
    figure = static_models_figure(models, result["calibration"])
    ordered = sorted(models, key=lambda entry: not entry["accepted"])
    labels = figure.axes[0].get_yticklabels()
    assert [" ".join(t.get_text().split()) for t in labels] == [e["name"] for e in ordered]
    assert marks(figure, "o", BLUE) == {i: e["rms_deg"] for i, e in enumerate(ordered)}
    unseen = {i: entry["leave_one_out_rms_deg"] for i, entry in enumerate(ordered)}
    assert marks(figure, "D", VERMILION) == unseen
    small = {i: entry["left_out_block_rms_deg"]["small steps"] for i, entry in enumerate(ordered)}
    assert marks(figure, "^", GREEN) == {i: error for i, error in small.items() if error}
    colours = [label.get_color() for label in labels]
    assert len(set(colours[:2])) == 1
    assert set(colours[:2]).isdisjoint(colours[2:])
    # Lines are the nested error and those of the best torque laws.
    upright = [line for line in figure.axes[0].lines if list(line.get_ydata()) == [0, 1]]
    nested, best = (result["calibration"][key] for key in ("nested_leave_one_out", BEST))
    lines = [nested["rms_deg"], best["leave_one_out_rms_deg"], best["small_steps_rms_deg"]]
    assert [line.get_xdata()[0] for line in upright] == lines
    shown = " ".join(text.get_text() for text in figure.legends[0].get_texts())
    names = ("nested: form chosen without the row", "rows", "steps")
    for name, error in zip(names, lines, strict=True):
        assert f"{name}: {error:.2f} deg" in shown


def test_whole_figure_is_inside_its_edges(models, result):
    """Long names are broken, so that neither they nor the label of the axis are cut off."""
    wordy = [{**entry, "name": f"{entry['name']}, and in many more words"} for entry in models]
    figure = static_models_figure(wordy * 4, result["calibration"])
    check_figure(figure)
    (ax,) = figure.axes
    assert ax.get_window_extent().width > 0.5 * figure.bbox.width
    boxes = [label.get_window_extent() for label in ax.get_yticklabels()]
    assert all(upper.y0 > lower.y1 for upper, lower in itertools.pairwise(boxes))


def test_models_that_predict_better_and_accepted_ones_that_do_not_are_named(models):
    def named(some):
        result = {"static_models": some}
        return (
            [model["name"] for model in better_models(result)],
            not_lowered(result, "leave_one_out_rms_deg"),
            not_lowered(result, "left_out_block_rms_deg", "small steps"),
        )

    assert named(models) == (["another law"], [], [])
    assert named(models[:-1]) == ([], [], [])
    assert named([entry for entry in models if not entry["accepted"]]) == ([], [], [])
    assert named(None) == ([], [], [])
    for small, names in ((2.0, ["+ idle term"]), (1.9, []), (None, ["+ idle term"])):
        idle = {**IDLE, "left_out_block_rms_deg": {"small steps": small}}
        assert named([*models[:3], idle])[1:] == (["+ idle term"], names)


@pytest.mark.usefixtures("quick")
def test_page_compares_the_static_models(models, result, tmp_path, monkeypatch):
    for name in ("large_medium_responses", "small_responses", "pressure_courses"):
        monkeypatch.setattr(reproduce_figures, name, lambda *_: None)

    def page(some):
        path = write_reproduction({**result, "static_models": some}, {}, tmp_path)
        assert (tmp_path / "static_models.png").exists() == bool(some)
        return path.read_text(encoding="utf-8").replace("\n", " ")

    assert "Static models" not in page(None) + page([])
    source = page(models)
    section = source[source.index("<h2>Static models compared") :]
    rule = "A term was accepted only if it lowers the second error"
    calibration = result["calibration"]
    nested, best = calibration["nested_leave_one_out"], calibration[BEST]
    (most, rows), (least, row) = nested["selected"].items()
    law = calibration["torque_laws"][1]
    for words in (
        f"<b>{nested['rms_deg']:.2f} deg</b> RMS if the form of the model is chosen without them",
        "reaches 1.00 deg: choosing among 5 forms on 21 rows costs"
        f" {nested['rms_deg'] - 1.0:.2f} deg",
        f"“{most}” for {rows} rows, “{least}” for {row} row.",
        f"predicts them with {calibration['small_steps_rms_deg']:.2f} deg RMS error, the best"
        f" torque law with {best['small_steps_rms_deg']:.2f} deg",
        f"<td>{law['rms_deg']:.2f}</td><td>{law['leave_one_out_rms_deg']:.2f}</td><td>–</td>",
        "<td>0.80</td><td>1.00</td><td>2.00</td>",
        "One model that was not accepted predicts the rows held out better",
        "“another law” (0.90 deg)",
        "&lt;b&gt;friction&lt;/b&gt;",
        '<figure id="static_models">',
        "Recorded by <code>python scripts/mas20_calibration.py</code>",
        "passive.locking = −0.000457 N/Pa (−0.000500 to −0.000400); trade off",
        rule,
    ):
        assert words in section, words
    assert section.index("+ locking: the model used</th>") < section.index("another law</th>")
    assert "What remains unknown" not in source
    assert "rows held out better" not in page(models[:-1])
    # An accepted term that does not lower the held-out error is named.
    accepted = "Accepted although the {} error is not lowered: “+ idle term”."
    source = page([*models[:3], IDLE])
    assert rule not in source
    assert accepted.format("second") in source
    source = page([*models[:3], {**IDLE, "leave_one_out_rms_deg": 0.99}])
    assert rule in source
    assert accepted.format("third") in source
    # What remains unknown of a muscle that pressure lengthens.
    models[2]["parameters"][0].update(name="braid.extensibility", unit="1/Pa", value=1.3e-7)
    source = page(models)
    assert "What remains unknown" in source
    assert "1.3 % of the length per bar would be 6 % at 5 bar" in source
