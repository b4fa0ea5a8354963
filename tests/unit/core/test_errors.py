"""Errors and their suggestions."""

from __future__ import annotations

import inspect

import pytest

from pamsim.core import errors
from pamsim.core.errors import InputError, PamsimError, ParameterError, SimulationError, nearest


@pytest.mark.parametrize(
    ("name", "suggested"),
    [("kpa", "kPa"), ("bat", "bar"), ("presure", "pressure"), ("presssure", "pressure")],
)
def test_nearest_suggests_the_closest_name_and_lists_all(name, suggested):
    known = ["kPa", "bar", "pressure"]
    text = nearest(name, known)
    assert text.startswith(f"did you mean {suggested!r}?")
    assert all(other in text for other in known)


def test_nearest_does_not_suggest_what_is_not_near():
    assert nearest("zzzz", ["kPa", "bar"]) == "known: bar, kPa"
    assert nearest("anything", []) == "known: none"
    words = ["a.gain", "b_gain", "again"]
    assert (
        nearest("Gain", words) == "did you mean 'a.gain' or 'b_gain'? known: a.gain, again, b_gain"
    )
    many = [f"x{i}" for i in range(30)]
    assert nearest("x3", many) == "did you mean 'x3'?"
    assert nearest("zzzz", many).startswith("known: x0, x1, ")


def test_every_error_has_one_root_and_bad_input_is_told_from_the_rest():
    found = [
        c for _, c in inspect.getmembers(errors, inspect.isclass) if c.__module__ == errors.__name__
    ]
    assert len(found) >= 5
    assert all(issubclass(c, PamsimError) for c in found)
    assert issubclass(ParameterError, InputError)
    assert not issubclass(SimulationError, InputError)


def test_a_message_is_one_line_that_can_be_printed():
    shown = str(InputError("a\nb \x1b[31m\x00 " + "c" * 5000 + " d" * 5000))
    assert shown.startswith("a b ")
    assert shown.isprintable()
    assert len(shown) <= 1000
    assert str(InputError("x.toml: a = 3 is not known")) == "x.toml: a = 3 is not known"
