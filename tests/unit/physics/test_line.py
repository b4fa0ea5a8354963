"""The command's line, and the rest that every state starts from."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.physics.chain import Chain
from pamsim.physics.muscle_valves import line_rate
from pamsim.physics.record import pack, state_size
from pamsim.physics.step_limits import chain_step_limit
from pamsim.physics.valves import PRESSURE_SET, VALVE
from tests.unit.physics.flat import (
    contraction,
    gauge_pressure,
    kernel,
    length_at_muscle,
    rest_state,
)
from tests.unit.physics.muscles import LASTING, LOOPS, PLAIN_VALVE, charged, make


def rate(command, carried, timestep, **line):
    """Rate of a command of a set point on a line, or of an opening up to 1."""
    valve = SimpleNamespace(**{"line_lag": 0.0, "line_slew_time": 0.0} | line)
    m = SimpleNamespace(command=PRESSURE_SET if abs(command) > 1.0 else VALVE, valve=valve)
    return line_rate(m, SimpleNamespace(line=carried), command, timestep)


@pytest.mark.parametrize("timestep", [1e-4, 0.02, 1.0])
def test_the_line_closes_in_exponentially_at_any_time_step(timestep):
    carried, seen = 0.2, []
    for _ in range(30):
        seen.append(carried)
        carried += timestep * rate(0.9, carried, timestep, line_lag=0.05)
    expected = 0.9 - 0.7 * np.exp(-timestep * np.arange(30) / 0.05)
    assert seen == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("lag", [0.0, 0.05])
def test_a_line_of_limited_rate_moves_by_its_full_scale_in_its_time(lag):
    """A high step at the limit, down as up; what is left of it as without one."""
    slew_time, full, timestep = 0.2, 1e5, 1e-3
    line = {"line_lag": lag, "line_slew_time": slew_time}
    for height in (4e5, -4e5):
        carried, seen = 0.0, []
        for _ in range(2000):
            seen.append(carried)
            carried += timestep * rate(height, carried, timestep, **line)
        rates = np.diff(seen) / timestep
        limited = np.abs(height - np.array(seen[:-1])) > max(lag, timestep) * full / slew_time
        assert np.sum(limited) > 500
        assert rates[limited] == pytest.approx(math.copysign(full / slew_time, height))
        assert np.abs(rates).max() <= full / slew_time * (1.0 + 1e-9)
        assert carried == pytest.approx(height, rel=1e-9)
    assert math.isnan(rate(math.nan, 0.0, timestep, **line))


@pytest.mark.parametrize(
    ("command", "sent", "full"), [("pressure_set", 3e5, 1e5), ("valve", 0.9, 1.0)]
)
def test_a_limited_rate_refers_to_1_bar_of_a_set_point_and_to_a_full_opening(command, sent, full):
    valve = dataclasses.replace(PLAIN_VALVE, line_slew_time=0.25)
    muscle = make(valve=valve, command=command)
    act = charged(muscle, 0.19, 1e5, carried=0.0)
    out = [0.0] * len(act)
    kernel.state_rates(pack(muscle), act, out, 0.19, 0.0, sent, 0.0, 1e-3)
    assert out[-5] == pytest.approx(full / 0.25, rel=1e-12)


def test_the_valve_hears_what_the_line_carries_and_not_the_command():
    lagging = make(valve=dataclasses.replace(PLAIN_VALVE, line_lag=0.05))
    prompt = make(valve=PLAIN_VALVE)
    for carried in (-0.6, 0.3):
        act = charged(lagging, 0.19, 3e5, carried=carried)
        found, expected = [0.0] * len(act), [0.0] * len(act)
        for muscle, commanded, out in ((lagging, 0.8, found), (prompt, carried, expected)):
            kernel.state_rates(pack(muscle), act, out, 0.19, 0.0, commanded, 0.0, 1e-3)
        assert found[-1] == expected[-1] != 0.0


@pytest.mark.parametrize("command", ["valve", "pulse", "pressure_set"])
@pytest.mark.parametrize("loop", ["none", *LOOPS])
def test_a_muscle_at_rest_has_free_creep_middle_play_and_shut_valves(loop, command):
    """Nothing moves but what its own tension, and a leak, set in motion."""
    muscle = make(loop=loop, command=command, **LASTING)
    muscle = dataclasses.replace(muscle, creep=make().creep, chain=Chain(backlash=5e-4))
    row, act = pack(muscle).tolist(), [9.0] * state_size(muscle)
    rest_state.rest(row, act, 0.19, 3e5)
    assert length_at_muscle(row, act, 0.19) == 0.19
    assert gauge_pressure(row, act, 0.19) == pytest.approx(3e5, rel=1e-12)
    without = pack(dataclasses.replace(muscle, creep=LASTING["creep"])).tolist()
    assert kernel.tension(row, act, 0.19) == kernel.tension(without, act, 0.19)
    out = [9.0] * len(act)
    held = act[-5]
    assert held == (3e5 if command == "pressure_set" else 0.0)
    balance = kernel.tension(row, act, 0.19)
    kernel.state_rates(row, act, out, 0.19, 0.0, held, 0.0, 1e-3, balance)
    assert out[-7:-1] == [0.0] * 6
    # the set point is the pressure but for its rounding
    assert out[-1] == pytest.approx(0.0, abs=1e-9 * act[-1])


def test_quieten_relaxes_creep_where_the_muscle_is_and_leaves_play_and_air():
    muscle = make("six_parameter")
    row, act = pack(muscle).tolist(), charged(muscle, 0.2, 3e5)
    before = list(act)
    rest_state.quieten(row, act, 0.2, 3e5)
    assert act[-4] == contraction(row, length_at_muscle(row, act, 0.2))
    assert act[-5] == 0.0
    assert act[-3:] == before[-3:]


@pytest.mark.parametrize("pressure", [1e5, 5e5])
def test_a_chain_settles_just_inside_its_step_limit_and_swings_up_beyond(pressure):
    chain = Chain(compliance=1.5e-5, relaxation_time=5e-3)
    muscle = make("six_parameter", **(LASTING | {"chain": chain}))
    row, tendon = pack(muscle).tolist(), 0.185

    def swing(share):
        """Growth of a small deviation of the extension over 60 steps on shut valves."""
        act = charged(muscle, tendon, pressure)
        for _ in range(4000):  # to rest, in steps well inside
            out = [0.0] * len(act)
            kernel.state_rates(row, act, out, tendon, 0.0, 0.0, 0.0, 2e-4)
            act[-2] += 2e-4 * out[-2]
        at = act[-2]
        own = gauge_pressure(row, act, tendon)
        step = share * chain_step_limit(muscle, tendon - at, own)
        act[-2] += 1e-9
        for _ in range(60):
            out = [0.0] * len(act)
            kernel.state_rates(row, act, out, tendon, 0.0, 0.0, 0.0, step)
            act[-2] += step * out[-2]
        return abs(act[-2] - at) / 1e-9

    assert swing(0.97) < 0.2
    assert swing(1.03) > 5.0
    assert chain_step_limit(dataclasses.replace(muscle, chain=Chain()), tendon, pressure) > 1e9
