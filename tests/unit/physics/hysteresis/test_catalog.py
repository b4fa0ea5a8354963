"""The contract between operators and engine, over the whole catalog."""

from __future__ import annotations

import dataclasses
import math
import random
import warnings
from types import FunctionType

import numpy as np
import pytest

from pamsim.core.errors import ParameterError
from pamsim.core.parameters import specs
from pamsim.physics.hysteresis.bouc_wen import BoucWen, bouc_wen_rate, bouc_wen_rates
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.group import COMMON_FIELDS, Hysteresis
from tests.unit.physics.hysteresis.operator_runs import GROUPS, TIMESTEP, label, path, run

ONE_OF_EACH = list({group.law: group for group in GROUPS}.values())
DISCRETE = [group for group in GROUPS if group.law not in ("bouc_wen", "fractional_maxwell")]
"""The memory of the others is a solution in time and not an update by the input."""
WHOLE = {"elements", "levels", "turning_points", "branches"}


def random_turns(count: int, seed: int = 3) -> list[float]:
    return [random.Random(seed + k).uniform(-0.2, 0.2) for k in range(count)]


def compiled(function):
    """A law compiled with every function that it calls, as the engine compiles it."""
    import numba

    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        if isinstance(names.get(name), FunctionType):
            names[name] = compiled(names[name])
    copy = FunctionType(function.__code__, names, function.__name__)
    return numba.njit(copy, error_model="numpy")


def test_every_operator_is_tried_here():
    assert {group.law for group in GROUPS} == set(OPERATORS)


@pytest.mark.parametrize("name", OPERATORS)
def test_entry_is_consistent(name):
    operator = OPERATORS[name]
    assert operator.name == operator.group.law == name
    assert operator.group.group == "hysteresis"
    first = [field for field, _ in specs(operator.group)][:COMMON_FIELDS]
    assert first == ["force", "force_per_pressure", "force_share", "chord"]
    assert operator.output.__name__ == f"{name}_output"
    assert operator.rates.__name__ == f"{name}_rates"
    assert min(map(len, (operator.title, operator.equation, operator.source))) > 5


@pytest.mark.parametrize("group", GROUPS, ids=label)
def test_own_fields_follow_the_common_ones(group):
    values = dataclasses.astuple(group)
    assert values[:COMMON_FIELDS] == (0.0,) * COMMON_FIELDS
    assert group.own() == values[COMMON_FIELDS:]


@pytest.mark.parametrize("group", GROUPS, ids=label)
def test_virgin_output_is_finite_and_about_one_at_most(group):
    par, act = group.own(), [0.0] * group.state_count
    for x in (-0.2, -0.05, 0.0, 0.05, 0.2):
        w = OPERATORS[group.law].output(par, 0, act, x)
        assert abs(w) <= 2.5


@pytest.mark.parametrize("group", GROUPS, ids=label)
def test_output_and_rates_read_behind_first_and_write_nothing_else(group):
    operator, count = OPERATORS[group.law], group.state_count
    plain, shifted = group.own(), (math.nan,) * 5 + group.own() + (math.nan,)
    _, act = run(group, path(random_turns(5), 60))
    # The engine's states hold more than the operator's: the air comes last.
    more = [*act, 1e5]
    assert operator.output(shifted, 5, more, 0.03) == operator.output(plain, 0, act, 0.03)
    assert more == [*act, 1e5]
    rates, wide = [0.0] * count, [7.0] * (count + 1)
    operator.rates(plain, 0, act, rates, 0.03, 0.2, TIMESTEP)
    operator.rates(shifted, 5, more, wide, 0.03, 0.2, TIMESTEP)
    assert wide == [*rates, 7.0]


@pytest.mark.parametrize("group", DISCRETE, ids=label)
@pytest.mark.parametrize("timestep", [1e-4, 2e-3])
def test_one_euler_step_leaves_a_discrete_memory_up_to_date(group, timestep):
    """A second step at the same input then has nothing left to do, and the output is the same."""
    operator, par = OPERATORS[group.law], group.own()
    rates = [0.0] * group.state_count
    _, act = run(group, path(random_turns(9), 5), timestep=timestep)
    for x in random_turns(20, seed=50):
        before = operator.output(par, 0, act, x)
        operator.rates(par, 0, act, rates, x, 0.0, timestep)
        act = [z + timestep * rate for z, rate in zip(act, rates, strict=True)]
        assert operator.output(par, 0, act, x) == pytest.approx(before, abs=1e-12)
        operator.rates(par, 0, act, rates, x, 0.0, timestep)
        assert rates == pytest.approx([0.0] * len(rates), abs=1e-12 / timestep)


@pytest.mark.parametrize("group", GROUPS, ids=label)
def test_nan_input_gives_nan_and_spoils_the_memory(group):
    operator, par = OPERATORS[group.law], group.own()
    _, act = run(group, path(random_turns(5), 60))
    rates = [0.0] * len(act)
    assert math.isnan(operator.output(par, 0, act, math.nan))
    operator.rates(par, 0, act, rates, math.nan, math.nan, TIMESTEP)
    assert all(map(math.isnan, rates))


@pytest.mark.parametrize("group", GROUPS, ids=label)
def test_nan_memory_gives_nan(group):
    operator, par = OPERATORS[group.law], group.own()
    act = [math.nan] * group.state_count
    # Full saturation wipes a Preisach memory out, so the input stays inside.
    assert math.isnan(operator.output(par, 0, act, 0.01))
    rates = [0.0] * len(act)
    operator.rates(par, 0, act, rates, 0.01, 0.1, TIMESTEP)
    after = [z + TIMESTEP * rate for z, rate in zip(act, rates, strict=True)]
    assert math.isnan(operator.output(par, 0, after, 0.01))


@pytest.mark.parametrize("group", ONE_OF_EACH, ids=label)
def test_compiled_gives_the_same_numbers(group):
    operator, par = OPERATORS[group.law], np.array(group.own())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numba's own deprecations are not ours
        output, rates = compiled(operator.output), compiled(operator.rates)
    xs = path(random_turns(12), 60)
    act = np.zeros(group.state_count)
    change = np.zeros_like(act)
    found = []
    for x, after in zip([0.0, *xs], [*xs, xs[-1]], strict=True):
        found.append(output(par, 0, act, x))
        rates(par, 0, act, change, x, (after - x) / TIMESTEP, TIMESTEP)
        act = act + TIMESTEP * change
    plain, memory = run(group, xs)
    assert found[1:] == pytest.approx(plain, abs=1e-12)
    assert act == pytest.approx(np.array(memory), abs=1e-12)
    assert math.isnan(output(par, 0, act, math.nan))


@pytest.mark.parametrize("group", ONE_OF_EACH[1:], ids=label)
def test_counts_must_be_whole(group):
    (name,) = WHOLE & {field for field, _ in specs(type(group))}
    with pytest.raises(ParameterError, match=rf"{name} = 4\.5 is not a whole number"):
        dataclasses.replace(group, **{name: 4.5})


def test_bouc_wen_hands_its_fields_on_by_their_meaning():
    group = BoucWen(yield_contraction=0.02, sigma=1.5, sharpness=3.0)
    rates = [0.0]
    for z, rate in ((0.4, 0.3), (0.4, -0.3)):
        bouc_wen_rates(group.own(), 0, [z], rates, 0.1, rate, TIMESTEP)
        named = {"yield_travel": 0.02, "sigma": 1.5, "sharpness": 3.0}
        assert rates == [bouc_wen_rate(z, rate, **named)]


def test_all_factors_are_off_unless_set():
    assert all(
        (group.force, group.force_per_pressure, group.force_share) == (0.0, 0.0, 0.0)
        for group in GROUPS
    )
    assert all(issubclass(operator.group, Hysteresis) for operator in OPERATORS.values())
