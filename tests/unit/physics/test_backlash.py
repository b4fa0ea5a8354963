"""Play of a chain between two muscles: where it shifts, what it costs, that it gives nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.physics.chain import Chain, shift_rate
from pamsim.physics.record import pack
from pamsim.physics.step_limits import chain_step_limit
from tests.unit.physics.flat import kernel, length_at_muscle
from tests.unit.physics.muscles import LASTING, charged, make

PLAY, DAMPING = 6e-4, 1e3
TENDON, PRESSURE = 0.19, 3e5


def with_play(play: float = PLAY, loop: str = "none", **chain):
    return make("six_parameter", loop, **(LASTING | {"chain": Chain(backlash=play, **chain)}))


def turned(muscle, travel, timestep):
    """Shift of the chain and difference of pulls while its sprocket is turned, valves shut.

    Args:
        muscle: at both ends.
        travel: (n,) of the sprocket's rim, towards the first muscle [m].
        timestep: [s].
    """
    row = pack(muscle).tolist()
    ends = [charged(muscle, TENDON, PRESSURE, 0.0) for _ in range(2)]
    for act in ends:
        act[-3] = 0.0
    shifts, apart = [], []
    out = [0.0] * len(ends[0])
    speeds = np.diff(travel, append=travel[-1]) / timestep
    for x, v in zip(travel.tolist(), speeds.tolist(), strict=True):
        lengths = TENDON - x, TENDON + x
        pulls = [kernel.tension(row, a, at) for a, at in zip(ends, lengths, strict=True)]
        shifts.append(ends[0][-3])
        apart.append(pulls[0] - pulls[1])
        assert ends[1][-3] == -ends[0][-3]
        for act, at, speed, other in zip(ends, lengths, (-v, v), pulls[::-1], strict=True):
            kernel.state_rates(row, act, out, at, speed, 0.0, 0.0, timestep, other)
            for i in range(len(act)):
                act[i] += timestep * out[i]
    return np.array(shifts), np.array(apart)


def sine(amplitude, cycles, steps):
    return amplitude * np.sin(np.linspace(0.0, 2.0 * math.pi * cycles, cycles * steps + 1))


def test_the_chain_slides_towards_the_stronger_pull_up_to_a_tooth():
    chain = Chain(backlash=PLAY, seating_damping=DAMPING)
    speed = shift_rate(chain, 0.0, 130.0, 30.0, 1e-4)
    assert speed == pytest.approx(-0.1)
    assert shift_rate(chain, 0.0, 30.0, 130.0, 1e-4) == -speed
    for start, pull, tooth in ((2e-4, 0.0, 3e-4), (-2.9e-4, 5e3, -3e-4), (3e-4, -9e9, 3e-4)):
        at = start + 1e-2 * shift_rate(chain, start, pull, 40.0, 1e-2)
        assert at == pytest.approx(tooth, rel=1e-12)
    assert shift_rate(chain, 3e-4, 0.0, 50.0, 1e-3) == 0.0
    assert math.isnan(shift_rate(chain, 0.0, math.nan, 50.0, 1e-3))


def test_elastic_teeth_give_beyond_the_play_per_pull_and_as_they_relax_in_time():
    """At rest s = g/2 + c (T' - T), which a step of any length closes in on without overshoot."""
    teeth = Chain(backlash=PLAY, seating_damping=DAMPING, tooth_compliance=2e-6)
    for step in (1e-5, 1e-3, 1e9):
        resting = 3e-4 + 2e-6 * 120.0
        assert shift_rate(teeth, resting, 30.0, 150.0, step) == pytest.approx(0.0, abs=1e-9)
        assert 0.0 < step * shift_rate(teeth, 3e-4, 30.0, 150.0, step) <= 2e-6 * 120.0
    apart = shift_rate(teeth, resting + 1e-7, 30.0, 150.0, 1e-9)
    assert apart == pytest.approx(-1e-7 / (DAMPING * 2e-6), rel=1e-4)


def test_turned_slowly_the_chain_stays_where_the_pulls_are_equal_until_a_tooth_takes_it():
    """Without friction or hysteresis the pulls are a function of the rim beyond the play alone."""
    travel = sine(2e-3, 1, 2000)
    shifts, apart = turned(with_play(), travel, 1e-2)
    np.testing.assert_allclose(shifts, np.clip(travel, -PLAY / 2, PLAY / 2), atol=2e-5)
    beyond = travel - np.clip(travel, -PLAY / 2, PLAY / 2)
    _, tight = turned(with_play(0.0), beyond, 1e-2)
    np.testing.assert_allclose(apart, tight, atol=0.01 * np.ptp(tight))
    assert np.ptp(tight) > 100.0


@pytest.mark.parametrize("teeth", [0.0, 1e-6])
@pytest.mark.parametrize("timestep", [8e-6, 4e-5, 2e-4, 8e-3])
def test_turning_it_to_and_fro_takes_work_and_never_gives_any(timestep, teeth):
    """Muscles without loss: over a cycle all work is what sliding costs, (T - T')^2 / b.

    Steps longer than the time constant of elastic teeth take more, as implicit Euler does.
    """
    travel = sine(1.5e-3, 2, 1000)
    shifts, apart = turned(with_play(tooth_compliance=teeth), travel, timestep)
    cycle = slice(-1001, None)
    work = -np.trapezoid(apart[cycle], travel[cycle])  # against the pull of muscle 1
    sliding = np.diff(shifts)[-1000:] / timestep
    brake = DAMPING * float(np.sum(sliding**2)) * timestep
    assert brake > 0.0
    if timestep < DAMPING * teeth or teeth == 0.0:
        assert work == pytest.approx(brake, rel=0.05)
    else:
        assert work > brake


def test_an_operator_sees_the_muscle_s_own_travel():
    """A chain that shifts as fast as its tendon shortens leaves the muscle at rest."""
    muscle = with_play(loop="bouc_wen", seating_damping=DAMPING)
    row, act = pack(muscle).tolist(), charged(muscle, TENDON, PRESSURE, 0.0)
    act[-3] = 0.0
    out = [0.0] * len(act)
    opposing = kernel.tension(row, act, TENDON) + 50.0
    kernel.state_rates(row, act, out, TENDON, -50.0 / DAMPING, 0.0, 0.0, 1e-3, opposing)
    assert out[-3] == pytest.approx(50.0 / DAMPING, rel=1e-12)
    assert out[0] == pytest.approx(0.0, abs=1e-12)


def test_the_chain_extends_beside_its_shift():
    muscle = with_play(compliance=2e-6)
    row, act = pack(muscle).tolist(), charged(muscle, TENDON, PRESSURE)
    act[-3], act[-2] = 1.7e-4, 4e-4
    assert length_at_muscle(row, act, TENDON) == pytest.approx(TENDON + 1.7e-4 - 4e-4, rel=1e-15)


def test_between_two_muscles_it_settles_inside_its_step_limit_and_swings_up_beyond():
    muscle = with_play(seating_damping=200.0)
    row = pack(muscle).tolist()

    def growth(share):
        step = share * chain_step_limit(muscle, TENDON, PRESSURE)
        ends = [charged(muscle, TENDON, PRESSURE, 0.0) for _ in range(2)]
        ends[0][-3], ends[1][-3] = 1e-9, -1e-9
        out = [0.0] * len(ends[0])
        for _ in range(60):
            pulls = [kernel.tension(row, act, TENDON) for act in ends]
            for act, other in zip(ends, pulls[::-1], strict=True):
                kernel.state_rates(row, act, out, TENDON, 0.0, 0.0, 0.0, step, other)
                act[-3] += step * out[-3]
        return abs(ends[0][-3]) / 1e-9

    assert growth(0.95) < 0.3
    assert growth(1.05) > 3.0
