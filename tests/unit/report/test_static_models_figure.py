"""Static models on the page: a line and a pair of marks per model; better ones are named."""

from __future__ import annotations

import itertools

import pytest

from pamsim.papers.reproduce_checks import LEAVE_ONE_OUT_LIMIT_DEG
from pamsim.report.reproduce_page import better_models, write_reproduction
from pamsim.report.static_models_figure import TORQUE_LAW_DEG, static_models_figure
from pamsim.report.style import BLUE, VERMILION


def model(name, accepted, rms, unseen, **rest):
    found = {"term": "locks", "name": "passive.locking", "unit": "N/Pa", "value": -4.5678e-4,
             "interval95": [-5.0e-4, -4.0e-4], "flags": ["trade_off"]}  # fmt: skip
    return {
        "name": name,
        "accepted": accepted,
        "rms_deg": rms,
        "leave_one_out_rms_deg": unseen,
        "parameters": [found],
        **rest,
    }


@pytest.fixture
def models():
    return [
        model("published law", True, 8.4, 8.4, parameters=[]),
        model("published law, radius fitted, with a name that is much longer than others", False,
             4.1, 4.2),
        model("+ locking: the model used", True, 0.8, 1.0),
        model("used, and <b>friction</b>", False, 0.7, 1.1),
        model("another law", False, 0.75, 0.9),
    ]  # fmt: skip


def ordered(models):
    return sorted(models, key=lambda entry: not entry["accepted"])


def marks(figure, marker, colour):
    """Places and errors of the marks of one kind, the legend's left out."""
    return {
        float(line.get_ydata()[0]): float(line.get_xdata()[0])
        for line in figure.axes[0].lines
        if line.get_marker() == marker and line.get_color() == colour and len(line.get_xdata())
    }


def test_every_model_has_its_pair_of_marks_on_its_own_line(models):
    figure = static_models_figure(models)
    names = [" ".join(t.get_text().split()) for t in figure.axes[0].get_yticklabels()]
    assert names == [entry["name"] for entry in ordered(models)]
    by_name = {entry["name"]: entry for entry in models}
    for marker, colour, key in (("o", BLUE, "rms_deg"), ("D", VERMILION, "leave_one_out_rms_deg")):
        found = marks(figure, marker, colour)
        assert found == {float(i): by_name[name][key] for i, name in enumerate(names)}


def test_accepted_models_are_drawn_first_and_darker(models):
    labels = static_models_figure(models).axes[0].get_yticklabels()
    colours = [label.get_color() for label in labels]
    assert len(set(colours[:2])) == 1
    assert set(colours[:2]).isdisjoint(colours[2:])


def test_whole_figure_is_inside_its_edges(models):
    """Long names are broken, so that neither they nor the label of the axis are cut off."""
    wordy = [{**entry, "name": f"{entry['name']}, and in many more words"} for entry in models]
    figure = static_models_figure(wordy * 4)
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


def test_models_that_predict_better_than_the_one_used_are_named(models):
    def named(some):
        return [model["name"] for model in better_models({"static_models": some})]

    assert named(models) == ["another law"]
    assert named([entry for entry in models if entry["name"] != "another law"]) == []
    assert named([entry for entry in models if not entry["accepted"]]) == []
    assert named(None) == []


def test_page_line_and_check_hold_the_same_torque_law():
    assert TORQUE_LAW_DEG == LEAVE_ONE_OUT_LIMIT_DEG


@pytest.fixture
def page(result, tmp_path, monkeypatch):
    """The page with some static models, and the names of its files."""
    monkeypatch.setattr("pamsim.report.page.save_png", lambda figure, path: (691, 400))

    def write(models):
        paths = write_reproduction({**result, "static_models": models}, {}, tmp_path)
        return paths[0].read_text(encoding="utf-8"), {path.name for path in paths}

    return write


def test_page_without_static_models_has_no_section_of_them(page):
    for models in (None, []):
        source, files = page(models)
        assert "static_models.png" not in files
        assert "Static models" not in source


def test_page_names_the_better_model_and_escapes_names(page, models):
    source, files = page(models)
    assert "static_models.png" in files
    assert "One model that was not accepted predicts the rows held out better" in source
    assert "“another law” (0.90 deg)" in source
    assert "&lt;b&gt;friction&lt;/b&gt;" in source
    assert 'src="static_models.png"' in source
    assert "Recorded by <code>python calibrate.py</code>" in source
    source, _ = page([entry for entry in models if entry["name"] != "another law"])
    assert "rows held out better" not in source


def test_accepted_models_come_first_with_unit_interval_and_warning(page, models):
    source, _ = page(models)
    assert source.index("+ locking: the model used</th>") < source.index("another law</th>")
    assert "<td>0.80</td><td>1.00</td>" in source
    assert "passive.locking = −0.000457 N/Pa (−0.000500 to −0.000400); trade off" in source
