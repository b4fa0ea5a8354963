"""Figures: right size, right data, units on every axis, and nothing global touched."""

from __future__ import annotations

import subprocess
import sys

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imread

from pamsim.report import reproduce_figures
from pamsim.report.style import CSS_PER_PIXEL, new_figure, save_png


def distinct(result):
    return [row for row in result["rows"] if row["repeats"] is None]


@pytest.fixture
def rows(result):
    return distinct(result)


@pytest.fixture
def figures(result, recordings, rows):
    return {
        "6": reproduce_figures.static_characteristic(rows, result["figure6"]),
        "7": reproduce_figures.large_medium_responses(rows, recordings),
        "8": reproduce_figures.small_responses(rows, recordings),
        "9": reproduce_figures.model_responses(result["figure9"]),
        "errors": reproduce_figures.errors_by_row(rows, result["rms_deg"]),
        "pressures": reproduce_figures.pressure_courses(rows, recordings),
    }


def test_sizes_are_those_the_page_announces(figures, tmp_path):
    for name, figure in figures.items():
        width, height = save_png(figure, tmp_path / f"{name}.png")
        pixels = imread(tmp_path / f"{name}.png")
        assert pixels.shape[:2] == pytest.approx((height / CSS_PER_PIXEL, width / CSS_PER_PIXEL), 2)
        assert pixels.shape[1] == 1440
        assert 0.002 < np.mean(pixels[..., :3].min(axis=2) < 0.7) < 0.4  # neither blank nor black


def test_every_labelled_axis_has_a_unit(figures):
    for figure in figures.values():
        assert isinstance(figure.canvas, FigureCanvasAgg)
        labels = [text for ax in figure.axes for text in (ax.get_xlabel(), ax.get_ylabel()) if text]
        assert len(labels) >= 2
        for text in labels:
            assert text.endswith("]") or text == "row of Tables 1 and 2"


def test_responses_are_in_degrees_and_seconds(figures, recordings):
    lines = [
        line for ax in figures["7"].axes for line in ax.get_lines() if len(line.get_xdata()) > 100
    ]
    assert len(lines) == 12
    ends = sorted(line.get_ydata()[-1] for line in lines)
    wanted = sorted(np.degrees(recordings[row].angle[-1]) for row in range(1, 13))
    assert ends == pytest.approx(wanted)


def test_measured_angles_are_marked_with_their_rows(figures, rows):
    for name, sizes in (("7", ("large", "medium")), ("8", ("small",))):
        texts = {text.get_text() for ax in figures[name].axes for text in ax.texts}
        assert texts == {str(row["row"]) for row in rows if row["size"] in sizes}


def test_time_axis_is_cut_only_after_everything_settled(result, recordings):
    for row in result["rows"]:
        row["settling_s"] = 0.8
    cut = reproduce_figures.small_responses(distinct(result), recordings)
    assert 2.0 < cut.axes[0].get_xlim()[1] < 3.0
    result["rows"][13]["settling_s"] = None
    whole = reproduce_figures.small_responses(distinct(result), recordings)
    assert whole.axes[0].get_xlim()[1] > 5.0


def test_model_differences_are_to_the_simulation(figures, result):
    data = result["figure9"]
    lower = [line.get_ydata() for line in figures["9"].axes[1].get_lines()]
    wanted = np.subtract(data["g1_paper"], data["simulated"])
    assert any(len(y) == len(wanted) and np.allclose(y, wanted) for y in lower)


def test_absent_curves_and_recordings_are_said(rows):
    figure = reproduce_figures.model_responses({"time_s": None, "simulated": None})
    assert any("no simulated response" in text.get_text() for text in figure.axes[0].texts)
    figure = reproduce_figures.pressure_courses(rows, {})
    assert all(ax.texts[0].get_text().startswith("no recording") for ax in figure.axes)
    figure = reproduce_figures.small_responses(rows, {})
    assert any(text.get_text().startswith("no recording") for text in figure.axes[0].texts)


def test_global_settings_stay_and_do_not_matter(result, recordings, rows, tmp_path):
    save_png(reproduce_figures.small_responses(rows, recordings), tmp_path / "a.png")
    with matplotlib.rc_context({"font.size": 30, "axes.facecolor": "red", "xtick.color": "red"}):
        before = dict(matplotlib.rcParams)
        save_png(reproduce_figures.small_responses(rows, recordings), tmp_path / "b.png")
        assert dict(matplotlib.rcParams) == before
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


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


def test_pyplot_is_never_imported():
    code = (
        "import sys, pamsim.report.reproduce_page; "
        "sys.exit('matplotlib.pyplot' in sys.modules or 'mujoco' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
