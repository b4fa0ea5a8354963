"""The figures of the replication page: from computed curves to panels with something in them."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.papers.replicate import Replication
from pamsim.papers.replication_figures import replication_figures
from pamsim.report.replication_page import FIGURES, write_replication

EMPTY = Replication(papers={}, claims=(), notes=(), failures=(), wall_s=0.0).to_dict()
NAMES = [(paper, name) for paper, drawings in FIGURES.items() for name in drawings]


@pytest.fixture(scope="module")
def curves():
    return replication_figures(FIGURES)


@pytest.mark.parametrize(("paper", "name"), NAMES)
def test_every_panel_holds_finite_data_and_labelled_axes(curves, paper, name):
    figure = FIGURES[paper][name](curves[paper])
    assert figure.axes
    for ax in figure.axes:
        lines = [line for line in ax.lines if len(line.get_xdata()) > 2]
        assert lines or ax.collections
        for line in lines:
            assert np.isfinite(np.asarray(line.get_ydata(), dtype=float)).sum() > 2
    assert figure.axes[-1].get_xlabel()
    assert figure.axes[0].get_ylabel()


def test_page_has_the_figures_of_the_papers_asked_for_and_their_captions(curves, tmp_path):
    chosen = {paper: curves[paper] for paper in ("nguyen2024", "sarosi")}
    paths = write_replication(EMPTY, chosen, tmp_path)
    assert [path.name for path in paths] == [
        "index.html",
        "nguyen2024_order.png",
        "nguyen2024_tests.png",
        "nguyen2024_bench.png",
        "sarosi_laws.png",
        "sarosi_inverse.png",
        "sarosi_bench.png",
    ]
    assert all(path.stat().st_size > 1000 for path in paths)
    source = paths[0].read_text(encoding="utf-8")
    assert source.count("<figure") == 6
    assert source.count("Assumed") == 5  # the inverse shares the constants of the laws above it
    assert "matiskova2021_static" not in source


def test_major_loop_saturates_and_encloses_its_line(curves):
    major = curves["vandamme2008"]["major"]
    # 0.03: the outermost levels lie half a cell inside of saturation.
    assert major["rising"][0] == pytest.approx(-1.0, abs=0.03)
    assert major["falling"][-1] == pytest.approx(1.0, abs=0.03)
    middle = slice(20, 60)
    assert np.all(major["rising"][middle] < major["line"][middle])
    assert np.all(major["falling"][middle] > major["line"][middle])
    assert major["falling"] == pytest.approx(-major["rising"][::-1], abs=1e-12)


def test_inner_loop_is_closed(curves):
    for loop in curves["vandamme2008"]["loops"].values():
        assert loop["inner_percent"][[0, -1]] == pytest.approx([7.0, 7.0])
        assert loop["inner_value"][0] == pytest.approx(loop["inner_value"][-1], rel=1e-9)


def test_loops_reach_their_force_and_the_printed_points(curves):
    x, force = curves["nguyen2024"]["by_amplitude"]["148 N"]
    assert force.max() == pytest.approx(148.0, rel=1e-3)
    assert x.max() == pytest.approx(74.0, abs=1.5)  # mm, with Ke in N/m


def test_inverse_gives_the_pressure_back(curves):
    assert curves["sarosi"]["round_trip_bar"] < 1e-9
    assert curves["sarosi"]["fit"]["rms_n"] < 40.0
