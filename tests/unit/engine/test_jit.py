"""Functions that are compiled: all are found, and their key changes with whatever they take."""

from __future__ import annotations

import importlib.util
import types

import numpy as np
import pytest

from pamsim.engine import compiled
from pamsim.engine.jit import fingerprint, reached_functions
from pamsim.engine.muscle_step import step_end
from pamsim.physics import air
from pamsim.physics.chosen_law import law_functions
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.exponential import SixParameter
from pamsim.physics.kernel import state_rates, tension

WEIGHTS = ((0.5, 2), (0.25, 3))


def weighted(a: float, b: float) -> float:
    return a + WEIGHTS[0][0] * b


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
