"""A muscle that is worked loses a share of its force without memory, and is fresh after a rest."""

from __future__ import annotations

import dataclasses
import math

import pytest

from pamsim.physics.passive import Softening, softening_rate
from pamsim.physics.record import pack
from tests.unit.physics.flat import SOFTENED, kernel, quieten
from tests.unit.physics.muscles import LASTING, PLAIN_VALVE, charged, make

SOFTENING = Softening(share=0.2, time=0.3)
TENDON = 0.19


def muscle(softening):
    return make(**{**LASTING, "softening": softening}, valve=PLAIN_VALVE, hysteresis=None)


def rates(row, act, step):
    out = [0.0] * len(act)
    kernel.state_rates(row, act, out, TENDON, 0.0, 0.0, 0.0, step)
    return out


@pytest.mark.parametrize("step", [1e-3, 0.05, 2.0])
def test_it_softens_exactly_whatever_the_step(step):
    row, act = pack(muscle(SOFTENING)).tolist(), charged(muscle(SOFTENING), 0.2, 3e5)
    for number in range(1, 5):
        act[-SOFTENED] += step * rates(row, act, step)[-SOFTENED]
        assert act[-SOFTENED] == pytest.approx(-math.expm1(-number * step / 0.3), rel=1e-12)


@pytest.mark.parametrize("share", [0.2, -0.2])
def test_a_softened_muscle_keeps_a_share_of_its_force_without_memory(share):
    soft = muscle(dataclasses.replace(SOFTENING, share=share))
    row, bare = (pack(one).tolist() for one in (soft, muscle(Softening())))
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


def test_without_a_share_nothing_softens():
    bare = muscle(Softening(time=0.1))
    act = charged(bare, 0.2, 3e5)
    assert rates(pack(bare).tolist(), act, 1e-3)[-SOFTENED] == 0.0


def test_a_long_step_ends_softened():
    assert softening_rate(SOFTENING, 0.0, 1e6) * 1e6 == 1.0
