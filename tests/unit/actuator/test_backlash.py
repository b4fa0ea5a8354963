"""Play between sprocket and chain: how the muscle follows, and what a cycle gives back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.actuator import kernel
from pamsim.actuator.chain import Chain
from pamsim.actuator.layout import pack
from tests.unit.actuator.muscles import LASTING, charged, make

PLAY = 6e-4


def follow(muscle, lengths, timestep=1e-3):
    """Length left to the muscle and tension along a path of the tendon with the valves shut."""
    row = pack(muscle).tolist()
    act = charged(muscle, float(lengths[0]), 2e5, 0.0)
    act[-3] = float(lengths[0])  # in the middle of the play
    left, tensions, out = [], [], [0.0] * len(act)
    for length in lengths.tolist():
        left.append(kernel.taken_up(row, act, length))
        tensions.append(kernel.tension(row, act, length))
        kernel.state_rates(row, act, out, length, 0.0, 0.0, 0.0, timestep)
        for i in range(len(act)):
            act[i] += timestep * out[i]
    return np.array(left), np.array(tensions)


def with_play(play: float = PLAY, loop: str = "none", compliance: float = 0.0):
    chain = Chain(backlash=play, compliance=compliance, relaxation_time=0.01)
    return make("six_parameter", loop, **(LASTING | {"chain": chain}))


PATH = (
    0.19
    + np.concatenate(
        [
            np.linspace(0.0, 2e-3, 101),
            np.linspace(2e-3, -1e-3, 151)[1:],
            np.linspace(-1e-3, -0.6e-3, 21)[1:],  # a reversal inside the play
            np.linspace(-0.6e-3, 2e-3, 131)[1:],
        ]
    )
)


def test_the_muscle_stands_still_for_the_play_after_every_reversal():
    """Against the play operator written as running maximum and minimum of the path."""
    left, _ = follow(with_play(), PATH)
    held, expected = PATH[0], []
    for length in PATH.tolist():
        held = max(length - PLAY / 2, min(length + PLAY / 2, held))
        expected.append(held)
    np.testing.assert_allclose(left, expected, rtol=0.0, atol=1e-15)
    assert np.abs(PATH - left).max() == pytest.approx(PLAY / 2, rel=1e-9)
    assert np.all(left[101:121] == left[100])  # 0.4 mm back from the top: within the play
    assert left[-1] == pytest.approx(PATH[-1] - PLAY / 2, rel=1e-12)


def test_it_does_not_matter_how_fast_the_tendon_goes():
    once, _ = follow(with_play(), PATH, 1e-3)
    slow, _ = follow(with_play(), PATH, 1.0)
    np.testing.assert_allclose(once, slow, rtol=0.0, atol=1e-15)


def test_an_operator_sees_the_muscle_s_own_travel():
    """Bouc-Wen turns over with the travel that is left, not with the sprocket's."""
    swing = 0.19 + 0.2e-3 * np.sin(
        np.linspace(0.0, 4.0 * math.pi, 400)
    )  # all of it within the play
    row = pack(with_play(loop="bouc_wen")).tolist()
    act = charged(with_play(loop="bouc_wen"), 0.19, 2e5, 0.0)
    act[-3] = 0.19
    out = [0.0] * len(act)
    for length, velocity in zip(swing, np.gradient(swing, 1e-3), strict=True):
        kernel.state_rates(row, act, out, float(length), float(velocity), 0.0, 0.0, 1e-3)
        assert out[0] == 0.0
        assert out[-3] == 0.0


@pytest.mark.parametrize("play", [2e-4, 1e-3])
def test_a_slow_cycle_gives_back_the_play_times_the_swing_of_tension(play):
    """Virtual work: muscle and air return all, and the travel lost has the tension of its place."""
    phase = np.linspace(0.0, 4.0 * math.pi, 8001)
    path = 0.19 + 4e-3 * np.sin(phase)
    _, tensions = follow(with_play(play), path)
    last = slice(4000, None)
    work = float(np.trapezoid(tensions[last], path[last]))
    assert np.ptp(tensions[last]) > 50.0
    assert work == pytest.approx(-play * np.ptp(tensions[last]), rel=2e-3)


def test_the_chain_extends_beyond_the_play():
    muscle = with_play(compliance=2e-6)
    left, tensions = follow(muscle, np.concatenate([PATH, np.full(400, PATH[-1])]))
    assert left[-1] == pytest.approx(PATH[-1] - PLAY / 2 - 2e-6 * tensions[-1], rel=1e-9)
