"""A first stroke takes work that later ones do not, and gives none back."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

from pamsim.physics.passive import FirstStroke, first_stroke_force
from pamsim.physics.record import pack
from tests.unit.physics.flat import FURTHEST, kernel, quieten
from tests.unit.physics.muscles import LASTING, PLAIN_VALVE, charged, make

FIRST = FirstStroke(force=30.0, travel=0.01)
STEP = 1e-3


def strokes(path):
    """Force along a path of contractions, which begins after a rest at its first one."""
    furthest, forces = path[0] + FIRST.travel, []
    for kappa in path:
        forces.append(first_stroke_force(FIRST, kappa, furthest))
        furthest = max(furthest, kappa)
    return np.array(forces)


def there_and_back(*turns):
    return np.concatenate([np.linspace(a, b, 2001) for a, b in itertools.pairwise(turns)])


def test_the_first_stroke_takes_its_force_all_the_way_and_an_equal_one_at_its_end_alone():
    path = there_and_back(0.0, 0.08, 0.0, 0.08, 0.0)
    work = np.diff(path) * strokes(path)[1:]
    first, back, second, last = work.reshape(-1)[: 4 * 2000].reshape(4, 2000).sum(axis=1)
    assert first == pytest.approx(30.0 * (0.08 - 0.5 * 0.01), rel=1e-3)
    assert second == pytest.approx(0.5 * 30.0 * 0.01, rel=2e-2)
    assert back == pytest.approx(-second, rel=3e-2)
    assert last == pytest.approx(back, rel=3e-2)


def test_a_stroke_that_goes_further_is_a_first_one_from_there():
    path = there_and_back(0.0, 0.03, 0.0, 0.06)
    forces = strokes(path)
    later = slice(4002, None)
    assert forces[later][path[later] < 0.02].max() == 0.0
    assert forces[later][path[later] > 0.0301].min() == 30.0


def test_no_path_gets_work_out_of_it():
    path = np.cumsum(np.random.default_rng(2).normal(0.0, 1e-3, 4000))
    forces = strokes(path)
    work = np.cumsum(0.5 * (forces[1:] + forces[:-1]) * np.diff(path))
    held = 0.5 * FIRST.travel * forces**2 / FIRST.force
    assert (work - held[1:]).min() > -0.05 * held.max()
    assert work[-1] > 0.0


def test_the_muscle_remembers_its_furthest_contraction_and_a_rest_makes_it_forget():
    muscle = make(**{**LASTING, "first_stroke": FIRST}, valve=PLAIN_VALVE, hysteresis=None)
    row = pack(muscle).tolist()
    bare = pack(dataclasses.replace(muscle, first_stroke=FirstStroke())).tolist()
    act = charged(muscle, 0.2, 3e5)
    quieten(row, act, 0.2, 3e5)
    begin = act[-FURTHEST] - FIRST.travel
    nominal = muscle.braid.nominal_length
    for tendon in (0.2, 0.195, 0.19, 0.197):
        kappa = begin + (0.2 - tendon) / nominal
        before = act[-FURTHEST]
        lost = kernel.tension(bare, act, tendon) - kernel.tension(row, act, tendon)
        assert lost == pytest.approx(first_stroke_force(FIRST, kappa, before), abs=1e-9)
        out = [0.0] * len(act)
        kernel.state_rates(row, act, out, tendon, 0.0, 0.0, 0.0, STEP)
        act[-FURTHEST] += STEP * out[-FURTHEST]
        assert act[-FURTHEST] == pytest.approx(max(before, kappa), rel=1e-12)
    quieten(row, act, 0.2, 3e5)
    assert act[-FURTHEST] == pytest.approx(begin + FIRST.travel, rel=1e-12)


def test_nan_stays_nan():
    assert math.isnan(first_stroke_force(FIRST, math.nan, 0.1))
