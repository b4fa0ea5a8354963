"""The ladder on the page: one line and one pair of marks per model, honest about better ones."""

from __future__ import annotations

import itertools

import pytest

from pamsim.papers.reproduce_checks import LEFT_OUT_LIMIT_DEG
from pamsim.report.numbers import NONE
from pamsim.report.reproduce_ladder import TORQUE_LAW_DEG, rivals, rung_views, static_ladder
from pamsim.report.reproduce_page import write_reproduction
from pamsim.report.style import BLUE, VERMILION


def rung(name, climbed, rms, unseen, **rest):
    found = {"term": "locks", "name": "passive.locking", "unit": "N/Pa", "value": -4.5678e-4,
             "interval95": [-5.0e-4, -4.0e-4], "flags": ["trade_off"]}  # fmt: skip
    return {
        "name": name,
        "climbed": climbed,
        "rms_deg": rms,
        "loo_rms_deg": unseen,
        "parameters": [found],
        **rest,
    }


@pytest.fixture
def ladder():
    return [
        rung("published law", True, 8.4, 8.4, parameters=[]),
        rung("published law, radius fitted, with a name that is much longer than others", False,
             4.1, 4.2),
        rung("+ locking: the model used", True, 0.8, 1.0),
        rung("used, and <b>friction</b>", False, 0.7, 1.1),
        rung("another law", False, 0.75, 0.9),
    ]  # fmt: skip


def marks(figure, marker, colour):
    """Places and errors of the marks of one kind, the legend's left out."""
    return {
        float(line.get_ydata()[0]): float(line.get_xdata()[0])
        for line in figure.axes[0].lines
        if line.get_marker() == marker and line.get_color() == colour and len(line.get_xdata())
    }


def test_every_model_has_its_pair_of_marks_on_its_own_line(ladder):
    figure = static_ladder(ladder)
    names = [" ".join(t.get_text().split()) for t in figure.axes[0].get_yticklabels()]
    assert names == [view.name for view in rung_views(ladder)]
    by_name = {entry["name"]: entry for entry in ladder}
    for marker, colour, key in (("o", BLUE, "rms_deg"), ("D", VERMILION, "loo_rms_deg")):
        found = marks(figure, marker, colour)
        assert found == {float(i): by_name[name][key] for i, name in enumerate(names)}


def test_climbed_models_come_first_in_figure_and_table(ladder):
    climbed = [view.climbed for view in rung_views(ladder)]
    assert climbed == sorted(climbed, reverse=True)
    labels = static_ladder(ladder).axes[0].get_yticklabels()
    colours = [label.get_color() for label in labels]
    assert len(set(colours[:2])) == 1
    assert set(colours[:2]).isdisjoint(colours[2:])


def test_whole_figure_is_inside_its_edges(ladder):
    """Long names are broken, so that neither they nor the label of the axis are cut off."""
    wordy = [{**entry, "name": f"{entry['name']}, and in many more words"} for entry in ladder]
    figure = static_ladder(wordy * 4)
    figure.canvas.draw()
    width, _ = figure.canvas.get_width_height()
    (ax,) = figure.axes
    texts = [ax.xaxis.label, *ax.get_yticklabels(), *ax.get_xticklabels()]
    for text in texts:
        box = text.get_window_extent()
        if text.get_visible() and text.get_text():
            assert -1.0 <= box.x0 <= box.x1 <= width + 1.0, text.get_text()
    assert ax.get_window_extent().width > 0.5 * width
    boxes = [label.get_window_extent() for label in ax.get_yticklabels()]
    assert all(upper.y0 > lower.y1 for upper, lower in itertools.pairwise(boxes))


def test_models_that_predict_better_than_the_one_used_are_named(ladder):
    assert [view.name for view in rivals(ladder)] == ["another law"]
    assert rivals([entry for entry in ladder if entry["name"] != "another law"]) == []
    assert rivals([entry for entry in ladder if not entry["climbed"]]) == []
    assert rivals([]) == []


def test_numbers_are_printed_with_unit_interval_and_doubt(ladder):
    view = rung_views(ladder)[1]
    assert (view.rms, view.left_out) == ("0.80", "1.00")
    (text,) = view.parameters
    assert text == "passive.locking = −0.000457 N/Pa (−0.000500 to −0.000400); trade off"


def test_unknown_and_missing_keys_are_survived(ladder):
    ladder[0] = {"future": object()}
    ladder[2].update(rms_deg=None, loo_rms_deg=float("nan"), parameters=[{"name": "x"}])
    figure = static_ladder(ladder)
    assert len(marks(figure, "o", BLUE)) == 3
    views = {view.name: view for view in rung_views(ladder)}
    assert views["unnamed model"].rms == views["unnamed model"].left_out == NONE
    assert views["+ locking: the model used"].parameters == [f"x = {NONE}"]
    assert rivals(ladder) == []


def test_page_line_and_check_hold_the_same_torque_law():
    assert TORQUE_LAW_DEG == LEFT_OUT_LIMIT_DEG


@pytest.mark.parametrize("missing", ["key", "none", "empty"])
def test_page_without_ladder_says_nothing_of_it(result, tmp_path, monkeypatch, missing):
    monkeypatch.setattr("pamsim.report.page.save_png", lambda figure, path: (691, 400))
    if missing != "key":
        result["ladder"] = None if missing == "none" else []
    paths = write_reproduction(result, {}, tmp_path)
    assert "ladder.png" not in {path.name for path in paths}
    page = paths[0].read_text(encoding="utf-8")
    assert "ladder" not in page.lower()
    assert "static model is what it is" not in page


def test_page_names_the_better_model_and_escapes_names(result, ladder, tmp_path, monkeypatch):
    monkeypatch.setattr("pamsim.report.page.save_png", lambda figure, path: (691, 400))
    result["ladder"] = ladder
    page = write_reproduction(result, {}, tmp_path)[0].read_text(encoding="utf-8")
    assert "One model that was not taken predicts the rows left out better" in page
    assert "“another law” (0.90 deg)" in page
    assert "&lt;b&gt;friction&lt;/b&gt;" in page
    assert 'src="ladder.png"' in page
    result["calibration"] = {"command": "python calibrate.py"}
    result["ladder"] = [entry for entry in ladder if entry["name"] != "another law"]
    page = write_reproduction(result, {}, tmp_path)[0].read_text(encoding="utf-8")
    assert "rows left out better" not in page
    assert "Recorded by <code>python calibrate.py</code>" in page
