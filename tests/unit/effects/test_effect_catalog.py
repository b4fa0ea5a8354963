"""On a rig, every effect is nothing at neutral, shows at its probes, and may be searched for."""

import dataclasses
import itertools

import numpy as np
import pytest

import pamsim
from pamsim.comparison.candidate import inside
from pamsim.comparison.effects_on_rig import at_size, candidate, candidates, rig_effect, rig_name
from pamsim.comparison.protocols import PROTOCOLS
from pamsim.core.errors import InputError
from pamsim.effects.catalog import EFFECTS, FORMS, effect
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import _compiled
from pamsim.recordings.sensors import distorted

ALL = [form for forms in FORMS.values() for form in forms]
NOISE = {"angle": np.radians(0.05), "pressure": 400.0, "tension": 1.5}


@pytest.fixture(scope="module")
def trials():
    """A second of inputs that move everything, one of them under load."""
    names = ("triangle", "bursts", "loaded_steps")
    return [
        dataclasses.replace(PROTOCOLS[name].experiment(3), duration=1.2, settle=0.1)
        for name in names
    ]


def runs(rig, trials):
    found = [pamsim.simulate(rig, trial).completed() for trial in trials]
    return found if rig.sensor is None else [distorted(run, rig.sensor) for run in found]


@pytest.fixture(scope="module")
def plain(rig, trials):
    return runs(rig, trials)


def test_neutral_changes_not_one_bit(rig, trials):
    """Its size at neutral, its shape parameters at their typical values."""
    brief = [dataclasses.replace(trial, duration=0.5, settle=0.1) for trial in trials]
    plain = runs(rig, brief)
    for form in ALL:
        neutral = rig.with_parameters(at_size(rig, form, 0.0))
        for one, other in zip(runs(neutral, brief), plain, strict=True):
            for signal in ("angle", "pressure", "tension", "velocity"):
                same = np.array_equal(getattr(one, signal), getattr(other, signal))
                assert same, (form.label, signal)


def test_every_effect_shows_and_more_shows_more(rig, trials, plain):
    # Both muscles are let down to the atmosphere, below the set points of the trials.
    step = pamsim.pressure_step((1e5, 8e4), (0.0, 0.0), duration=3.0, sample_rate=100.0)
    emptied = [dataclasses.replace(step, settle=0.1)]
    without = runs(rig, emptied)
    for form in ALL:
        low = form.name == "least_set_point"
        inputs, before = (emptied, without) if low else (trials, plain)
        moved = []
        for size in (0.1, 1.0):
            there = rig.with_parameters(at_size(rig, form, size))
            changes = [
                np.sqrt(np.mean((getattr(one, signal) - getattr(other, signal)) ** 2)) / noise
                for one, other in zip(runs(there, inputs), before, strict=True)
                for signal, noise in NOISE.items()
            ]
            moved.append(max(changes))
        assert moved == sorted(moved), form.label
        assert moved[1] > 0.5, form.label  # a typical size is a matter of half the noise at least
        assert moved[0] > 0.01, form.label


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
        leak = rig_effect(rig, f"air_leak:laminar at {muscle}")
        assert leak.levels == ("air", muscle, "leak", "air_leak", "laminar")
        leaking = rig.with_parameters(at_size(rig, rig_effect(rig, f"air_leak at {muscle}"), 1.0))
        leaks = {m: parts.chamber.leak_conductance > 0.0 for m, parts in leaking.muscles.items()}
        assert leaks == {m: m == muscle for m in rig.muscles}
    wanted = ["muscle_mismatch:strength at muscle_1", "muscle_mismatch:strength at muscle_2"]
    both, _ = candidates(rig, wanted)
    assert [one.label for one in both] == wanted
    for name, words in (
        ("sprocket_ripple:two_phases at muscle_1", "acts on two muscles together"),
        ("added_inertia at muscle_1", "does not act on a muscle"),
        ("air_leak at muscle_9", "no such joint or muscle; did you mean 'muscle_"),
    ):
        with pytest.raises(InputError, match=words):
            rig_effect(rig, name)


def test_no_corner_of_its_range_is_refused_at_twice_the_rig_s_step(rig):
    """A search that takes coarse steps may go anywhere."""
    rare = [one for one in EFFECTS.values() if one.rare]
    for form in (*rare, *(form for forms in FORMS.values() for form in forms[1:])):
        free = candidate(rig, form).parameters
        ends = [[inside([p], {p.name: end})[p.name] for end in (p.low, p.high)] for p in free]
        for corner in itertools.product(*ends):
            there = rig.with_parameters({p.name: v for p, v in zip(free, corner, strict=True)})
            model = there.model_for(timestep=2.0 * rig.model.opt.timestep)
            check_timestep(model, there.limits)


def test_names_stand_for_the_rig_s_own_parts(rig):
    for name, own in (
        (EFFECTS["coulomb_friction"].parameters[0].name, "joint.shaft.frictionloss"),
        (EFFECTS["load_torque"].parameters[0].name, "body.rig.tilt"),
        ("{second_muscle}:force.scale", "muscle_2:force.scale"),
    ):
        assert rig_name(rig, name) == own
    with pytest.raises(InputError, match="did you mean 'air_leak'"):
        effect("air_lek")


def test_a_rig_that_states_no_hysteresis_has_none_and_is_searched_for_it(rig, trials):
    muscle = {name: group for name, group in rig.file.muscle.items() if name != "hysteresis"}
    without_hysteresis = _compiled(dataclasses.replace(rig.file, muscle=muscle))
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


def test_forms_that_name_what_an_operator_has_not_are_skipped_with_the_reason(rig):
    other = rig.with_operator("maxwell_slip")
    found, skipped = candidates(other, ["muscle_hysteresis"])
    forms = ["bouc_wen", "maxwell_slip", "constant", "asymmetric"]
    assert ([one.effect.form for one in found], skipped) == (forms, {})
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
