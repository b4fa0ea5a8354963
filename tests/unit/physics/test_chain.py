"""The chain beside a muscle: compliance, play between two muscles, and the sprocket's teeth."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from pamsim.physics.chain import Chain, chain_length, chain_ratio, extension_rate, shift_rate
from pamsim.physics.friction import Friction
from pamsim.physics.record import pack
from pamsim.physics.step_limits import chain_step_limit
from tests.unit.physics.flat import gauge_pressure, kernel
from tests.unit.physics.muscles import LASTING, charged, make

COMPLIANCE, RELAXATION = 3e-6, 0.02
SOFT = Chain(compliance=COMPLIANCE, relaxation_time=RELAXATION)
PLAY, DAMPING = 6e-4, 1e3
TEETH = Chain(ripple=3e-4, ripple_pitch=8e-3, ripple_phase=0.4)
TENDON, PRESSURE = 0.19, 3e5


def on_chain(chain):
    return make("six_parameter", **(LASTING | {"chain": chain}))


def step(row, act, tendon, timestep, opposing=0.0):
    out = [0.0] * len(act)
    kernel.state_rates(row, act, out, tendon, 0.0, 0.0, 0.0, timestep, opposing)
    for i, rate in enumerate(out):
        act[i] += timestep * rate


def test_under_a_held_tension_the_extension_closes_in_on_what_the_chain_gives_per_tension():
    """x - C T decays with exp(-t / tau); a hardening chain gives C / (1 + h T) per tension."""
    hard = dataclasses.replace(SOFT, hardening=2e-3)

    def resting(at):
        return float(brentq(lambda x: extension_rate(hard, x, at), -1.0, 1.0, xtol=1e-15))

    for tension in (0.0, 40.0, 900.0):
        for start in (-1e-3, 0.0, 4e-3):
            apart = start - COMPLIANCE * tension
            rate = extension_rate(SOFT, start, tension)
            assert rate == pytest.approx(-apart / RELAXATION, rel=1e-12)
        near = 1e-3 * (tension + 1.0)
        slope = (resting(tension + near) - resting(tension - near)) / (2.0 * near)
        assert slope == pytest.approx(COMPLIANCE / (1.0 + 2e-3 * tension), rel=1e-5)


# --- play on the sprocket between two muscles ----------------------------------------------------


def test_the_chain_slides_towards_the_stronger_pull_up_to_a_tooth():
    chain = Chain(backlash=PLAY, seating_damping=DAMPING)
    assert shift_rate(chain, 0.0, 130.0, 30.0, 1e-4) == pytest.approx(-0.1)
    for start, pull, tooth in ((2e-4, 0.0, 3e-4), (-2.9e-4, 5e3, -3e-4), (3e-4, -9e9, 3e-4)):
        at = start + 1e-2 * shift_rate(chain, start, pull, 40.0, 1e-2)
        assert at == pytest.approx(tooth, rel=1e-12)
    assert math.isnan(shift_rate(chain, 0.0, math.nan, 50.0, 1e-3))


def test_elastic_teeth_give_beyond_the_play_per_pull_and_as_they_relax_in_time():
    """At rest s = g/2 + c (T' - T), which a step of any length closes in on without overshoot."""
    teeth = Chain(backlash=PLAY, seating_damping=DAMPING, tooth_compliance=2e-6)
    resting = 3e-4 + 2e-6 * 120.0
    for timestep in (1e-5, 1e-3, 1e9):
        for side in (1.0, -1.0):
            pulls = (30.0, 150.0)[:: int(side)]
            at_rest = shift_rate(teeth, side * resting, *pulls, timestep)
            assert at_rest == pytest.approx(0.0, abs=1e-9)
            moved = side * timestep * shift_rate(teeth, side * 3e-4, *pulls, timestep)
            assert 0.0 < moved <= 2e-6 * 120.0
    apart = shift_rate(teeth, resting + 1e-7, 30.0, 150.0, 1e-9)
    assert apart == pytest.approx(-1e-7 / (DAMPING * 2e-6), rel=1e-4)


# --- the longest step ----------------------------------------------------------------------------


@pytest.mark.parametrize("pressure", [1e5, 5e5])
def test_a_chain_settles_just_inside_its_step_limit_and_swings_up_beyond(pressure):
    muscle = on_chain(Chain(compliance=1.5e-5, relaxation_time=5e-3))
    row, tendon = pack(muscle).tolist(), 0.185
    resting = charged(muscle, tendon, pressure)
    for _ in range(400):  # to rest, in steps well inside
        step(row, resting, tendon, 1e-3)

    def swing(share):
        """Growth of a small deviation of the extension over 60 steps on shut valves."""
        act, at = list(resting), resting[-2]
        own = gauge_pressure(row, act, tendon)
        longest = share * chain_step_limit(muscle, tendon - at, own)
        act[-2] += 1e-9
        for _ in range(60):
            step(row, act, tendon, longest)
        return abs(act[-2] - at) / 1e-9

    assert swing(0.97) < 0.2
    assert swing(1.03) > 5.0
    assert chain_step_limit(on_chain(Chain()), tendon, pressure) > 1e9


def test_play_between_two_muscles_settles_inside_its_step_limit_and_swings_up_beyond():
    muscle = on_chain(Chain(backlash=PLAY, seating_damping=200.0))
    row = pack(muscle).tolist()

    def growth(share):
        longest = share * chain_step_limit(muscle, TENDON, PRESSURE)
        ends = [charged(muscle, TENDON, PRESSURE, 0.0) for _ in range(2)]
        ends[0][-3], ends[1][-3] = 1e-9, -1e-9
        for _ in range(60):
            pulls = [kernel.tension(row, act, TENDON) for act in ends]
            for act, other in zip(ends, pulls[::-1], strict=True):
                step(row, act, TENDON, longest, other)
        return abs(ends[0][-3]) / 1e-9

    assert growth(0.95) < 0.3
    assert growth(1.05) > 3.0


# --- teeth of the sprocket -----------------------------------------------------------------------


def test_a_pitch_on_the_chain_is_a_pitch_behind_it_and_in_between_it_ripples():
    for travel in (-0.013, 0.0, 0.004):
        pitch = chain_length(TEETH, travel + TEETH.ripple_pitch) - chain_length(TEETH, travel)
        assert pitch == pytest.approx(TEETH.ripple_pitch, rel=1e-12)
        near = chain_length(TEETH, travel + 1e-8) - chain_length(TEETH, travel - 1e-8)
        assert chain_ratio(TEETH, travel) == pytest.approx(near / 2e-8, rel=1e-7)
    grid = np.linspace(0.0, TEETH.ripple_pitch, 2001)
    off = [chain_length(TEETH, x) - x for x in grid.tolist()]
    assert (min(off), max(off)) == pytest.approx((-TEETH.ripple, TEETH.ripple), rel=1e-5)


def test_the_tendon_pulls_with_the_muscles_force_times_the_ratio_of_the_teeth():
    muscle = make("six_parameter", chain=TEETH, friction=Friction())
    row, act = pack(muscle).tolist(), charged(muscle, 0.19, 3e5)
    for x in (0.187, 0.19, 0.192):  # the work on the tendon is then that on the muscle
        pull, ratio = kernel.tension(row, act, x), chain_ratio(TEETH, x)
        outside = kernel.tendon_force(row, act, pull, x, 0.0, 5e-4)
        assert pull > 10.0
        assert abs(ratio - 1.0) > 0.02
        assert outside == pytest.approx(ratio * pull, rel=1e-9)


def test_a_muscle_moves_at_the_speed_behind_the_teeth():
    """Seen in the operator, whose memory follows the contraction."""
    rates = []
    for chain in (TEETH, Chain()):
        muscle = make("six_parameter", "bouc_wen", chain=chain)
        act = charged(muscle, 0.19, 3e5, z=0.0)
        out = [0.0] * len(act)
        kernel.state_rates(pack(muscle).tolist(), act, out, 0.19, 0.03, 0.0, 0.0, 5e-4)
        rates.append(out[0])
    ratio = chain_ratio(TEETH, 0.19)
    assert abs(ratio - 1.0) > 0.02
    assert rates[0] == pytest.approx(ratio * rates[1], rel=1e-9)
