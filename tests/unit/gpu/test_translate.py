"""Where Python and Warp differ, the rewritten source means what Python means."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.gpu.port import Port, expm1, warp

WEIGHTS = ((0.5, 2), (0.25, 3))


def fibonacci(a: float, b: float) -> float:
    for _ in range(5):
        a, b = b, a + b
    return a - b


def between(a: float, b: float) -> float:
    return 1.0 if -1.0 < a <= b < math.inf else -1.0


def weighted(a: float, b: float) -> float:
    total, count = a, 0
    for weight, power in WEIGHTS:
        for sign in (1.0, -1.0):
            total += sign * weight * b**power * (1 + count)
            count += 1
    return total


def remainder(a: float, b: float) -> float:
    return a % b


def early(a: float, b: float) -> float:
    k = 0
    while k < 10:
        if a + k > b:
            return float(k)
        k += 1
    return math.nan


def both(a: float, b: float) -> tuple[float, int]:
    return max(a, b, 0.5), math.floor(a)


def parts(a: float, b: float) -> float:
    larger, floor = both(a, b)
    return larger + floor + both(b, a)[1]


def scaled(x: float, by: float = 3.0) -> float:
    return x * by


def passing(a: float, b: float) -> float:
    low = high = a
    passed = False
    for _ in range(20):
        if low > b:
            passed = True
            break
        low += 0.5
    return scaled(low, by=2.0) + high if passed else scaled(a)


def whole_numbers(a: float, b: float) -> float:
    total = 0
    for k in range(4):
        total += k
    return total / 4 + 7 % 3


def small_growth(a: float, b: float) -> float:
    return math.expm1(1e-9 * a) + expm1(a)


FUNCTIONS = (
    whole_numbers, remainder, fibonacci, between, weighted, early, parts, small_growth, passing
)  # fmt: skip


def test_it_means_what_python_means():
    pairs = np.random.default_rng(0).uniform(-3.0, 3.0, (40, 2))
    wp, laws = warp(), Port("float64", "pamsim.test_translate")
    one, two, three, four, five, six, seven, eight, nine = (laws.function(f) for f in FUNCTIONS)

    def evaluate(pairs, out):
        i = wp.tid()
        a = pairs[i, 0]
        b = pairs[i, 1]
        out[i, 0] = one(a, b)
        out[i, 1] = two(a, b)
        out[i, 2] = three(a, b)
        out[i, 3] = four(a, b)
        out[i, 4] = five(a, b)
        out[i, 5] = six(a, b)
        out[i, 6] = seven(a, b)
        out[i, 7] = eight(a, b)
        out[i, 8] = nine(a, b)

    evaluate.__annotations__ = dict.fromkeys(("pairs", "out"), wp.array2d(dtype=wp.float64))
    kernel = wp.kernel(evaluate, module=laws.module, enable_backward=False)
    out = wp.zeros((len(pairs), len(FUNCTIONS)), dtype=wp.float64, device="cpu")
    wp.launch(kernel, dim=len(pairs), inputs=[wp.array(pairs, device="cpu"), out], device="cpu")
    for i, function in enumerate(FUNCTIONS):
        expected = [function(a, b) for a, b in pairs.tolist()]
        found = out.numpy()[:, i]
        assert found == pytest.approx(expected, rel=1e-13, nan_ok=True), function.__name__
        assert len({f"{one:.6g}" for one in expected}) > 1 or function is whole_numbers


def a_list(x: float) -> float:
    return [x][0]


def a_word(x: str) -> float:
    return 1.0


def an_index(row: float, x: float) -> float:
    return WEIGHTS[x]


def a_gamma(x: float) -> float:
    return math.gamma(x)


def a_break(x: float) -> float:
    for weight in (1.0, 2.0):
        if weight > x:
            break
    return x


def test_what_has_no_counterpart_is_refused():
    for function, message in (
        (a_list, r"a_list: '\[x\]' has no counterpart"),
        (a_word, r"a_word\(x\): 'str' has no counterpart"),
        (an_index, "an_index: 'WEIGHTS' has no counterpart"),
        (a_gamma, "math.gamma has no counterpart"),
        (a_break, "a_break: 'break' cannot leave a loop over a tuple"),
    ):
        with pytest.raises(InputError, match=message):
            Port("float64", "pamsim.test_refused").function(function)
