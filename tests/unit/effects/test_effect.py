"""An effect's link, how its kinds of parameter count, and its place in the tree of names."""

import collections
import dataclasses
import itertools

import pytest

from pamsim.core.errors import InputError
from pamsim.effects.catalog import (
    EFFECTS,
    FAMILIES,
    FORMS,
    PARTS,
    ROW_EFFECTS,
    TRIAL_EFFECTS,
    effect,
)
from pamsim.effects.effect import (
    LINKS,
    Effect,
    EffectParameter,
    change,
    factor,
    shape,
    size,
)

ALL = [form for forms in FORMS.values() for form in forms]
RARE = [one.label for one in EFFECTS.values() if one.rare]


def own_effect(parameter, **fields):
    """An effect as a user's file states it."""
    return Effect(
        name="own", family="own", missing="a part", look_alikes=(), separating="", **fields,
        parameters=(EffectParameter(name=parameter, typical=1.0, low=0.0, high=2.0),),
    )  # fmt: skip


def test_without_a_link_the_first_parameter_gives_it():
    """Valves, their supply and the line of their command share a group, whose link is the air."""
    for one in ALL:
        given = own_effect(one.parameters[0].name).link
        assert given == ("air" if one.link in ("supply", "command") else one.link), one.label
    assert own_effect("valve.delay", link="command").link == "command"
    assert own_effect("force.seam").link == "muscle"
    with pytest.raises(InputError, match=r"\Aown: no link 'sensors'; did you mean 'sensor'"):
        own_effect("sensor.angle_bias", link="sensors")
    with pytest.raises(InputError, match="at least one parameter"):
        dataclasses.replace(own_effect("valve.delay"), parameters=())


def test_a_range_that_is_scaled_is_so_in_all_of_its_numbers():
    """A slide's forces and speeds are other ones than a shaft's torques and rates."""
    named = EffectParameter(name="friction", typical=0.1, low=0.01, high=1.0, starts=(0.2, 0.5))
    found = named.scaled(4.0)
    assert (found.typical, found.low, found.high) == pytest.approx((0.4, 0.04, 4.0))
    assert found.starts == pytest.approx((0.8, 2.0))


def test_a_kind_of_parameter_says_how_its_numbers_count_beside_the_rig_s():
    for kind, numbers, bounds in (
        (size, [0.0, 0.5, 1.0], (0.2, 2.0)),
        (change, [3.0, 3.5, 4.0], (3.2, 5.0)),
        (factor, [3.0, 1.5, 0.0], (0.6, 6.0)),
        (shape, [0.5, 0.5, 0.5], (0.2, 2.0)),
    ):
        parameter = kind("x", 0.5, 0.2, 2.0)
        assert [parameter.at(times, 3.0) for times in (0.0, 1.0, 2.0)] == pytest.approx(numbers)
        assert parameter.bounds(3.0) == pytest.approx(bounds)


def test_tables_at_rest_are_searched_for_all_but_rare_effects_and_trials_for_all_but_theirs():
    at_rest = EFFECTS.keys() - set(TRIAL_EFFECTS)
    assert at_rest == {one.name for one in PARTS["muscle_at_rest"]}
    assert set(ROW_EFFECTS) == EFFECTS.keys() - {effect(name).name for name in RARE}


def test_forms_of_one_physics_share_its_name_and_its_family():
    for name, forms in FORMS.items():
        assert forms[0] is effect(name) is EFFECTS[name]
        assert len({form.form for form in forms}) == len(forms)
        assert {(form.name, form.family) for form in forms} == {(name, forms[0].family)}
        for form in forms:
            assert len(forms) == 1 or effect(f"{name}:{form.form}") is form
    with pytest.raises(InputError, match=r"\A[^\n]*coulomb_friction has no form[^\n]*mean 'dahl'"):
        effect("coulomb_friction:dhal")


def test_levels_are_a_tree_a_family_has_one_link_and_a_label_one_path():
    above = collections.defaultdict(set)
    for one in ALL:
        assert one.levels == (one.link, "", one.family, one.name, one.form)
        above["family", one.family].add(one.link)
        above["name", one.name].add(one.family)
        above[one.levels].add(one.label)
    assert all(len(ones) == 1 for ones in above.values())
    assert {one.link for one in ALL} == set(LINKS)
    assert {one.family for one in ALL} == set(FAMILIES)


def test_every_effect_states_what_it_is_and_where_a_search_begins():
    """The first probe is small, and none is passed by: each is some three to five times the last,
    or the last that the range holds."""
    for one in ALL:
        assert one.missing, one.label
        assert one.separating, one.label
        assert set(one.look_alikes) <= set(EFFECTS) - {one.name}, one.label
        size, *_ = one.parameters
        assert not size.shape, one.label
        for parameter in one.parameters:
            begins = [*parameter.starts, *([parameter.typical] if parameter.shape else [])]
            assert all(parameter.low <= begin <= parameter.high for begin in begins), one.label
            assert len(set(begins)) == len(begins), one.label
        if len(one.probes) == 2:  # slower and faster than the trials, no threshold
            continue
        assert one.probes[0] <= 0.3, one.label
        for last, probe in itertools.pairwise(one.probes):
            assert probe <= 5.0 * last, one.label
            assert probe >= 3.0 * last or 3.0 * last * size.typical > size.high, one.label
