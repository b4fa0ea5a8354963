"""A muscle from sections of sourced numbers, and what happens when they are wrong."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from pamsim.core.errors import ParameterError
from pamsim.core.parameters import ParameterGroup, Sourced, specs
from pamsim.physics.muscle import Muscle, build_muscle
from pamsim.physics.valves import COMMANDS
from tests.unit.core.refusals import cases, refused
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


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_muscle_is_built_as_it_was_stated(kind, command):
    muscle = make(*kind, command=command)
    built = build_muscle(sections(muscle), where=WHERE, command=command)
    assert dataclasses.replace(built, hysteresis=muscle.hysteresis) == muscle
    if muscle.hysteresis is not None:
        assert built.hysteresis == muscle.hysteresis


def test_units_are_converted():
    braid = {
        "nominal_length": number(250.0, "mm"),
        "diameter": number(2.0, "cm"),
        "fibre_angle": number(28.6, "deg"),
    }
    built = build_muscle(changed("braid", **braid), where=WHERE).braid
    assert built.nominal_length == pytest.approx(0.25)
    assert built.diameter == pytest.approx(0.02)
    assert built.fibre_angle == pytest.approx(0.49916, rel=1e-4)


def test_groups_that_may_be_left_out_take_their_neutral_values():
    stated = sections(make(loop="bouc_wen"))
    for group in ("passive", "threshold", "end_shape", "creep", "hysteresis", "chain", "friction"):
        del stated[group]
    del stated["braid"]["extensibility"]
    built = build_muscle(stated, where=WHERE)
    assert built.passive.stiffness == 0.0
    assert built.braid.extensibility == 0.0
    assert built.threshold.pressure == 0.0
    assert (built.chain.compliance, built.chain.backlash) == (0.0, 0.0)
    assert (built.end_shape.loss, built.creep.stiffness, built.friction.stribeck_force) == (0, 0, 0)
    loop = built.hysteresis
    assert loop is not None
    assert (loop.force, loop.force_per_pressure, loop.force_share) == (0, 0, 0)


@pytest.mark.parametrize("group", ["mounting", "braid", "force", "chamber", "valve"])
def test_groups_that_every_muscle_needs_are_asked_for(group):
    stated = sections(make())
    del stated[group]
    with refused(WHERE, repr(group)):
        build_muscle(stated, where=WHERE)


def test_unknown_group_suggests_the_nearest():
    with refused(WHERE, "'chambre'", "did you mean 'chamber'"):
        build_muscle(sections(make()) | {"chambre": {}}, where=WHERE)


BAD_ENTRIES = {
    "unknown field": (
        "chamber",
        {"dead_volum": number(1.0, "cm^3")},
        (WHERE, "chamber.dead_volum", "did you mean 'dead_volume'"),
    ),
    "missing field": ("chamber", {"temperature": None}, (WHERE, "chamber needs temperature")),
    "wrong quantity": (
        "chamber",
        {"temperature": number(20.0, "kPa", "chamber.temperature")},
        (f"{WHERE}.chamber.temperature", "'kPa'"),
    ),
    "unknown unit": (
        "chamber",
        {"temperature": number(20.0, "Kelvins", "chamber.temperature")},
        (f"{WHERE}.chamber.temperature", "'Kelvins'"),
    ),
    "unknown law": ("force", {"law": "six_paramter"}, (WHERE, "force.law", "'six_parameter'")),
    "no law": ("hysteresis", {"law": None}, (WHERE, "hysteresis.law", "bouc_wen")),
    "field of another law": ("force", {"a": number(1.0, "N/bar")}, (WHERE, "force.a")),
    "word for a number": ("chamber", {"temperature": "warm"}, (WHERE, "chamber", "temperature")),
    "word for a number that has a default": (
        "threshold",
        {"pressure": "30 kPa"},
        (WHERE, "threshold.pressure"),
    ),
}


@pytest.mark.parametrize(
    ("group", "entries", "words"),
    cases(BAD_ENTRIES),
)
def test_bad_entry_is_refused_in_one_line(group, entries, words):
    with refused(*words):
        build_muscle(changed(group, **entries), where=WHERE)


def test_number_out_of_range_is_refused_by_name():
    with refused("chamber.temperature = 20", "[200, 400] K", error=ParameterError):
        build_muscle(changed("chamber", temperature=number(20.0, "K")), where=WHERE)


def test_unknown_command_suggests_the_nearest():
    with refused("'presure_set'", "did you mean 'pressure_set'"):
        build_muscle(sections(make()), where=WHERE, command="presure_set")
