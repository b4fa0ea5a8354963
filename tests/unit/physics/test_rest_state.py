"""The rest that every state starts from."""

import dataclasses

import pytest

from pamsim.physics.chain import Chain
from pamsim.physics.record import pack, split_states, state_size
from tests.unit.physics.flat import (
    contraction,
    gauge_pressure,
    kernel,
    length_at_muscle,
    rest_state,
)
from tests.unit.physics.muscles import LASTING, LOOPS, charged, make


@pytest.mark.parametrize("command", ["valve", "pulse", "pressure_set"])
def test_a_muscle_at_rest_has_free_creep_middle_play_and_shut_valves(command):
    """Nothing moves but what its own tension, and a leak, set in motion."""
    for loop in ("none", *LOOPS):
        muscle = make(loop=loop, command=command, **LASTING)
        muscle = dataclasses.replace(muscle, creep=make().creep, chain=Chain(backlash=5e-4))
        row, act = pack(muscle).tolist(), [9.0] * state_size(muscle)
        rest_state.rest(row, act, 0.19, 3e5)
        assert length_at_muscle(row, act, 0.19) == 0.19
        assert gauge_pressure(row, act, 0.19) == pytest.approx(3e5, rel=1e-12)
        without = pack(dataclasses.replace(muscle, creep=LASTING["creep"])).tolist()
        balance = kernel.tension(row, act, 0.19)
        assert balance == kernel.tension(without, act, 0.19), loop
        out, held = [9.0] * len(act), split_states(act)[0].line
        assert held == (3e5 if command == "pressure_set" else 0.0)
        kernel.state_rates(row, act, out, 0.19, 0.0, held, 0.0, 1e-3, balance)
        assert out[-7:-1] == [0.0] * 6, loop
        # The set point is the pressure but for its rounding.
        assert out[-1] == pytest.approx(0.0, abs=1e-9 * act[-1])


def test_quieten_relaxes_creep_where_the_muscle_is_and_leaves_play_and_air():
    muscle = make("six_parameter")
    row, act = pack(muscle).tolist(), charged(muscle, 0.2, 3e5)
    before = list(act)
    rest_state.quieten(row, act, 0.2, 3e5)
    assert act[-4] == contraction(row, length_at_muscle(row, act, 0.2))
    assert act[-5] == 0.0
    assert act[-3:] == before[-3:]
    measured = make(command="measured")  # whose air is the pressure itself
    rest_state.quieten(pack(measured).tolist(), act, 0.2, 3e5)
    assert act[-1] == 3e5 + measured.chamber.atmosphere
