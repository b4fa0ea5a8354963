"""The contract between operators and engine, over the whole catalog."""

from __future__ import annotations

import dataclasses
import math
import random
import warnings
from types import SimpleNamespace

import numba
import numpy as np
import pytest

from pamsim.core.errors import ParameterError
from pamsim.core.parameters import specs
from pamsim.engine.jit import hand_to_numba, reached_functions
from pamsim.physics.hysteresis.bouc_wen import BoucWen, bouc_wen_rate, bouc_wen_rates
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.group import Hysteresis
from tests.unit.physics.hysteresis.operator_runs import GROUPS, TIMESTEP, label, path, run

COMMON_FIELDS = len(specs(Hysteresis))  # in front of an operator's own

ONE_OF_EACH = list({group.law: group for group in GROUPS}.values())
DISCRETE = [group for group in GROUPS if group.law not in ("bouc_wen", "fractional_maxwell")]
"""The memory of the others is a solution in time and not an update by the input."""
WHOLE = {"elements", "levels", "turning_points", "branches"}


def random_turns(count: int, seed: int = 3) -> list[float]:
    return [random.Random(seed + k).uniform(-0.2, 0.2) for k in range(count)]


def own_fields(group: Hysteresis) -> SimpleNamespace:
    """An operator's fields without those that all of them have, which belong to the kernel."""
    names = [name for name, _ in specs(type(group))][COMMON_FIELDS:]
    return SimpleNamespace(**{name: getattr(group, name) for name in names})


def record_of(group: Hysteresis) -> np.record:
    """An operator's fields in the form in which compiled code reads them."""
    names = [name for name, _ in specs(type(group))]
    return np.array([dataclasses.astuple(group)], dtype=[(name, float) for name in names])[0]


def compiled(function):
    """A law compiled with every function that it calls, as the engine compiles it."""
    *callees, _ = reached_functions(function)
    hand_to_numba(callees)
    return numba.njit(function, error_model="numpy")


def test_every_operator_is_tried_here():
    assert {group.law for group in GROUPS} == set(OPERATORS)


@pytest.mark.parametrize("name", OPERATORS)
def test_entry_is_consistent(name):
    operator = OPERATORS[name]
    assert operator.name == operator.group.law == name
    assert operator.group.group == "hysteresis"
    first = [field for field, _ in specs(operator.group)][:COMMON_FIELDS]
    assert first == ["force", "force_per_pressure", "force_share", "chord"]
    assert min(map(len, (operator.title, operator.equation, operator.source))) > 5


@pytest.mark.parametrize("group", GROUPS, ids=label)
def test_virgin_output_is_finite_and_about_one_at_most(group):
    act = [0.0] * group.state_count
    for x in (-0.2, -0.05, 0.0, 0.05, 0.2):
        w = OPERATORS[group.law].output(group, act, x)
        assert abs(w) <= 2.5


@pytest.mark.parametrize("group", GROUPS, ids=label)
def test_an_operator_reads_its_own_fields_by_name_and_its_own_states_alone(group):
    operator, own = OPERATORS[group.law], own_fields(group)
    _, act = run(group, path(random_turns(5), 60))
    # A muscle's memory holds more than the operator's: the blocks of the one in parallel come last.
    more = [*act, math.nan]
    for function in (operator.output, operator.energy):
        assert function(own, more, 0.03) == function(group, act, 0.03)
    assert more[:-1] == act
    rates, wide = [0.0] * len(act), [7.0] * (len(act) + 1)
    operator.rates(group, act, rates, 0.03, 0.2, TIMESTEP)
    operator.rates(own, more, wide, 0.03, 0.2, TIMESTEP)
    assert wide == [*rates, 7.0]
    assert more[:-1] == act


@pytest.mark.parametrize("group", DISCRETE, ids=label)
@pytest.mark.parametrize("timestep", [1e-4, 2e-3])
def test_one_euler_step_leaves_a_discrete_memory_up_to_date(group, timestep):
    """A second step at the same input then has nothing left to do, and the output is the same."""
    operator = OPERATORS[group.law]
    rates = [0.0] * group.state_count
    _, act = run(group, path(random_turns(9), 5), timestep=timestep)
    for x in random_turns(20, seed=50):
        before = operator.output(group, act, x)
        operator.rates(group, act, rates, x, 0.0, timestep)
        act = [z + timestep * rate for z, rate in zip(act, rates, strict=True)]
        assert operator.output(group, act, x) == pytest.approx(before, abs=1e-12)
        operator.rates(group, act, rates, x, 0.0, timestep)
        assert rates == pytest.approx([0.0] * len(rates), abs=1e-12 / timestep)


@pytest.mark.parametrize("group", GROUPS, ids=label)
def test_nan_input_gives_nan_and_spoils_the_memory(group):
    operator = OPERATORS[group.law]
    _, act = run(group, path(random_turns(5), 60))
    rates = [0.0] * len(act)
    assert math.isnan(operator.output(group, act, math.nan))
    operator.rates(group, act, rates, math.nan, math.nan, TIMESTEP)
    assert all(map(math.isnan, rates))


@pytest.mark.parametrize("group", GROUPS, ids=label)
def test_nan_memory_gives_nan(group):
    operator = OPERATORS[group.law]
    act = [math.nan] * group.state_count
    # Full saturation wipes a Preisach memory out, so the input stays inside.
    assert math.isnan(operator.output(group, act, 0.01))
    rates = [0.0] * len(act)
    operator.rates(group, act, rates, 0.01, 0.1, TIMESTEP)
    after = [z + TIMESTEP * rate for z, rate in zip(act, rates, strict=True)]
    assert math.isnan(operator.output(group, after, 0.01))


@pytest.mark.parametrize("group", ONE_OF_EACH, ids=label)
def test_compiled_gives_the_same_numbers(group):
    operator, record = OPERATORS[group.law], record_of(group)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numba's own deprecations are not ours
        output, energy, rates = map(compiled, operator.functions)
    xs = path(random_turns(12), 60)
    act = np.zeros(group.state_count)
    change = np.zeros_like(act)
    found = []
    for x, after in zip([0.0, *xs], [*xs, xs[-1]], strict=True):
        found.append(output(record, act, x))
        rates(record, act, change, x, (after - x) / TIMESTEP, TIMESTEP)
        act = act + TIMESTEP * change
    plain, memory = run(group, xs)
    assert found[1:] == pytest.approx(plain, abs=1e-12)
    assert act == pytest.approx(np.array(memory), abs=1e-12)
    held = operator.energy(group, memory, 0.03)
    assert energy(record, act, 0.03) == pytest.approx(held, rel=1e-12)
    assert math.isnan(output(record, act, math.nan))


@pytest.mark.parametrize("group", ONE_OF_EACH[1:], ids=label)
def test_counts_must_be_whole(group):
    (name,) = WHOLE & {field for field, _ in specs(type(group))}
    with pytest.raises(ParameterError, match=rf"{name} = 4\.5 is not a whole number"):
        dataclasses.replace(group, **{name: 4.5})


def test_bouc_wen_hands_its_fields_on_by_their_meaning():
    group = BoucWen(yield_contraction=0.02, sigma=1.5, sharpness=3.0)
    rates = [0.0]
    for z, rate in ((0.4, 0.3), (0.4, -0.3)):
        bouc_wen_rates(group, [z], rates, 0.1, rate, TIMESTEP)
        named = {"yield_travel": 0.02, "sigma": 1.5, "sharpness": 3.0}
        assert rates == [bouc_wen_rate(z, rate, **named)]


def test_all_factors_are_off_unless_set():
    assert all(
        dataclasses.astuple(group)[:COMMON_FIELDS] == (0.0,) * COMMON_FIELDS for group in GROUPS
    )
    assert all(issubclass(operator.group, Hysteresis) for operator in OPERATORS.values())
