"""Parameters and states by name: every muscle goes in and comes back, a name has one place."""

from __future__ import annotations

import dataclasses
from collections import Counter
from itertools import product

import numpy as np
import pytest

from pamsim.core.catalog import MOST_PARAMETERS
from pamsim.core.errors import EngineError, InputError, ParameterError
from pamsim.core.parameters import ParameterGroup, specs
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.effective_area import EffectiveArea, Stroke
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.muscle import Mounting, Muscle
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
    places_in_row,
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
from tests.unit.physics.muscles import FORCES, KINDS, LOOPS, make

GROUP_FIELDS = {
    "mounting", "braid", "force", "passive", "threshold", "end_shape", "creep", "hysteresis",
    "first_stroke", "softening", "parallel_hysteresis", "chamber", "valve", "chain", "friction",
    "learned",
}  # fmt: skip


PUSHING = Muscle(
    mounting=Mounting(length_at_zero=0.08),
    stroke=Stroke(nominal_length=0.1, damping=12.0),
    force=EffectiveArea(scale=0.9, area=5e-4, stiffness=300.0),
    hysteresis=BoucWen(yield_contraction=0.02, force=3.0),
    chamber=make().chamber,
    valve=make().valve,
)
MUSCLES = {"-".join(kind): make(*kind) for kind in KINDS} | {"pushing": PUSHING}


def groups_of(muscle) -> dict[str, ParameterGroup]:
    found = {f.name: getattr(muscle, f.name) for f in dataclasses.fields(muscle)}
    return {name: g for name, g in found.items() if isinstance(g, ParameterGroup)}


def test_every_law_the_kernel_knows_is_tried_here():
    tried = {type(law) for law in FORCES.values()}, {type(loop) for loop in LOOPS.values()}
    # Pushing actuators have tests of their own, test_pushing.
    pulling = {law.group for law in FORCE_LAWS.values() if not law.pushes}
    known = pulling, {operator.group for operator in OPERATORS.values()}
    assert tried == known, "add the new law to tests/unit/physics/muscles.py"
    assert {law for law, _ in KINDS} == set(FORCES)
    assert {loop for _, loop in KINDS} == {"none", *LOOPS}
    assert set(groups_of(make(loop="bouc_wen"))) == GROUP_FIELDS


def test_muscle_survives_the_row():
    for kind, command in product(KINDS, COMMANDS):
        muscle = make(*kind, command=command)
        row = pack(muscle)
        assert row.shape == (SIZE,)
        assert row.dtype == np.float64
        assert is_muscle(row)
        assert unpack(row) == muscle
        assert unpack([*row.tolist(), 0.0, 0.0]) == muscle  # a wider model pads its rows
        assert np.array_equal(pack(unpack(row)), row)


def test_any_numbers_survive_the_row():
    for kind in KINDS:
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


def laws_of(muscle) -> tuple[type[ParameterGroup], type[ParameterGroup] | None]:
    return type(muscle.force), type(muscle.hysteresis) if muscle.hysteresis else None


def test_the_packed_row_viewed_by_name_is_the_muscle():
    """As compiled code reads it."""
    for muscle in MUSCLES.values():
        record = pack(muscle).view(record_dtype(*laws_of(muscle)))
        assert record.shape == (1,)
        (m,) = record
        for group in groups_of(muscle).values():
            for field, _ in specs(type(group)):
                assert m[group.group][field] == getattr(group, field)
        assert m["signature"] == SIGNATURE
        assert COMMANDS[int(m["command"])] == muscle.command
        assert m["partner"] == 0.0
        assert m["force"]["law"] == FORCE_LAWS.code(type(muscle.force))
        operator = OPERATORS.code(type(muscle.hysteresis)) if muscle.hysteresis else 0.0
        assert m["hysteresis"]["law"] == operator


def test_plain_python_reads_the_same_names():
    for muscle in MUSCLES.values():
        row = pack(muscle)
        for m in (view(row), view(row.tolist()), parameters(muscle)):
            for name, group in groups_of(muscle).items():
                for field, _ in specs(type(group)):
                    assert getattr(getattr(m, name), field) == getattr(group, field)
            # What has no meaning for the actuator has places all the same.
            assert set(vars(m)) == set(record_dtype(*laws_of(muscle)).names)
            assert m.force.law == row[slot("force.law")]


def test_a_view_in_plain_python_is_a_copy():
    row = pack(make())
    view(row).chamber.temperature = 1.0
    assert unpack(row) == make()


def test_stroke_and_braid_share_what_contraction_is_taken_against():
    for muscle in MUSCLES.values():
        m = parameters(muscle)
        length = muscle.stroke or muscle.braid
        assert m.braid.nominal_length == m.stroke.nominal_length == length.nominal_length
        assert slot("stroke.nominal_length") == slot("braid.nominal_length")
        assert m.stroke.damping == (muscle.stroke.damping if muscle.stroke else 0.0)


def test_every_name_has_a_place_of_its_own():
    for muscle in MUSCLES.values():
        for laws in ((), laws_of(muscle)):
            places = places_in_row(*laws)
            count = Counter(places.values())
            shared = {name for name, at in places.items() if count[at] > 1 and ".law" not in name}
            assert shared == {"braid.nominal_length", "stroke.nominal_length"}
            # There are no gaps but behind the parameters of the laws.
            assert set(range(slot("force.law"))) < set(places.values()) <= set(range(SIZE))


def test_every_law_has_its_parameters_behind_its_code_in_declared_order():
    for law in (law.group for law in (*FORCE_LAWS.values(), *OPERATORS.values())):
        laws = (law, None) if law.group == "force" else (None, law)
        assert record_dtype(*laws).itemsize == 8 * SIZE
        places, first = places_in_row(*laws), slot(f"{law.group}.law") + 1
        own = [places[f"{law.group}.{field}"] for field, _ in specs(law)]
        assert own == list(range(first, first + len(own)))
        assert len(own) <= MOST_PARAMETERS


def test_every_parameter_of_a_muscle_has_its_own_slot_and_lies_in_it():
    for kind in KINDS:
        muscle = make(*kind)
        row = pack(muscle)
        slots: list[int] = []
        for group in groups_of(muscle).values():
            for field, _ in specs(type(group)):
                index = slot(f"{group.group}.{field}", muscle)
                assert row[index] == getattr(group, field)
                slots.append(index)
        assert len(set(slots)) == len(slots)


def test_moving_one_slot_moves_one_parameter():
    for kind in KINDS:
        muscle = make(*kind)
        for group in groups_of(muscle).values():
            for field, spec in specs(type(group)):
                row, value = pack(muscle), getattr(group, field)
                perhaps_count = spec.low >= 1.0 and value == round(value)
                moved = value + 1.0 if perhaps_count else float(np.nextafter(value, spec.high))
                row[slot(f"{group.group}.{field}", muscle)] = moved
                changed = dataclasses.replace(group, **{field: moved})
                assert changed != group
                assert groups_of(unpack(row)) == groups_of(muscle) | {group.group: changed}


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


def test_unknown_names_suggest_the_nearest():
    with refused("'chamber.dead_volum'", "did you mean 'chamber.dead_volume'"):
        slot("chamber.dead_volum")
    with refused("'force.scal'", "did you mean 'force.scale'"):
        slot("force.scal", make())


def test_states_are_the_operator_s_and_those_that_all_muscles_have():
    for loop in LOOPS:
        assert state_size(make()) == COMMON
        assert state_size(make(loop=loop)) == LOOPS[loop].state_count + COMMON


def test_states_have_names_behind_the_memory():
    act = [float(i) for i in range(state_size(make(loop="maxwell_slip")))]
    s, z = split_states(act)
    assert joined_states(s, z) == [*z, *(getattr(s, name) for name in STATE_NAMES)] == act
    named = np.array(act)[-len(STATE_NAMES) :].view(STATES)[0]
    for name in STATE_NAMES:
        assert named[name] == getattr(s, name)
    assert s.air == act[-1]
    s.air = 7.0
    z[0] = 8.0
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
        with refused("chamber.temperature = 3", error=ParameterError):
            with_row(muscle, row)


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
