"""What a muscle remembers in time: creep lets go, a first stroke costs work, work softens."""

import dataclasses
import itertools
import math

import numpy as np
import pytest

from pamsim.physics.passive import (
    Creep,
    FirstStroke,
    Softening,
    first_stroke_force,
    softening_rate,
)
from pamsim.physics.record import pack
from tests.unit.physics.flat import CREEP, CREEP_2, FURTHEST, SOFTENED, contraction, kernel, quieten
from tests.unit.physics.muscles import LASTING, PLAIN_VALVE, RELAXED, RELAXED_2, charged, make

TENDON = 0.19


def muscle(**group):
    return make(**(LASTING | group), valve=PLAIN_VALVE, hysteresis=None)


def step(row, act, tendon, timestep, *states):
    """Take the states at some places of ``act``, counted from its end, on by a time step."""
    out = [0.0] * len(act)
    kernel.state_rates(row, act, out, tendon, 0.0, 0.0, 0.0, timestep)
    for place in states:
        act[-place] += timestep * out[-place]


def test_two_elements_let_go_each_in_its_own_time():
    """The kernel holds k exp(-t / tau) of both, to the bit nothing of one without stiffness."""
    two = Creep(stiffness=700.0, relaxation_time=0.3, stiffness_2=900.0, relaxation_time_2=2.0)
    row, plain = (pack(muscle(creep=one)).tolist() for one in (two, Creep()))
    act, timestep, kappa = charged(muscle(creep=two), 0.2, 3e5), 0.05, contraction(row, 0.2)
    for k in range(60):
        held = kernel.tension(plain, act, 0.2) - kernel.tension(row, act, 0.2)
        first = two.stiffness * (kappa - RELAXED) * math.exp(-k * timestep / 0.3)
        second = two.stiffness_2 * (kappa - RELAXED_2) * math.exp(-k * timestep / 2.0)
        assert held == pytest.approx(first + second, rel=1e-9)
        step(row, act, 0.2, timestep, CREEP, CREEP_2)


# --- the first stroke ----------------------------------------------------------------------------

FIRST = FirstStroke(force=30.0, travel=0.01)


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
    first, back, second, last = work[: 4 * 2000].reshape(4, 2000).sum(axis=1)
    assert first == pytest.approx(30.0 * (0.08 - 0.5 * 0.01), rel=1e-3)
    assert second == pytest.approx(0.5 * 30.0 * 0.01, rel=2e-2)
    assert back == pytest.approx(-second, rel=3e-2)
    assert last == pytest.approx(back, rel=3e-2)
    path = there_and_back(0.0, 0.03, 0.0, 0.06)  # one that goes further is a first from there
    forces, later = strokes(path)[4002:], path[4002:]
    assert forces[later < 0.02].max() == 0.0
    assert forces[later > 0.0301].min() == 30.0
    assert math.isnan(first_stroke_force(FIRST, math.nan, 0.1))


def test_no_path_gets_work_out_of_a_first_stroke():
    path = np.cumsum(np.random.default_rng(2).normal(0.0, 1e-3, 4000))
    forces = strokes(path)
    work = np.cumsum(0.5 * (forces[1:] + forces[:-1]) * np.diff(path))
    held = 0.5 * FIRST.travel * forces**2 / FIRST.force
    assert (work - held[1:]).min() > -0.05 * held.max()
    assert work[-1] > 0.0


def test_the_muscle_remembers_its_furthest_contraction_and_a_rest_makes_it_forget():
    this = muscle(first_stroke=FIRST)
    row, bare = (pack(one).tolist() for one in (this, muscle(first_stroke=FirstStroke())))
    act = charged(this, 0.2, 3e5)
    quieten(row, act, 0.2, 3e5)
    begin = act[-FURTHEST] - FIRST.travel
    for tendon in (0.2, 0.195, 0.19, 0.197):
        kappa, before = begin + (0.2 - tendon) / this.braid.nominal_length, act[-FURTHEST]
        lost = kernel.tension(bare, act, tendon) - kernel.tension(row, act, tendon)
        assert lost == pytest.approx(first_stroke_force(FIRST, kappa, before), abs=1e-9)
        step(row, act, tendon, 1e-3, FURTHEST)
        assert act[-FURTHEST] == pytest.approx(max(before, kappa), rel=1e-12)
    quieten(row, act, 0.2, 3e5)
    assert act[-FURTHEST] == pytest.approx(begin + FIRST.travel, rel=1e-12)


# --- softening -----------------------------------------------------------------------------------

SOFTENING = Softening(share=0.2, time=0.3)


def test_it_softens_exactly_whatever_the_step_and_not_at_all_without_a_share():
    for softening, timestep in itertools.product((SOFTENING, Softening(time=0.3)), (1e-3, 2.0)):
        row, act = pack(muscle(softening=softening)).tolist(), charged(muscle(), 0.2, 3e5)
        for number in range(1, 5):
            step(row, act, TENDON, timestep, SOFTENED)
            expected = -math.expm1(-number * timestep / 0.3) if softening.share else 0.0
            assert act[-SOFTENED] == pytest.approx(expected, rel=1e-12)
    assert softening_rate(SOFTENING, 0.0, 1e6) * 1e6 == 1.0


@pytest.mark.parametrize("share", [0.2, -0.2])
def test_a_softened_muscle_keeps_a_share_of_its_force_without_memory(share):
    soft = muscle(softening=dataclasses.replace(SOFTENING, share=share))
    row, bare = (pack(one).tolist() for one in (soft, muscle()))
    act = charged(soft, TENDON, 3e5)
    quieten(row, act, TENDON, 3e5)  # creep is relaxed, so that no other force is left
    fresh = kernel.tension(bare, act, TENDON)
    assert kernel.tension(row, act, TENDON) == fresh > 0.0
    for softened in (0.5, 1.0):
        act[-SOFTENED] = softened
        assert kernel.tension(row, act, TENDON) == pytest.approx(fresh * (1.0 - share * softened))
        assert kernel.tension(bare, act, TENDON) == fresh
    quieten(row, act, TENDON, 3e5)
    assert act[-SOFTENED] == 0.0
