"""Parameters and states by name: every muscle goes in and comes back, a name has one place."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.core.errors import EngineError, InputError, ParameterError
from pamsim.core.parameters import ParameterGroup, specs
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import (
    COMMON,
    SIGNATURE,
    SIZE,
    STATE_NAMES,
    STATES,
    has_parameter,
    is_muscle,
    joined_states,
    pack,
    parameters,
    record_dtype,
    slot,
    split_states,
    state_size,
    unpack,
    view,
    with_row,
)
from pamsim.physics.valves import COMMANDS
from tests.unit.core.refusals import refused
from tests.unit.physics.muscles import FORCES, KINDS, LOOPS, bellows, make

PUSHING = bellows(hysteresis=BoucWen(yield_contraction=0.02, force=3.0))
MUSCLES = {
    "-".join(kind): make(*kind, command=COMMANDS[i % len(COMMANDS)]) for i, kind in enumerate(KINDS)
} | {"pushing": PUSHING}


def groups_of(muscle) -> dict[str, ParameterGroup]:
    """Those that have a meaning for it."""
    found = {f.name: getattr(muscle, f.name) for f in dataclasses.fields(muscle)}
    return {
        name: g
        for name, g in found.items()
        if isinstance(g, ParameterGroup) and has_parameter(muscle, f"{name}.{specs(type(g))[0][0]}")
    }


def laws_of(muscle):
    return type(muscle.force), type(muscle.hysteresis) if muscle.hysteresis else None


def test_every_law_the_kernel_knows_is_tried_here():
    tried = {type(law) for law in FORCES.values()}, {type(loop) for loop in LOOPS.values()}
    # Pushing actuators have tests of their own, test_pushing.
    pulling = {law.group for law in FORCE_LAWS.values() if not law.pushes}
    known = pulling, {operator.group for operator in OPERATORS.values()}
    assert tried == known, "add the new law to tests/unit/physics/muscles.py"
    assert {law for law, _ in KINDS} == set(FORCES)
    assert {loop for _, loop in KINDS} == {"none", *LOOPS}


def test_muscle_survives_the_row_whatever_its_numbers():
    rng = np.random.default_rng(6)
    for name, muscle in MUSCLES.items():
        row = pack(muscle)
        assert row.shape == (SIZE,)
        assert is_muscle(row)
        assert unpack(row) == muscle, name
        assert unpack([*row.tolist(), 0.0, 0.0]) == muscle  # a wider model pads its rows
        for _ in range(3):
            scattered = {
                name: type(group)(
                    **{f: float(rng.uniform(s.low, s.high)) for f, s in specs(type(group))}
                )
                for name, group in groups_of(muscle).items()
                if name != "hysteresis"  # some operators bind their fields to each other
            }
            other = dataclasses.replace(muscle, **scattered)
            assert unpack(pack(other)) == other, name


def test_each_number_is_found_by_name_in_the_row_in_its_view_and_in_plain_python():
    for muscle in MUSCLES.values():
        row = pack(muscle)
        (m,) = row.view(record_dtype(*laws_of(muscle)))  # as compiled code reads it
        plain = view(row), view(row.tolist()), parameters(muscle)
        slots = []
        for name, group in groups_of(muscle).items():
            for field, _ in specs(type(group)):
                value, index = getattr(group, field), slot(f"{group.group}.{field}", muscle)
                assert row[index] == m[group.group][field] == value, (name, field)
                assert all(getattr(getattr(one, name), field) == value for one in plain)
                slots.append(index)
        assert len(set(slots)) == len(slots)
        assert m["signature"] == SIGNATURE
        assert COMMANDS[int(m["command"])] == muscle.command
        assert m["partner"] == 0.0
        assert m["force"]["law"] == plain[0].force.law == FORCE_LAWS.code(type(muscle.force))
        operator = OPERATORS.code(type(muscle.hysteresis)) if muscle.hysteresis else 0.0
        assert m["hysteresis"]["law"] == operator
        # What has no meaning for the actuator has places all the same.
        assert set(vars(plain[0])) == set(m.dtype.names)
        # Stroke and braid share what contraction is taken against.
        length = (muscle.stroke or muscle.braid).nominal_length
        assert plain[0].braid.nominal_length == plain[0].stroke.nominal_length == length
    plain[0].chamber.temperature = 1.0
    assert unpack(row) == muscle  # a view in plain Python is a copy


def test_a_muscle_has_the_parameters_of_its_laws_and_of_no_other():
    muscle = make("six_parameter", "bouc_wen")
    for name in ("force.a", "hysteresis.sigma", "hysteresis.force", "chamber.temperature"):
        assert has_parameter(muscle, name)
    for other, name in (
        (make("ideal_mckibben"), "force.a"),
        (make(), "hysteresis.force"),
        (make(), "stroke.damping"),
        (make(), "stroke.nominal_length"),
        (PUSHING, "braid.nominal_length"),
        (PUSHING, "threshold.pressure"),
    ):
        assert not has_parameter(other, name)
        with refused(f"'{name}'"):
            slot(name, other)
    with refused("'chamber.dead_volum'", "did you mean 'chamber.dead_volume'"):
        slot("chamber.dead_volum")
    with refused("'force.scal'", "did you mean 'force.scale'"):
        slot("force.scal", make())


def test_states_are_the_operator_s_and_those_that_all_muscles_have_by_name():
    assert state_size(make()) == COMMON
    for loop in LOOPS:
        assert state_size(make(loop=loop)) == LOOPS[loop].state_count + COMMON
    act = [float(i) for i in range(state_size(make(loop="maxwell_slip")))]
    s, z = split_states(act)
    assert joined_states(s, z) == [*z, *(getattr(s, name) for name in STATE_NAMES)] == act
    named = np.array(act)[-len(STATE_NAMES) :].view(STATES)[0]
    assert all(named[name] == getattr(s, name) for name in STATE_NAMES)
    s.air, z[0] = 7.0, 8.0
    assert act == [float(i) for i in range(len(act))]  # they are copies


def test_a_muscle_takes_the_numbers_of_a_row_with_its_laws():
    for muscle in MUSCLES.values():
        row = pack(muscle)
        assert with_row(muscle, row) is muscle
        for name in ("chamber.temperature", "force.scale"):
            row[slot(name, muscle)] *= 0.99
        changed = with_row(muscle, row)
        assert changed == unpack(row) != muscle
        assert changed.valve is muscle.valve
        row[slot("chamber.temperature")] = 3.0
        for read in (unpack, lambda row, muscle=muscle: with_row(muscle, row)):
            with refused("chamber.temperature = 3", error=ParameterError):
                read(row)


def test_a_row_that_is_no_muscle_s_is_refused():
    for row in (np.zeros(SIZE), np.ones(3), pack(make())[:-1]):
        assert not is_muscle(row)
        with pytest.raises(EngineError, match=r"\A[^\n]+\Z"):
            unpack(row)
    for name in ("force.law", "hysteresis.law", "command"):
        for code in (-1.0, 0.5, 99.0, float("nan")):
            row = pack(make())
            row[slot(name)] = code
            with pytest.raises(EngineError, match=name):
                unpack(row)
    with pytest.raises(InputError, match="did you mean 'valve'"):
        make(command="vlave")
