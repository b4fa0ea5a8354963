"""Static models on the page: a line and three marks per model; better ones are named."""

from __future__ import annotations

import itertools

import pytest

from pamsim.report.reproduce_figures import static_models_figure
from pamsim.report.reproduce_page import better_models, not_lowered, write_reproduction
from pamsim.report.style import BLUE, GREEN, VERMILION


def model(name, accepted, rms, unseen, **rest):
    found = {"term": "locks", "name": "passive.locking", "unit": "N/Pa", "value": -4.5678e-4,
             "interval95": [-5.0e-4, -4.0e-4], "flags": ["trade_off"]}  # fmt: skip
    return {
        "name": name,
        "accepted": accepted,
        "rms_deg": rms,
        "leave_one_out_rms_deg": unseen,
        "left_out_block_rms_deg": {"small steps": 2.0 * unseen, "large steps": 9.0},
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


@pytest.fixture
def figure(models, result):
    return static_models_figure(models, result["calibration"])


def test_every_model_has_its_marks_on_its_own_line(models, figure):
    names = [" ".join(t.get_text().split()) for t in figure.axes[0].get_yticklabels()]
    assert names == [entry["name"] for entry in ordered(models)]
    by_name = {entry["name"]: entry for entry in models}
    for marker, colour, key in (("o", BLUE, "rms_deg"), ("D", VERMILION, "leave_one_out_rms_deg")):
        found = marks(figure, marker, colour)
        assert found == {float(i): by_name[name][key] for i, name in enumerate(names)}
    assert marks(figure, "^", GREEN) == {
        float(i): 2.0 * by_name[name]["leave_one_out_rms_deg"] for i, name in enumerate(names)
    }


def test_small_steps_that_a_model_cannot_predict_have_no_mark(models, result):
    models[1]["left_out_block_rms_deg"]["small steps"] = None
    del models[3]["left_out_block_rms_deg"]["small steps"]
    figure = static_models_figure(models, result["calibration"])
    assert len(marks(figure, "^", GREEN)) == len(models) - 2
    assert len(marks(figure, "o", BLUE)) == len(models)


def test_lines_are_the_nested_error_and_those_of_the_best_torque_laws(figure):
    upright = [line for line in figure.axes[0].lines if list(line.get_ydata()) == [0, 1]]
    assert [line.get_xdata()[0] for line in upright] == [1.234, 1.111, 2.222]
    (legend,) = figure.legends
    shown = [text.get_text() for text in legend.get_texts()]
    for words in ("nested: form chosen without the row: 1.23", "rows: 1.11 deg", "steps: 2.22 deg"):
        assert any(words in text for text in shown)


def test_accepted_models_are_drawn_first_and_darker(figure):
    labels = figure.axes[0].get_yticklabels()
    colours = [label.get_color() for label in labels]
    assert len(set(colours[:2])) == 1
    assert set(colours[:2]).isdisjoint(colours[2:])


def test_whole_figure_is_inside_its_edges(models, result):
    """Long names are broken, so that neither they nor the label of the axis are cut off."""
    wordy = [{**entry, "name": f"{entry['name']}, and in many more words"} for entry in models]
    figure = static_models_figure(wordy * 4, result["calibration"])
    figure.canvas.draw()
    width, _ = figure.canvas.get_width_height()
    (ax,) = figure.axes
    texts = [ax.xaxis.label, *ax.get_yticklabels(), *ax.get_xticklabels()]
    for text in texts:
        box = text.get_window_extent()
        if text.get_visible() and text.get_text():
            assert -1.0 <= box.x0 <= box.x1 <= width + 1.0, text.get_text()
    assert ax.get_window_extent().width > 0.5 * width
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert -1.0 <= box.x0 <= box.x1 <= width + 1.0
    boxes = [label.get_window_extent() for label in ax.get_yticklabels()]
    assert all(upper.y0 > lower.y1 for upper, lower in itertools.pairwise(boxes))


def test_models_that_predict_better_than_the_one_used_are_named(models):
    def named(some):
        return [model["name"] for model in better_models({"static_models": some})]

    assert named(models) == ["another law"]
    assert named([entry for entry in models if entry["name"] != "another law"]) == []
    assert named([entry for entry in models if not entry["accepted"]]) == []
    assert named(None) == []


def test_accepted_models_that_predict_no_better_are_named(models):
    def named(some):
        result = {"static_models": some}
        return [
            not_lowered(result, "leave_one_out_rms_deg"),
            not_lowered(result, "left_out_block_rms_deg", "small steps"),
        ]

    assert named(models) == [[], []]
    models.insert(3, model("+ idle term", True, 0.7, 1.0))
    assert named(models) == [["+ idle term"]] * 2
    models[3]["left_out_block_rms_deg"]["small steps"] = 1.9
    assert named(models) == [["+ idle term"], []]
    models[3]["left_out_block_rms_deg"]["small steps"] = None
    assert named(models) == [["+ idle term"]] * 2
    assert named(None) == [[], []]


@pytest.fixture
def page(result, tmp_path, quick):
    """The page with some static models, and the names of its files."""

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
    assert '<figure id="static_models">' in source
    assert "Recorded by <code>python calibrate.py</code>" in source
    source, _ = page([entry for entry in models if entry["name"] != "another law"])
    assert "rows held out better" not in source


def test_accepted_models_come_first_with_unit_interval_and_warning(page, models):
    source, _ = page(models)
    assert source.index("+ locking: the model used</th>") < source.index("another law</th>")
    assert "<td>0.80</td><td>1.00</td><td>2.00</td>" in source
    assert "passive.locking = −0.000457 N/Pa (−0.000500 to −0.000400); trade off" in source


def test_page_states_the_nested_error_first_and_what_choosing_costs(page, models):
    source, _ = page(models)
    section = source[source.index("<h2>Static models compared") :]
    for words in (
        "<b>1.23 deg</b> RMS if the form of the model is chosen without them",
        "reaches 1.00 deg: choosing among 5 forms on 21 rows costs 0.23 deg",
        "“one form” for 20 rows, “other” for 1 row.",
        "predicts them with 1.36 deg, the best torque law with 2.22 deg",
        "<td>0.88</td><td>1.11</td><td>–</td>",
    ):
        assert words in section, words
    assert section.index("1.23 deg") < section.index("1.00 deg")


def test_page_says_which_accepted_term_does_not_lower_the_held_out_error(page, models):
    rule = "A term was accepted only if it lowers the second error"
    assert rule in page(models)[0]
    models.insert(3, model("+ idle term", True, 0.7, 1.0))
    source, _ = page(models)
    assert rule not in source
    assert "Accepted although the second error is not lowered: “+ idle term”." in source
    models[3]["leave_one_out_rms_deg"] = 0.99
    source, _ = page(models)
    assert rule in source
    assert "Accepted although the third error is not lowered: “+ idle term”." in source


def test_page_says_what_remains_unknown_of_a_muscle_that_pressure_lengthens(page, models):
    assert "What remains unknown" not in page(models)[0]
    models[2]["parameters"][0].update(name="braid.extensibility", unit="1/Pa", value=1.3e-7)
    source, _ = page(models)
    assert "What remains unknown" in source
    assert "1.3 % of the length per bar would be 6 % at 5 bar" in source.replace("\n", " ")
