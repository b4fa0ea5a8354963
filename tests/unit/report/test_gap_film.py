"""The film of the gap: an arm for each state, and a cursor that runs along the curves."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from PIL import Image, ImageSequence

import pamsim
from pamsim.comparison.compared_signal import Comparison
from pamsim.core.errors import InputError
from pamsim.report import gap_film
from pamsim.report.gap_film import film_gap

TIME = np.linspace(0.0, 0.5, 26)


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm", scene=True)


@pytest.fixture(scope="module")
def part():
    """An arm that stays, simulated as turning by 0.4 rad."""
    return Comparison(
        trial="one", protocol="one", channel="angle", held_out=True, time=TIME,
        measured=np.zeros_like(TIME), before=0.8 * TIME, after=np.zeros_like(TIME),
    )  # fmt: skip


def frames(path):
    with Image.open(path) as film:
        return np.array([np.asarray(f.convert("RGB"), dtype=float) for f in
                         ImageSequence.Iterator(film)])  # fmt: skip


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
    monkeypatch.setattr(gap_film, "_LONGEST", 0.25)
    film_gap(tmp_path / "gap.gif", rig, [dataclasses.replace(part, after=None)])
    film = frames(tmp_path / "gap.gif")
    assert film.shape[2] == 2 * 320
    assert len(film) == 3


def test_a_joint_that_was_not_compared_cannot_be_shown(rig, part, tmp_path):
    forces = dataclasses.replace(part, channel="force_1")
    with pytest.raises(InputError, match="angle was not compared"):
        film_gap(tmp_path / "gap.gif", rig, [forces])
    assert not list(tmp_path.iterdir())
