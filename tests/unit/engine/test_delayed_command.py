"""When a late command reaches the valves, against the command looked up at every time."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.engine.delayed_command import arriving_commands

DT, STEPS, SAMPLES = 5e-4, 4, 30
BEFORE = (2e5, 3e5)
RNG = np.random.default_rng(9)
COMMANDS = np.repeat(RNG.uniform(0.0, 6e5, (10, 2)), 3, axis=0)


def heard(delays):
    """Begin, end and command of every time step."""
    plan = arriving_commands(COMMANDS, BEFORE, delays, DT, STEPS)
    assert len(plan) == SAMPLES
    found, now = [], 0.0
    for k, stretches in enumerate(plan):
        assert now == pytest.approx(k * STEPS * DT, abs=1e-12)
        for row, length, count in stretches:
            for _ in range(count):
                found.append((now, now + length, row))
                now += length
    assert now == pytest.approx(SAMPLES * STEPS * DT, abs=1e-12)
    return found


@pytest.mark.parametrize(
    "delays", [(0.0, 0.0), (2e-3, 5e-4), (1.3e-4, 0.0), (0.0137, 0.0041), (3.3e-4, 3.3e-4), (9, 0)]
)
def test_every_time_hears_what_was_commanded_a_delay_ago(delays):
    for begin, end, row in heard(delays):
        assert 0.0 < end - begin <= DT * (1.0 + 1e-9)
        for share in (0.01, 0.5, 0.99):  # an edge lies at no place but an end
            for muscle, delay in enumerate(delays):
                sample = np.floor((begin + share * (end - begin) - delay) / (STEPS * DT))
                commanded = COMMANDS[int(sample), muscle] if sample >= 0 else BEFORE[muscle]
                assert row[muscle] == commanded


def test_delays_of_whole_steps_divide_none():
    for delays in ((0.0, 0.0), (5e-4, 2e-3), (0.0215, 0.043)):  # the last two not exactly in floats
        assert all(end - begin == pytest.approx(DT) for begin, end, _ in heard(delays))
        lengths = {
            length
            for s in arriving_commands(COMMANDS, BEFORE, delays, DT, STEPS)
            for _, length, _ in s
        }
        assert lengths == {DT}
