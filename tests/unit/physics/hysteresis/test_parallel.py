"""The hysteresis in parallel is Maxwell slip, adds to the muscle's own, and is free at rest."""

import numpy as np
import pytest

from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.maxwell_slip import BLOCKS, MaxwellSlip, ParallelHysteresis
from pamsim.physics.record import pack, state_size
from tests.unit.physics.flat import hysteresis_force, hysteresis_rates, hysteresis_volume, rest
from tests.unit.physics.muscles import make

PRESSURE, STATIC, STEP = 3e5, 400.0, 1e-3
WIDTHS = {"force": 9.0, "force_per_pressure": 2e-4, "chord": 12.0}
SHAPE = {"full_slip": 0.03, "decay": 0.6}
PARALLEL = ParallelHysteresis(**WIDTHS, **SHAPE)
BENT = {"asymmetry": 0.6, "dead_zone": 0.3}
PATH = np.cumsum(np.random.default_rng(3).normal(0.0, 3e-3, 200)).tolist()
"""Contractions that wander, with turning points of every size."""


def along(path, **groups):
    """Force [N] and volume [m^3] of a muscle's hysteresis along a path."""
    muscle = make(**groups)
    row, count = pack(muscle).tolist(), state_size(muscle)
    act, rates = [0.0] * count, [0.0] * count
    found, before = [], 0.0
    for kappa in path:
        hysteresis_rates(row, act, rates, before, (kappa - before) / STEP, STEP)
        act = [state + STEP * rate for state, rate in zip(act, rates, strict=True)]
        force = hysteresis_force(row, act, kappa, PRESSURE, STATIC)
        found.append((force, hysteresis_volume(row, act, kappa)))
        before = kappa
    return np.array(found)


def held(volume, width):
    """Energy that an hysteresis of a width [N] holds, by the volume that it takes."""
    return -volume / (1e-4 * make().braid.nominal_length) * width


def test_it_is_the_maxwell_slip_operator_and_adds_to_the_muscle_s_own():
    alone = along(PATH, parallel_hysteresis=PARALLEL)
    assert np.ptp(alone[:, 0]) > 50.0
    same = MaxwellSlip(**WIDTHS, **SHAPE, elements=BLOCKS)
    assert np.array_equal(alone, along(PATH, hysteresis=same))
    own = BoucWen(yield_contraction=0.01, force_per_pressure=1e-4, force_share=0.02)
    both = along(PATH, hysteresis=own, parallel_hysteresis=PARALLEL)
    np.testing.assert_allclose(both, along(PATH, hysteresis=own) + alone, rtol=1e-12, atol=1e-18)
    nearly = ParallelHysteresis(**WIDTHS, **SHAPE, asymmetry=1e-15)  # by the formula of bent ones
    found = along(PATH, parallel_hysteresis=nearly)
    np.testing.assert_allclose(found, alone, rtol=1e-12, atol=1e-12)


def test_a_muscle_at_rest_is_free_of_it():
    muscle = make(parallel_hysteresis=ParallelHysteresis(force=50.0))
    row, act = pack(muscle).tolist(), [0.0] * state_size(muscle)
    for tendon in (0.14, 0.2):
        rest(row, act, tendon, PRESSURE)
        kappa = act[0]
        assert hysteresis_force(row, act, kappa, PRESSURE, STATIC) == 0.0
        assert hysteresis_force(row, act, kappa + 0.1, PRESSURE, STATIC) == pytest.approx(50.0)


def test_it_is_wider_to_one_side_and_pulls_nothing_within_its_dead_zone():
    """From rest: 1 + a once all slips forward, 1 - a back, 0 up to r times the first slip."""
    bent = ParallelHysteresis(force=50.0, full_slip=0.02, **BENT)

    def force(*path):
        return along(path, parallel_hysteresis=bent)[-1, 0]

    one = 0.02 / BLOCKS  # the first element at its limit, in springs of a slope 1 / (1 - r)
    assert force(0.1) == pytest.approx(50.0 * 1.6)
    assert force(-0.1) == pytest.approx(-50.0 * 0.4)
    assert force(0.2999 * one) == 0.0 < force(0.31 * one)
    others = sum(max(1.0 / k - 0.3, 0.0) / 0.7 for k in range(1, BLOCKS + 1))
    assert force(one) == pytest.approx(50.0 * 1.6 * others / BLOCKS)
    assert 0.0 < force(0.1, 0.1 - 0.3 * one) < force(0.1)  # all springs are still stretched


@pytest.mark.parametrize("shape", [BENT, {"asymmetry": -0.9}, {"dead_zone": 0.7}])
def test_asymmetric_hysteresis_gives_no_work_and_its_energy_is_what_it_holds(shape):
    """Along any path the work is at least the gain of the energy, which the volume shows."""
    bent = ParallelHysteresis(force=50.0, force_per_pressure=1e-4, **SHAPE, **shape)
    each, turns = 40, PATH[:90]
    fine = np.interp(np.arange(each * len(turns)) / each, np.arange(len(turns)), turns)
    force, volume = along(fine.tolist(), parallel_hysteresis=bent).T
    energy = held(volume, 50.0 + 1e-4 * PRESSURE)
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(fine))
    lost = work - (energy[1:] - energy[0])
    assert energy.min() >= 0.0
    # But for the corners of the force, which the trapezoidal rule cuts off.
    assert np.diff(lost[::each]).min() > -1e-3 * np.abs(np.diff(work[::each])).max()
    assert lost[-1] > 2.0 * energy.max()
