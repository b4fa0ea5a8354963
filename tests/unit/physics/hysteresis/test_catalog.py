"""The contract between operators and engine, over the whole catalog."""

from __future__ import annotations

import dataclasses
import math
import random
from types import SimpleNamespace

import pytest

from pamsim.core.errors import ParameterError
from pamsim.core.parameters import specs
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.group import Hysteresis
from tests.unit.physics.hysteresis.operator_runs import GROUPS, TIMESTEP, label, path, run

WHOLE = {"elements", "levels", "turning_points", "branches"}


def random_turns(count: int, seed: int = 3) -> list[float]:
    return [random.Random(seed + k).uniform(-0.2, 0.2) for k in range(count)]


def own_fields(group: Hysteresis) -> SimpleNamespace:
    """An operator's fields without those that all of them have, which belong to the kernel."""
    names = [name for name, _ in specs(type(group))][len(specs(Hysteresis)) :]
    return SimpleNamespace(**{name: getattr(group, name) for name in names})


def test_every_operator_is_tried_here_with_counts_that_must_be_whole():
    assert {group.law for group in GROUPS} == set(OPERATORS)
    for group in GROUPS[1:]:
        (name,) = WHOLE & {field for field, _ in specs(type(group))}
        with pytest.raises(ParameterError, match=rf"{name} = 4\.5 is not a whole number"):
            dataclasses.replace(group, **{name: 4.5})


def test_an_operator_reads_its_own_fields_by_name_and_its_own_states_alone():
    for group in GROUPS:
        operator, own = OPERATORS[group.law], own_fields(group)
        _, act = run(group, path(random_turns(5), 60))
        # A muscle's memory holds more than the operator's: the blocks of the one in parallel.
        more = [*act, math.nan]
        for function in (operator.output, operator.energy):
            assert function(own, more, 0.03) == function(group, act, 0.03), label(group)
        rates, wide = [0.0] * len(act), [7.0] * (len(act) + 1)
        operator.rates(group, act, rates, 0.03, 0.2, TIMESTEP)
        operator.rates(own, more, wide, 0.03, 0.2, TIMESTEP)
        assert wide == [*rates, 7.0], label(group)
        assert more[:-1] == act


def test_nan_is_passed_on_and_spoils_the_memory():
    for group in GROUPS:
        operator = OPERATORS[group.law]
        _, act = run(group, path(random_turns(5), 60))
        rates = [0.0] * len(act)
        assert math.isnan(operator.output(group, act, math.nan)), label(group)
        operator.rates(group, act, rates, math.nan, math.nan, TIMESTEP)
        assert all(map(math.isnan, rates)), label(group)
        spoilt = [math.nan] * group.state_count
        # Full saturation wipes a Preisach memory out, so the input stays inside.
        assert math.isnan(operator.output(group, spoilt, 0.01)), label(group)
        operator.rates(group, spoilt, rates, 0.01, 0.1, TIMESTEP)
        after = [z + TIMESTEP * rate for z, rate in zip(spoilt, rates, strict=True)]
        assert math.isnan(operator.output(group, after, 0.01)), label(group)
