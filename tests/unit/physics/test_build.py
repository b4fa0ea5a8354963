"""A muscle from sections of sourced numbers, and what happens when they are wrong."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from pamsim.core.errors import InputError, ParameterError
from pamsim.core.parameters import ParameterGroup, Sourced, specs
from pamsim.physics.chain import Chain
from pamsim.physics.friction import Friction
from pamsim.physics.muscle import Muscle, build_muscle
from pamsim.physics.passive import Creep, PassiveSpring
from pamsim.physics.tension import EndShape, Threshold
from pamsim.physics.valves import COMMANDS
from tests.unit.core.refusals import refused
from tests.unit.physics.muscles import KINDS, make

WHERE = "rig/params.toml: muscle"


def number(value: float, unit: str, key: str = "key") -> Sourced:
    return Sourced(value=value, unit=unit, source="assumed", where=f"{WHERE}.{key}")


def sections(muscle: Muscle) -> dict[str, dict[str, Any]]:
    """A muscle's groups as a rig file would state them."""
    found: dict[str, dict[str, Any]] = {}
    for field in dataclasses.fields(muscle):
        group = getattr(muscle, field.name)
        if isinstance(group, ParameterGroup):
            key = group.group
            found[key] = {
                name: number(getattr(group, name), spec.unit, f"{key}.{name}")
                for name, spec in specs(type(group))
            }
            if group.law:
                found[key]["law"] = group.law
    return found


def changed(group: str, **entries: Any) -> dict[str, dict[str, Any]]:
    """Sections with some entries of one group replaced, or left out where None."""
    made = sections(make(loop="bouc_wen"))
    merged = made[group] | entries
    made[group] = {key: entry for key, entry in merged.items() if entry is not None}
    return made


def test_muscle_is_built_as_it_was_stated():
    for i, kind in enumerate(KINDS):
        command = COMMANDS[i % len(COMMANDS)]
        muscle = make(*kind, command=command)
        built = build_muscle(sections(muscle), where=WHERE, command=command)
        assert dataclasses.replace(built, hysteresis=muscle.hysteresis) == muscle, kind
        if muscle.hysteresis is not None:
            assert built.hysteresis == muscle.hysteresis


def test_units_are_converted():
    braid = {
        "nominal_length": number(250.0, "mm"),
        "diameter": number(2.0, "cm"),
        "fibre_angle": number(28.6, "deg"),
    }
    built = build_muscle(changed("braid", **braid), where=WHERE).braid
    found = built.nominal_length, built.diameter, built.fibre_angle
    assert found == pytest.approx((0.25, 0.02, 0.499164), rel=1e-6)


def test_groups_that_may_be_left_out_take_their_neutral_values():
    neutral = {
        "passive": PassiveSpring(),
        "threshold": Threshold(),
        "end_shape": EndShape(),
        "creep": Creep(),
        "chain": Chain(),
        "friction": Friction(),
    }
    stated = sections(make(loop="bouc_wen"))
    for group in (*neutral, "hysteresis"):
        del stated[group]
    del stated["braid"]["extensibility"]
    built = build_muscle(stated, where=WHERE)
    assert {name: getattr(built, name) for name in neutral} == neutral
    assert built.braid.extensibility == 0.0
    loop = built.hysteresis
    assert (loop.force, loop.force_per_pressure, loop.force_share) == (0, 0, 0)
    for group in ("mounting", "braid", "force", "chamber", "valve"):  # which every muscle needs
        stated = sections(make())
        del stated[group]
        with refused(WHERE, repr(group)):
            build_muscle(stated, where=WHERE)


def kelvin(value: float, unit: str) -> dict[str, Sourced]:
    return {"temperature": number(value, unit, "chamber.temperature")}


BAD_ENTRIES = [
    ("chamber", {"dead_volum": number(1.0, "cm^3")}, ("dead_volum", "mean 'dead_volume'")),
    ("chamber", {"temperature": None}, ("chamber needs temperature",)),
    ("chamber", kelvin(20.0, "kPa"), ("chamber.temperature", "'kPa'")),
    ("chamber", kelvin(20.0, "Kelvins"), ("chamber.temperature", "'Kelvins'")),
    ("chamber", {"temperature": "warm"}, ("chamber", "temperature")),
    ("chamber", kelvin(20.0, "K"), ("chamber.temperature = 20", "[200, 400] K")),
    ("threshold", {"pressure": "30 kPa"}, ("threshold.pressure",)),
    ("force", {"law": "six_paramter"}, ("force.law", "'six_parameter'")),
    ("force", {"a": number(1.0, "N/bar")}, ("force.a",)),  # which is another law's
    ("hysteresis", {"law": None}, ("hysteresis.law", "bouc_wen")),
]


def test_bad_entry_is_refused_in_one_line():
    for group, entries, words in BAD_ENTRIES:
        out_of_range = "[200, 400] K" in words
        where = () if out_of_range else (WHERE,)
        with refused(*where, *words, error=ParameterError if out_of_range else InputError):
            build_muscle(changed(group, **entries), where=WHERE)
    with refused(WHERE, "'chambre'", "did you mean 'chamber'"):
        build_muscle(sections(make()) | {"chambre": {}}, where=WHERE)
    with refused("'presure_set'", "did you mean 'pressure_set'"):
        build_muscle(sections(make()), where=WHERE, command="presure_set")
