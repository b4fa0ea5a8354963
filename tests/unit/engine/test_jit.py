"""Functions that are compiled: all are found, machine code means what Python means, to the bit."""

from __future__ import annotations

import importlib.util
import math
import struct
import types

import numba
import numpy as np
import pytest

from pamsim.engine import compiled
from pamsim.engine.jit import fingerprint, hand_to_numba, reached_functions
from pamsim.engine.muscle_step import step_end
from pamsim.physics import air
from pamsim.physics.chosen_law import law_functions
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.exponential import SixParameter
from pamsim.physics.kernel import state_rates, tension
from tests.unit.strict_laws import (
    between,
    early,
    fibonacci,
    parts,
    passing,
    remainder,
    weighted,
)


def whole_numbers(a: float, b: float) -> float:
    total = 0
    for k in range(4):
        total += k
    for k in range(2, 5):
        if k == 3:
            continue
        total -= k
    return total / 4 + 7 % 3 + math.floor(a) + int(b) + abs(-3) + 1.0 % a


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


def bits(value: float) -> bytes:
    return b"nan" if math.isnan(value) else struct.pack("<d", value)


def in_machine_code(function):
    hand_to_numba(reached_functions(function))
    return numba.njit(lambda a, b: function(a, b), error_model="numpy")


def test_it_means_what_python_means():
    pairs = np.random.default_rng(0).uniform(-3.0, 3.0, (200, 2)).tolist()
    for function in (
        whole_numbers, remainder, fibonacci, between, early, parts, passing, library, asked_in_turn,
        smallest,
    ):  # fmt: skip
        compiled = in_machine_code(function)
        for a, b in pairs:
            assert bits(compiled(a, b)) == bits(function(a, b)), function.__name__
    # Whole powers are products there, and the C library's powers here.
    compiled = in_machine_code(weighted)
    for a, b in pairs:
        assert compiled(a, b) == pytest.approx(weighted(a, b), rel=1e-13)


def test_every_law_of_the_kernel_is_reached():
    laws = law_functions(FORCE_LAWS.code(SixParameter)).values()
    names = {f.__name__ for f in reached_functions(state_rates, tension, *laws)}
    assert {
        "six_parameter_volume",
        "flow_function",
        "tube_force",
        "taut",
        "absolute_pressure",
    } <= names
    assert "pack" not in names


def with_globals(function, **names):
    """The same text with other numbers of its module."""
    changed = types.FunctionType(
        function.__code__, {**function.__globals__, **names}, function.__name__
    )
    changed.__wrapped__ = function  # source is read through this
    return changed


def test_the_key_changes_with_a_number_that_a_law_takes_from_its_module_or_closes_over():
    for function, names in (
        (air.mass_flow, {"REFERENCE_DENSITY": 1.2}),
        (weighted, {"WEIGHTS": ((0.5, 2), (0.25, 4))}),
    ):
        assert fingerprint([with_globals(function)]) == fingerprint([function])
        assert fingerprint([with_globals(function, **names)]) != fingerprint([function])

    def steep(slope):
        def law(x: float) -> float:
            return slope * x

        return law

    assert fingerprint([steep(1.0)]) == fingerprint([steep(1.0)])
    assert fingerprint([steep(1.0)]) != fingerprint([steep(2.0)])


@pytest.mark.parametrize("last", [1.0, 1.0 + 1e-12])
def test_the_key_changes_with_any_number_of_an_array_that_a_law_takes(last):
    def key(weights):
        return fingerprint([with_globals(weighted, WEIGHTS=weights)])

    zeros = np.zeros(2000)
    ends = np.append(zeros, [last])
    assert key(zeros) == key(zeros.copy())
    assert key(ends) != key(np.append(zeros, [0.0]))
    assert key((1.0, [ends])) != key((1.0, [np.append(zeros, [1.0 + 2e-12])]))


def test_the_key_of_a_law_typed_at_a_prompt_changes_with_its_numbers():
    def typed(text):
        space = {}
        exec(text, space)
        return space["law"]

    first, second = (typed(f"def law(x):\n    return {k} * x\n") for k in (1.0, 0.5))
    assert fingerprint([first]) != fingerprint([second])
    assert fingerprint([first]) == fingerprint([typed("def law(x):\n    return 1.0 * x\n")])


def test_the_key_changes_with_what_a_called_law_takes():
    def key():
        return fingerprint(reached_functions(called))

    def called(a: float, b: float) -> float:
        return strict(a, b)

    strict = weighted
    before = key()
    strict = with_globals(weighted, WEIGHTS=((0.5, 2), (0.25, 4)))
    assert key() != before


def test_the_key_changes_with_the_text_of_a_law(tmp_path):
    def load(text):
        path = tmp_path / f"law_{abs(hash(text))}.py"
        path.write_text(text)
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module.law

    same = [fingerprint([load("def law(x):\n    return x + 1.0\n")]) for _ in range(2)]
    assert same[0] == same[1]
    assert fingerprint([load("def law(x):\n    return x + 2.0\n")]) != same[0]


@pytest.mark.parametrize("layout", ["STATES", "record_dtype"])
def test_another_place_of_a_number_gives_another_key(monkeypatch, layout):
    """Machine code reads states and parameters by their places, which no source of it names."""
    before = compiled.hand_over(step_end)
    moved = np.dtype([("air", float), ("friction", float)])
    monkeypatch.setattr(compiled, layout, moved if layout == "STATES" else lambda: moved)
    assert compiled.hand_over(step_end) != before
    monkeypatch.undo()
    assert compiled.hand_over(step_end) == before
