"""An effect's link, and how the kinds of parameter count."""

from __future__ import annotations

import dataclasses

import pytest

from pamsim.core.errors import InputError
from pamsim.effects.catalog import FORMS
from pamsim.effects.effect import Effect, EffectParameter, change, factor, shape, size


def own_effect(parameter, **fields):
    """An effect as a user's file states it."""
    return Effect(
        name="own", family="own", missing="a part", look_alikes=(), separating="", **fields,
        parameters=(EffectParameter(name=parameter, typical=1.0, low=0.0, high=2.0),),
    )  # fmt: skip


@pytest.mark.parametrize(
    "one", [e for forms in FORMS.values() for e in forms], ids=lambda e: e.label
)
def test_without_a_link_the_first_parameter_gives_it(one):
    """Valves, their supply and the line of their command share a group, whose link is the air."""
    given = own_effect(one.parameters[0].name).link
    assert given == ("air" if one.link in ("supply", "command") else one.link)


def test_a_link_that_is_not_there_is_refused_and_one_that_is_kept():
    assert own_effect("valve.delay", link="command").link == "command"
    assert own_effect("force.seam").link == "muscle"
    with pytest.raises(InputError, match=r"\Aown: no link 'sensors'; did you mean 'sensor'"):
        own_effect("sensor.angle_bias", link="sensors")
    with pytest.raises(InputError, match="at least one parameter"):
        dataclasses.replace(own_effect("valve.delay"), parameters=())


@pytest.mark.parametrize(
    ("kind", "none", "one", "two", "bounds"),
    [
        (size, 0.0, 0.5, 1.0, (0.2, 2.0)),
        (change, 3.0, 3.5, 4.0, (3.2, 5.0)),
        (factor, 3.0, 1.5, 0.0, (0.6, 6.0)),
        (shape, 0.5, 0.5, 0.5, (0.2, 2.0)),
    ],
)
def test_a_kind_of_parameter_says_how_its_numbers_count_beside_the_rig_s(
    kind, none, one, two, bounds
):
    parameter = kind("x", 0.5, 0.2, 2.0)
    values = [parameter.at(times, 3.0) for times in (0.0, 1.0, 2.0)]
    assert values == pytest.approx([none, one, two])
    assert parameter.bounds(3.0) == pytest.approx(bounds)
