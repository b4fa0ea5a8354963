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
