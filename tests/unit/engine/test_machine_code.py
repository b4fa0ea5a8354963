"""Machine code means what Python means, to the last bit."""

from __future__ import annotations

import math
import struct
from collections.abc import MutableSequence, Sequence

import numba
import numpy as np
import pytest

from pamsim.engine.laws import Laws
from tests.unit.strict_laws import between, fibonacci, weighted

Row = Sequence[float]
MutableRow = MutableSequence[float]
OFF, LAW = 2, 3


def whole_numbers(a: float, b: float) -> float:
    total = 0
    for k in range(4):
        total += k
    for k in range(2, 5):
        if k == 3:
            continue
        total -= k
    return total / 4 + 7 % 3 + math.floor(a) + int(b) + abs(-3)


def remainder(a: float, b: float) -> float:
    return a % b + 1.0 % a


def early(a: float, b: float) -> float:
    k = 0
    while k < 10:
        if a + k > b:
            return float(k)
        if k == 7:
            break
        k += 1
    return math.nan


def both(a: float, b: float) -> tuple[float, int]:
    return max(a, b, 0.5), math.floor(a)


def parts(a: float, b: float) -> float:
    larger, floor = both(a, b)
    return larger + floor + both(b, a)[1]


def library(a: float, b: float) -> float:
    size = abs(a) + 0.1
    total = math.expm1(a) + math.exp(b) - math.sin(a) * math.cos(b) + math.tan(a)
    total += math.log(size) + math.sqrt(size) + math.atan2(a, b) + math.tanh(b)
    return total + size ** (1.0 / 1.2 - 1.0) + size**2.0 + math.copysign(size, b) + math.atan(a)


def asked_in_turn(a: float, b: float) -> float:
    if not (a > 0.0 and math.sqrt(max(a, 0.0)) > 0.5) or (b < 0.0 and a < b):
        return min(a, b)
    return -a


def smallest(a: float, b: float) -> float:
    return min(a, math.nan) + max(0.0, -0.0 * b, 0.0)


FUNCTIONS = (
    whole_numbers,
    remainder,
    fibonacci,
    between,
    weighted,
    early,
    parts,
    library,
    asked_in_turn,
    smallest,
)


def bits(value: float) -> bytes:
    return b"nan" if math.isnan(value) else struct.pack("<d", value)


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda one: one.__name__)
def test_it_means_what_python_means(function):
    Laws((function,))
    compiled = numba.njit(lambda a, b: function(a, b))
    for a, b in np.random.default_rng(0).uniform(-3.0, 3.0, (200, 2)).tolist():
        assert bits(compiled(a, b)) == bits(function(a, b))


def inner(par: Row, at: int) -> float:
    if par[LAW] == 2.0:
        return par[at] * 10.0
    return par[at]


def composed(par: Row, act: Row, rates: MutableRow) -> float:
    total = inner(par, 0)
    if par[OFF] > 0.0:
        total += par[OFF] * act[len(act) - 1]
    for i in range(len(act)):
        rates[i] = total + act[i]
    rates[0] += 1.0
    return total


def test_a_copy_for_known_numbers_gives_the_same_as_the_other():
    Laws((composed,), {OFF: 0.0, LAW: 2.0})

    @numba.njit
    def compiled(par, act, rates):
        return composed(par, act, rates)

    act = np.array([3.0, 4.0])
    for off, law in ((0.0, 2.0), (0.0, 1.0), (0.5, 2.0), (-0.0, 2.0), (math.nan, 2.0)):
        par = np.array([1.5, 7.0, off, law])
        rates, expected = np.zeros(2), np.zeros(2)
        assert compiled(par, act, rates) == composed(par, act, expected)
        assert rates.tolist() == expected.tolist()


def test_rows_that_do_not_lie_in_one_piece_are_refused():
    Laws((composed,), {OFF: 0.0, LAW: 2.0})

    @numba.njit
    def compiled(par, act, rates):
        return composed(par, act, rates)

    with pytest.raises(numba.TypingError):
        compiled(np.zeros(8)[::2], np.zeros(2), np.zeros(2))


def test_the_key_changes_with_what_is_known():
    assert Laws((composed,)).key != Laws((composed,), {OFF: 0.0}).key
