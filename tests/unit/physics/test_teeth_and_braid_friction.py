"""A chain on the teeth of its sprocket loses no work; fibres that rub on each other lose some."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pamsim.physics.chain import Chain, chain_length, chain_ratio
from pamsim.physics.friction import Friction
from pamsim.physics.record import pack
from tests.unit.physics.flat import gauge_pressure, kernel, length_at_muscle
from tests.unit.physics.muscles import charged, make

TEETH = Chain(ripple=3e-4, ripple_pitch=8e-3, ripple_phase=0.4)
STEP = 5e-4


def toothed(**changes):
    return make("six_parameter", chain=TEETH, friction=Friction(), **changes)


def test_a_pitch_on_the_chain_is_a_pitch_behind_it_and_in_between_it_ripples():
    for travel in (-0.013, 0.0, 0.004):
        pitch = chain_length(TEETH, travel + TEETH.ripple_pitch) - chain_length(TEETH, travel)
        assert pitch == pytest.approx(TEETH.ripple_pitch, rel=1e-12)
        near = chain_length(TEETH, travel + 1e-8) - chain_length(TEETH, travel - 1e-8)
        assert chain_ratio(TEETH, travel) == pytest.approx(near / 2e-8, rel=1e-7)
    grid = np.linspace(0.0, TEETH.ripple_pitch, 2001)
    off = [chain_length(TEETH, x) - x for x in grid.tolist()]
    assert (min(off), max(off)) == pytest.approx((-TEETH.ripple, TEETH.ripple), rel=1e-5)


def test_work_on_the_tendon_is_the_work_on_the_muscle():
    row = pack(toothed()).tolist()
    act = charged(toothed(), 0.19, 3e5)
    tendons = np.linspace(0.186, 0.196, 4001)
    inside = [kernel.tension(row, act, x) for x in tendons.tolist()]
    outside = [
        kernel.tendon_force(row, act, pull, x, 0.0, STEP)
        for x, pull in zip(tendons.tolist(), inside, strict=True)
    ]
    lengths = [length_at_muscle(row, act, x) for x in tendons.tolist()]
    assert min(inside) > 10.0
    assert np.trapezoid(outside, tendons) == pytest.approx(np.trapezoid(inside, lengths), rel=1e-6)
    assert max(np.abs(np.array(outside) / inside - 1.0)) == pytest.approx(
        TEETH.ripple * 2.0 * math.pi / TEETH.ripple_pitch, rel=1e-3
    )


def test_the_muscle_moves_at_the_speed_behind_the_teeth():
    """Seen in the operator, whose memory follows the contraction."""
    muscle = toothed(loop="bouc_wen")
    row, act = pack(muscle).tolist(), charged(muscle, 0.19, 3e5, z=0.0)
    rates = [0.0] * len(act)
    kernel.state_rates(row, act, rates, 0.19, 0.03, 0.0, 0.0, STEP)
    ratio = chain_ratio(TEETH, 0.19)
    assert abs(ratio - 1.0) > 0.02
    smooth = pack(dataclasses.replace(muscle, chain=Chain())).tolist()
    plain = [0.0] * len(act)
    kernel.state_rates(smooth, act, plain, 0.19, 0.03, 0.0, 0.0, STEP)
    assert rates[0] == pytest.approx(ratio * plain[0], rel=1e-9)


def test_a_rubbing_braid_pulls_less_while_it_shortens_and_the_more_the_higher_the_pressure():
    base = toothed()
    muscle = dataclasses.replace(base, braid=dataclasses.replace(base.braid, friction=1e-3))
    row, act = pack(muscle).tolist(), charged(muscle, 0.19, 3e5)
    still = kernel.tension(row, act, 0.19)
    pressure = gauge_pressure(row, act, 0.19)
    for speed in (-0.02, 0.03):
        rate = -chain_ratio(TEETH, 0.19) * speed / muscle.braid.nominal_length
        moving = kernel.tension(row, act, 0.19, speed)
        assert moving == pytest.approx(still - 1e-3 * pressure * rate, rel=1e-12)
        assert (moving > still) == (speed > 0.0)
    slack = charged(muscle, 0.12, 0.0)
    assert kernel.tension(row, slack, 0.12, -1.0) == 0.0
