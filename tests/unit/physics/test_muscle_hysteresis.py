"""The hysteresis in parallel is Maxwell slip, adds to the muscle's own, and is free at rest."""

from __future__ import annotations

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
SAME = MaxwellSlip(**WIDTHS, **SHAPE, elements=BLOCKS)
OWN = BoucWen(yield_contraction=0.01, force_per_pressure=1e-4, force_share=0.02)


@pytest.fixture(scope="module")
def path():
    """Contractions that wander, with turning points of every size."""
    return np.cumsum(np.random.default_rng(3).normal(0.0, 3e-3, 400)).tolist()


def along(path, **groups):
    """Force [N] and volume [m^3] of a muscle's hysteresis along a path."""
    muscle = make(**groups)
    row, count = pack(muscle).tolist(), state_size(muscle)
    act, rates = [0.0] * count, [0.0] * count
    found, before = [], 0.0
    for kappa in path:
        hysteresis_rates(row, act, rates, before, (kappa - before) / STEP, STEP)
        act = [state + STEP * rate for state, rate in zip(act, rates, strict=True)]
        found.append(
            (
                hysteresis_force(row, act, kappa, PRESSURE, STATIC),
                hysteresis_volume(row, act, kappa),
            )
        )
        before = kappa
    return np.array(found)


def test_it_is_the_maxwell_slip_operator(path):
    alone = along(path, parallel_hysteresis=PARALLEL)
    assert np.ptp(alone[:, 0]) > 50.0
    assert np.array_equal(alone, along(path, hysteresis=SAME))


def test_it_adds_to_the_own_operator(path):
    both = along(path, hysteresis=OWN, parallel_hysteresis=PARALLEL)
    parts = along(path, hysteresis=OWN) + along(path, parallel_hysteresis=PARALLEL)
    np.testing.assert_allclose(both, parts, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("tendon", [0.14, 0.17, 0.2])
def test_a_muscle_at_rest_is_free_of_it(tendon):
    muscle = make(parallel_hysteresis=ParallelHysteresis(force=50.0))
    row, act = pack(muscle).tolist(), [0.0] * state_size(muscle)
    rest(row, act, tendon, PRESSURE)
    kappa = act[-state_size(muscle)]
    assert hysteresis_force(row, act, kappa, PRESSURE, STATIC) == 0.0
    assert hysteresis_force(row, act, kappa + 0.1, PRESSURE, STATIC) == pytest.approx(50.0)


BENT = {"asymmetry": 0.6, "dead_zone": 0.3}


def test_without_asymmetry_and_dead_zone_it_is_the_plain_one_to_rounding(path):
    plain = along(path, parallel_hysteresis=PARALLEL)
    nearly = ParallelHysteresis(**WIDTHS, **SHAPE, asymmetry=1e-15)
    np.testing.assert_allclose(
        along(path, parallel_hysteresis=nearly), plain, rtol=1e-12, atol=1e-12
    )


def test_it_is_wider_to_one_side_and_pulls_nothing_within_its_dead_zone():
    """From rest: 1 + a once all slips forward, 1 - a back, 0 up to r times the first slip."""
    bent = ParallelHysteresis(force=50.0, full_slip=0.02, **BENT)

    def force(*path):
        return along(path, parallel_hysteresis=bent)[-1, 0]

    assert force(0.1) == pytest.approx(50.0 * 1.6)
    assert force(-0.1) == pytest.approx(-50.0 * 0.4)
    assert force(0.2999 * 0.02 / BLOCKS) == 0.0
    assert force(0.31 * 0.02 / BLOCKS) > 0.0
    one = 0.02 / BLOCKS  # the first element at its limit, in springs of a slope 1 / (1 - r)
    others = sum(max(1.0 / k - 0.3, 0.0) / 0.7 for k in range(1, BLOCKS + 1))
    assert force(one) == pytest.approx(50.0 * 1.6 * others / BLOCKS)
    back = force(0.1, 0.1 - 0.3 * one)  # all springs are still stretched
    assert 0.0 < back < force(0.1)


@pytest.mark.parametrize("shape", [BENT, {"asymmetry": -0.9}, {"dead_zone": 0.7}])
def test_asymmetric_hysteresis_gives_no_work_and_its_energy_is_what_it_holds(path, shape):
    """Along any path the work is at least the gain of the energy, which the volume shows."""
    bent = ParallelHysteresis(force=50.0, force_per_pressure=1e-4, **SHAPE, **shape)
    each, turns = 60, path[:120]
    fine = np.interp(np.arange(each * len(turns)) / each, np.arange(len(turns)), turns)
    force, volume = along(fine.tolist(), parallel_hysteresis=bent).T
    width, nominal = 50.0 + 1e-4 * PRESSURE, make().braid.nominal_length
    held = -volume / (1e-4 * nominal) * width
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(fine))
    lost = work - (held[1:] - held[0])
    assert held.min() >= 0.0
    # But for the corners of the force, which the trapezoidal rule cuts off.
    assert np.diff(lost[::each]).min() > -1e-3 * np.abs(np.diff(work[::each])).max()
    assert lost[-1] > 2.0 * held.max()


def test_at_rest_the_energy_is_the_integral_of_the_force():
    bent = ParallelHysteresis(force=40.0, force_per_pressure=1e-4, full_slip=0.05, **BENT)
    up = np.linspace(0.0, 0.05 / BLOCKS, 4001)  # no block slips
    force, volume = along(up.tolist(), parallel_hysteresis=bent).T
    work = np.trapezoid(force, up)
    held = -volume[-1] / (1e-4 * make().braid.nominal_length) * (40.0 + 1e-4 * PRESSURE)
    assert work == pytest.approx(held, rel=1e-5)
