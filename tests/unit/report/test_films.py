"""Frames of films: arms above, plots below, a cursor that goes with time."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.text import Text
from PIL import Image, ImageSequence

import pamsim
from pamsim.comparison.compared_signal import Comparison
from pamsim.recordings.trial import Trial
from pamsim.report import film as room
from pamsim.report.film import arm_size, film_gap, film_sheet
from pamsim.report.step_figure import step_figure
from tests.unit.core.refusals import refused
from tests.unit.report.figure_laws import check_figure

SIZE = 480, 384
TIME = np.linspace(0.0, 2.0, 101)
LABELS = {"muscle_1": (120.0, 60.0), "muscle_2": (110.0, 80.0)}
RAMPS = {"angle": TIME / 4.0, "pressure_1": 1e5 * TIME, "pressure_2": 3e5 - 1e5 * TIME}


def sheet(measured, labels=LABELS):
    trial = Trial(
        name="ramp", protocol="ramp", drive="pressure_set", load=1.2, time=TIME,
        command=np.full((TIME.size, 2), 2e5), measured=measured,
    )  # fmt: skip
    return film_sheet(trial, labels=labels, title="ramp", size=SIZE)


@pytest.fixture(scope="module")
def drawn():
    return sheet(RAMPS)


def pixel(drawn, ax, x, y):
    """Row and column of a place of a plot in a frame."""
    across, up = ax.transData.transform((x, y))
    return round(SIZE[1] - up), int(across)


def near(frame, colour, row, column, reach=2):
    """Number of pixels of a colour around a place."""
    part = frame[row - reach : row + reach + 1, column - reach : column + reach + 1].astype(int)
    return int((np.abs(part - 255.0 * np.array(to_rgb(colour))).max(axis=2) < 4.0).sum())


def test_a_frame_is_the_arm_above_the_plots_with_cursor_and_dots_at_the_time(drawn):
    width, height = arm_size(*SIZE)
    arm = np.full((height, width, 3), 200, dtype=np.uint8)
    frame = drawn.frame(arm, 1.0)
    assert frame.shape == (*SIZE[::-1], 3)
    assert (frame[height // 2 : height, width // 2 :] == 200).all()  # nothing is written there
    joint, pressure = drawn.curves
    for time, shown in ((0.5, 0.5), (1.0, 1.0), (1.9, 1.9), (-1.0, 0.0), (4.5, 2.0)):
        now = drawn.frame(arm, time)
        # A place near the upper edge is crossed by nothing but the cursor.
        row, column = pixel(drawn, joint, shown, joint.get_ylim()[1])
        dark = np.flatnonzero(now[row + 4, : width // 2].max(axis=1) < 90)
        assert np.abs(dark - column).min() <= 1, time
        for line, kpa in zip(drawn.curves[pressure], (1e2 * shown, 3e2 - 1e2 * shown), strict=True):
            assert near(now, line.get_color(), *pixel(drawn, pressure, shown, kpa)) > 9, time
    # Equal times give equal frames: the sheet is left as it was.
    assert (drawn.frame(arm, 1.5) != frame).any()
    np.testing.assert_array_equal(drawn.frame(arm, 1.0), frame)


def test_muscles_are_labelled_in_the_colours_of_their_curves(drawn):
    width, height = arm_size(*SIZE)
    frame = drawn.frame(np.full((height, width, 3), 255, dtype=np.uint8), 1.0)
    for line, (column, row) in zip(list(drawn.curves.values())[1], LABELS.values(), strict=True):
        assert near(frame, line.get_color(), round(row), round(column), reach=40) > 20


def test_labels_of_muscles_side_by_side_do_not_overlap():
    labels = {f"knee_{name}": (120.0 + i, 60.0) for i, name in enumerate(("a", "b", "c", "d"))}
    figure = next(iter(sheet(RAMPS, labels).curves)).get_figure(root=True)
    texts = [text for text in figure.findobj(Text) if "knee" in text.get_text()]
    boxes = [text.get_window_extent() for text in texts]
    assert len(boxes) == len(labels)
    check_figure(figure)
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def test_a_pressure_that_was_not_measured_has_no_curve_and_a_small_frame_is_refused():
    measured = {name: values for name, values in RAMPS.items() if name != "pressure_1"}
    ((line,),) = list(sheet(measured).curves.values())[1:]
    assert line.get_ydata()[-1] < line.get_ydata()[0]  # the second's, which falls
    with refused("100 x 384 pixels are too small"):
        arm_size(100, 384)


def test_the_legend_of_a_step_lies_above_the_pressures_and_covers_none(recordings):
    figure = step_figure(recordings[1])
    figure.canvas.draw()
    pressures = figure.axes[1]
    legend = pressures.get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["muscle 1", "muscle 2"]
    assert legend.get_window_extent().y0 > pressures.get_window_extent().y1 - 1.0
    own = step_figure(replace(recordings[1], muscles=("flexor", "extensor"))).axes[1].get_legend()
    assert [text.get_text() for text in own.get_texts()] == ["flexor", "extensor"]


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm", scene=True)


@pytest.fixture(scope="module")
def part():
    """An arm that stays, simulated as turning by 0.4 rad."""
    time = TIME[:26] / TIME[25] / 2.0
    still = np.zeros_like(time)
    return Comparison(
        trial="one", protocol="one", channel="angle", held_out=True, time=time,
        measured=still, before=0.8 * time, after=still,
    )  # fmt: skip


def frames(path):
    with Image.open(path) as film:
        every = [
            np.asarray(one.convert("RGB"), dtype=float) for one in ImageSequence.Iterator(film)
        ]
    return np.array(every)


def test_every_state_has_its_arm_and_only_that_which_moves_changes(rig, part, tmp_path):
    film_gap(tmp_path / "gap.gif", rig, [part])
    film = frames(tmp_path / "gap.gif")
    assert len(film) == 6  # half a second
    measured, before, after = np.split(film[:, 30:190], 3, axis=2)
    changed = [np.abs(arm[-1] - arm[0]).mean() for arm in (measured, before, after)]
    assert changed[1] > 3.0 * max(changed[0], changed[2])
    assert np.abs(measured - after).mean() < 0.5 * np.abs(measured - before)[-1].mean()


def test_without_a_repair_there_are_two_arms_and_a_long_trial_runs_faster(
    rig, part, tmp_path, monkeypatch
):
    monkeypatch.setattr(room, "_LONGEST", 0.25)
    film_gap(tmp_path / "gap.gif", rig, [dataclasses.replace(part, after=None)])
    film = frames(tmp_path / "gap.gif")
    assert film.shape[2] == 2 * 320
    assert len(film) == 3


def test_a_joint_that_was_not_compared_cannot_be_shown(rig, part, tmp_path):
    with refused("angle was not compared"):
        film_gap(tmp_path / "gap.gif", rig, [dataclasses.replace(part, channel="force_1")])
    assert not list(tmp_path.iterdir())
