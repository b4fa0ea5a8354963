"""The parameter row: every muscle goes in and comes back, every name has one place."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.core.errors import EngineError, InputError, ParameterError
from pamsim.core.parameters import ParameterGroup, specs
from pamsim.physics.commands import COMMANDS
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import COMMON, NAMES, SIZE, is_muscle, pack, slot, state_size, unpack
from tests.unit.core.refusals import refused
from tests.unit.physics.flat import parameter_slot
from tests.unit.physics.muscles import FORCES, KINDS, LOOPS, make

GROUP_FIELDS = {
    "mounting", "braid", "force", "passive", "threshold", "end_shape", "creep", "hysteresis",
    "parallel_hysteresis", "chamber", "valve", "chain", "friction",
}  # fmt: skip


def groups_of(muscle) -> dict[str, ParameterGroup]:
    found = {f.name: getattr(muscle, f.name) for f in dataclasses.fields(muscle)}
    return {name: g for name, g in found.items() if isinstance(g, ParameterGroup)}


def test_every_law_the_kernel_knows_is_tried_here():
    tried = {type(law) for law in FORCES.values()}, {type(loop) for loop in LOOPS.values()}
    # Pushing actuators have tests of their own, test_pushing.
    pulling = {law.group for law in FORCE_LAWS.values() if not law.pushes}
    known = pulling, {operator.group for operator in OPERATORS.values()}
    assert tried == known, "add the new law to tests/unit/actuator/muscles.py"
    assert {law for law, _ in KINDS} == set(FORCES)
    assert {loop for _, loop in KINDS} == {"none", *LOOPS}
    assert set(groups_of(make(loop="bouc_wen"))) == GROUP_FIELDS


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_muscle_survives_the_row(kind, command):
    muscle = make(*kind, command=command)
    row = pack(muscle)
    assert row.shape == (SIZE,)
    assert row.dtype == np.float64
    assert is_muscle(row)
    assert unpack(row) == muscle
    assert unpack([*row.tolist(), 0.0, 0.0]) == muscle  # a wider model pads its rows
    assert np.array_equal(pack(unpack(row)), row)


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_any_numbers_survive_the_row(kind):
    rng = np.random.default_rng(6)
    for _ in range(20):
        scattered = {
            name: type(group)(
                **{f: float(rng.uniform(s.low, s.high)) for f, s in specs(type(group))}
            )
            for name, group in groups_of(make(*kind)).items()
            if name != "hysteresis"  # some operators bind their fields to each other
        }
        muscle = make(*kind, **scattered)
        assert unpack(pack(muscle)) == muscle


def test_slot_names_are_unique_and_findable():
    assert len(set(NAMES)) == len(NAMES) == SIZE
    assert [slot(name) for name in NAMES] == list(range(SIZE))


@pytest.mark.parametrize("law", [law.group for law in (*FORCE_LAWS.values(), *OPERATORS.values())])
def test_numbered_slots_have_room_for_every_law(law):
    numbered = [name for name in NAMES if name.startswith(f"{law.group}.") and name[-1].isdigit()]
    assert len(numbered) >= len(specs(law))


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_every_parameter_of_a_muscle_has_its_own_slot_and_lies_in_it(kind):
    muscle = make(*kind)
    row = pack(muscle)
    slots: list[int] = []
    for group in groups_of(muscle).values():
        for field, _ in specs(type(group)):
            index = parameter_slot(muscle, f"{group.group}.{field}")
            assert row[index] == getattr(group, field)
            slots.append(index)
    assert len(set(slots)) == len(slots)


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_moving_one_slot_moves_one_parameter(kind):
    muscle = make(*kind)
    for group in groups_of(muscle).values():
        for field, spec in specs(type(group)):
            row, value = pack(muscle), getattr(group, field)
            perhaps_count = spec.low >= 1.0 and value == round(value)
            moved = value + 1.0 if perhaps_count else float(np.nextafter(value, spec.high))
            row[parameter_slot(muscle, f"{group.group}.{field}")] = moved
            changed = dataclasses.replace(group, **{field: moved})
            assert changed != group
            assert groups_of(unpack(row)) == groups_of(muscle) | {group.group: changed}


def test_law_fields_lie_in_their_law_s_numbered_slots():
    muscle = make("six_parameter", "bouc_wen")
    for law in (muscle.force, muscle.hysteresis):
        for index, (field, _) in enumerate(specs(type(law))):
            numbered = slot(f"{law.group}.{index}")
            assert parameter_slot(muscle, f"{law.group}.{field}") == numbered
    with refused("'force.a'"):
        parameter_slot(make("ideal_mckibben"), "force.a")
    with refused("'hysteresis.force'"):
        parameter_slot(make(), "hysteresis.force")


def test_unknown_names_suggest_the_nearest():
    with refused("'chamber.dead_volum'", "did you mean 'chamber.dead_volume'"):
        slot("chamber.dead_volum")
    with refused("'force.scal'", "did you mean 'force.scale'"):
        parameter_slot(make(), "force.scal")


@pytest.mark.parametrize("loop", LOOPS)
def test_states_are_the_operator_s_and_those_that_all_muscles_have(loop):
    assert state_size(make()) == COMMON
    assert state_size(make(loop=loop)) == LOOPS[loop].state_count + COMMON


@pytest.mark.parametrize("row", [np.zeros(SIZE), np.ones(3), pack(make())[:-1]])
def test_another_actuator_s_row_is_no_muscle(row):
    assert not is_muscle(row)
    with pytest.raises(EngineError, match=r"\A[^\n]+\Z"):
        unpack(row)


def test_a_number_put_out_of_range_is_noticed_on_reading():
    row = pack(make())
    row[slot("chamber.temperature")] = 3.0
    with refused("chamber.temperature = 3", error=ParameterError):
        unpack(row)


@pytest.mark.parametrize("name", ["force.law", "hysteresis.law", "command"])
@pytest.mark.parametrize("code", [-1.0, 0.5, 99.0, float("nan")])
def test_a_code_that_stands_for_nothing_is_refused(name, code):
    row = pack(make())
    row[slot(name)] = code
    with pytest.raises(EngineError, match=name):
        unpack(row)


def test_a_muscle_knows_its_commands():
    with pytest.raises(InputError, match="did you mean 'valve'"):
        make(command="vlave")
