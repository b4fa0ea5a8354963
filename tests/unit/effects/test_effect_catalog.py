"""Every effect is nothing at neutral, shows at its probes, and states what diagnoses need."""

from __future__ import annotations

import collections
import dataclasses
import itertools
import shutil

import numpy as np
import pytest

import pamsim
from pamsim.comparison.candidate import inside
from pamsim.comparison.effects_on_rig import at_size, candidate, candidates, rig_effect, rig_name
from pamsim.comparison.protocols import PROTOCOLS
from pamsim.core.errors import InputError
from pamsim.effects import muscle_at_rest
from pamsim.effects.catalog import EFFECTS, FORMS, ROW_EFFECTS, TRIAL_EFFECTS, effect
from pamsim.effects.effect import FAMILIES, LINKS
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.preflight import check_timestep
from pamsim.recordings.sensors import distorted

ALL = [form for forms in FORMS.values() for form in forms]
EVERY = [form.label for form in ALL]
OTHER_FORMS = [form.label for forms in FORMS.values() for form in forms[1:]]
RARE = [one.label for one in EFFECTS.values() if one.rare]
NOISE = {"angle": np.radians(0.05), "pressure": 400.0, "tension": 1.5}


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


@pytest.fixture(scope="module")
def trials():
    """Two seconds of inputs that move everything, one of them under load."""
    names = ("triangle", "bursts", "loaded_steps")
    return [
        dataclasses.replace(PROTOCOLS[name].experiment(3), duration=2.0, settle=0.5)
        for name in names
    ]


def runs(rig, trials):
    found = [pamsim.simulate(rig, trial).completed() for trial in trials]
    return found if rig.sensor is None else [distorted(run, rig.sensor) for run in found]


@pytest.fixture(scope="module")
def plain(rig, trials):
    return runs(rig, trials)


def test_tables_at_rest_are_searched_for_all_but_rare_effects_and_trials_for_all_but_theirs():
    at_rest = EFFECTS.keys() - set(TRIAL_EFFECTS)
    assert at_rest == {one.name for one in muscle_at_rest.EFFECTS}
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


def test_an_effect_at_one_muscle_has_it_among_its_levels(rig):
    leak = rig_effect(rig, "air_leak:laminar at muscle_2")
    assert leak.levels == ("air", "muscle_2", "leak", "air_leak", "laminar")


def test_every_effect_states_what_it_is():
    for one in ALL:
        assert one.missing, one.label
        assert one.separating, one.label
        assert set(one.look_alikes) <= set(EFFECTS) - {one.name}, one.label
        assert not one.parameters[0].shape, one.label


@pytest.mark.parametrize("name", EVERY)
def test_neutral_changes_not_one_bit(name, rig, trials, plain):
    """Its size at neutral, its shape parameters at their typical values."""
    neutral = rig.with_parameters(at_size(rig, effect(name), 0.0))
    for one, other in zip(runs(neutral, trials), plain, strict=True):
        for signal in ("angle", "pressure", "tension", "velocity"):
            assert np.array_equal(getattr(one, signal), getattr(other, signal)), signal


@pytest.fixture(scope="module")
def emptied():
    """Both muscles are let down to the atmosphere."""
    step = pamsim.pressure_step((1e5, 8e4), (0.0, 0.0), duration=3.0, sample_rate=100.0)
    return dataclasses.replace(step, settle=0.5)


@pytest.mark.parametrize("name", EVERY)
def test_every_effect_shows_and_more_shows_more(name, rig, trials, plain, emptied):
    if name == "least_set_point":  # below those of the trials
        trials, plain = [emptied], runs(rig, [emptied])
    moved = []
    for size in (0.1, 1.0):
        values = at_size(rig, effect(name), size)
        changes = [
            np.sqrt(np.mean((getattr(one, signal) - getattr(other, signal)) ** 2)) / noise
            for one, other in zip(runs(rig.with_parameters(values), trials), plain, strict=True)
            for signal, noise in NOISE.items()
        ]
        moved.append(max(changes))
    assert moved == sorted(moved)
    assert moved[1] > 0.5  # a typical size is a matter of half the noise at least
    assert moved[0] > 0.01


def test_a_search_may_reach_neutral_and_every_probe(rig):
    for known in ALL:
        name, one = known.label, candidate(rig, known)
        for parameter in one.parameters:
            neutral = one.neutral.get(parameter.name, parameter.start)
            assert parameter.low <= neutral <= parameter.high, name
            spec = rig_parameter(rig, parameter.name).spec
            assert spec.low <= parameter.low < parameter.high <= spec.high, name
            for probe in one.probes:
                assert parameter.low < probe.values[parameter.name] < parameter.high, name
        assert len({tuple(probe.values.values()) for probe in one.probes}) == len(one.probes), name
        assert len({probe.size for probe in one.probes}) == len(known.probes), name


def test_a_search_begins_at_different_places_inside_the_range():
    for one in ALL:
        for parameter in one.parameters:
            begins = [*parameter.starts, *([parameter.typical] if parameter.shape else [])]
            assert all(parameter.low <= begin <= parameter.high for begin in begins), one.label
            assert len(set(begins)) == len(begins), one.label


def test_an_effect_with_a_threshold_acts_at_one_of_its_probes():
    """The first probe is small, and none is passed by: each is some three to five times the last,
    or the last that the range holds."""
    for one in ALL:
        if len(one.probes) == 2:  # slower and faster than the trials, no threshold
            continue
        assert one.probes[0] <= 0.3, one.label
        size = one.parameters[0]
        for last, probe in itertools.pairwise(one.probes):
            assert probe <= 5.0 * last, one.label
            assert probe >= 3.0 * last or 3.0 * last * size.typical > size.high, one.label


def test_a_search_begins_from_every_combination_of_shapes_where_one_needs_the_other(rig):
    def shapes(name):
        return [probe.shape for probe in candidate(rig, effect(name)).probes]

    crossed = shapes("sprocket_ripple:two_phases")
    assert len(crossed) == len(set(crossed)) == 27
    assert [len(set(values)) for values in zip(*crossed, strict=True)] == [3, 3, 3]
    plain = shapes("sprocket_ripple:one_phase")
    usual = plain[0]
    assert all(sum(a != b for a, b in zip(usual, other, strict=True)) == 1 for other in plain[1:])


def test_an_effect_may_act_on_any_one_muscle(rig):
    for muscle in rig.muscles:
        one = candidate(rig, rig_effect(rig, f"rest_length at {muscle}"))
        assert (one.name, one.effect.place) == (f"rest_length at {muscle}", muscle)
        (length,) = one.parameters
        assert length.name == f"{muscle}:mounting.length_at_zero"
        own, nominal = one.neutral[length.name], rig.muscles[muscle].braid.nominal_length
        assert (length.low, length.high) == pytest.approx((own - nominal / 4, own + nominal / 4))
        mismatch = candidate(rig, rig_effect(rig, f"muscle_mismatch at {muscle}"))
        assert mismatch.parameters[0].name == f"{muscle}:force.scale"
        leaking = rig.with_parameters(at_size(rig, rig_effect(rig, f"air_leak at {muscle}"), 1.0))
        leaks = {m: parts.chamber.leak_conductance > 0.0 for m, parts in leaking.muscles.items()}
        assert leaks == {m: m == muscle for m in rig.muscles}
    with pytest.raises(InputError, match="sprocket_ripple:two_phases acts on two muscles together"):
        rig_effect(rig, "sprocket_ripple:two_phases at muscle_1")
    for name in ("added_inertia at muscle_1", "angle_bias at muscle_1"):
        with pytest.raises(InputError, match=r"\A[^\n]*does not act on a muscle[^\n]*\Z"):
            rig_effect(rig, name)
    wanted = ["muscle_mismatch:strength at muscle_1", "muscle_mismatch:strength at muscle_2"]
    both, _ = candidates(rig, wanted)
    assert [one.label for one in both] == wanted
    with pytest.raises(InputError, match="no such joint or muscle; did you mean 'muscle_"):
        rig_effect(rig, "air_leak at muscle_9")


@pytest.mark.parametrize("name", [*RARE, *OTHER_FORMS])
def test_no_corner_of_its_range_is_refused_at_twice_the_rig_s_step(name, rig):
    """A search that takes coarse steps may go anywhere."""
    one = candidate(rig, effect(name))
    ends = [inside([p], {p.name: end})[p.name] for p in one.parameters for end in (p.low, p.high)]
    for corner in itertools.product(*zip(ends[::2], ends[1::2], strict=True)):
        values = dict(zip([p.name for p in one.parameters], corner, strict=True))
        there = rig.with_parameters(values)
        model = there.model_for(timestep=2.0 * rig.model.opt.timestep)
        check_timestep(model, there.limits)


def test_names_stand_for_the_rig_s_own_parts(rig):
    assert (
        rig_name(rig, EFFECTS["coulomb_friction"].parameters[0].name) == "joint.shaft.frictionloss"
    )
    assert rig_name(rig, EFFECTS["load_torque"].parameters[0].name) == "body.rig.tilt"
    assert rig_name(rig, "{second_muscle}:force.scale") == "muscle_2:force.scale"
    with pytest.raises(InputError, match="did you mean 'air_leak'"):
        effect("air_lek")


@pytest.fixture
def without_hysteresis(rig, tmp_path):
    """A rig folder whose file states no hysteresis."""
    folder = tmp_path / "bare"
    shutil.copytree(rig.file.folder, folder)
    stated = (folder / "params.toml").read_text()
    before, rest = stated.split("[muscle.hysteresis]")
    (folder / "params.toml").write_text(before + rest[rest.index("\n[") :])
    return pamsim.load_rig(folder)


def test_a_rig_that_states_no_hysteresis_has_none_and_is_searched_for_it(
    rig, trials, without_hysteresis
):
    found, skipped = candidates(without_hysteresis, ["muscle_hysteresis"])
    assert not skipped
    assert [one.effect for one in found] == list(FORMS["muscle_hysteresis"])
    none = rig.with_parameters({"hysteresis.force_per_pressure": 0.0})
    for one, other in zip(runs(without_hysteresis, trials), runs(none, trials), strict=True):
        assert np.array_equal(one.angle, other.angle)
    size = {"parallel_hysteresis.force": 30.0, "parallel_hysteresis.full_slip": 5e-3}
    given = without_hysteresis.with_parameters(size)
    moved = [
        np.abs(one.angle - other.angle).max()
        for one, other in zip(runs(given, trials), runs(none, trials), strict=True)
    ]
    assert max(moved) > np.radians(0.1)


def test_forms_that_name_what_an_operator_has_not_are_skipped_with_the_reason(rig, tmp_path):
    folder = tmp_path / "grid"
    shutil.copytree(rig.file.folder, folder)
    path = folder / "params.toml"
    kept = [
        line for line in path.read_text().splitlines() if not line.startswith("yield_contraction")
    ]
    law = 'law = "bouc_wen"'
    other_law = """law = "maxwell_slip"
elements = { value = 4, unit = "1", source = "assumed" }
full_slip = { value = 0.04, unit = "1", source = "assumed" }
decay = { value = 0.7, unit = "1", source = "assumed" }"""
    assert law in kept
    path.write_text("\n".join(kept).replace(law, other_law))
    other = pamsim.load_rig(folder)
    found, skipped = candidates(other, ["muscle_hysteresis"])
    assert ([one.effect.form for one in found], skipped) == (
        ["bouc_wen", "maxwell_slip", "constant", "asymmetric"],
        {},
    )
    _, skipped = candidates(other, ["muscle_hysteresis:free_shape"])
    (reason,) = skipped.values()
    assert "hysteresis.yield_contraction" in reason


def test_a_further_form_is_probed_where_it_differs_from_the_usual_one(rig):
    """Heat exchanged within a trial's holds and strokes, by air that is adiabatic without it."""
    tried, _ = candidates(rig, ("thermal_relaxation",))
    (form,) = [one for one in tried if one.effect.form == "temperature"]
    (probe,) = form.probes
    assert 0.1 < 1.0 / probe.values["chamber.heat_rate"] < 0.5
    assert probe.values["chamber.polytropic_index"] > 1.39


def test_every_family_of_several_kinds_has_words_and_no_other():
    kinds = collections.Counter(one.family for one in EFFECTS.values())
    assert {family for family, count in kinds.items() if count > 1} == set(FAMILIES)
