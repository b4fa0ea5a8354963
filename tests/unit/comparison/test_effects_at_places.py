"""Effects on a rig with several joints and muscles: each place is a cause of its own."""

import pytest

import pamsim
from pamsim.comparison.effects_on_rig import at_size, candidate, candidates, rig_effect
from pamsim.comparison.free_parameters import default_names
from pamsim.core.errors import InputError
from pamsim.diagnosis import physical_size
from pamsim.diagnosis.bench import bench
from pamsim.diagnosis.virtual_tests import TESTS


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("two_joint_arm")


@pytest.fixture(scope="module")
def tried(rig):
    found, skipped = candidates(rig)
    assert skipped == {}
    return {one.label: one for one in found}


def test_an_effect_is_tried_at_each_place_that_it_can_have(tried):
    muscles = ["shoulder_flexor", "shoulder_extensor", "biceps", "triceps"]
    for name, places in (
        ("viscous_friction", ["shoulder", "elbow"]),
        ("muscle_mismatch:strength", muscles),
        ("viscoelastic_creep:one_branch", [""]),
        ("sprocket_ripple:one_phase", [""]),
        ("sprocket_ripple:two_phases", []),  # which of four is at the chain's other end?
        ("angle_bias", [""]),
    ):
        labels = [f"{name} at {place}" if place else name for place in places]
        assert [label for label in tried if label.partition(" at ")[0] == name] == labels


def test_the_range_of_an_effect_at_a_muscle_scales_with_that_muscle(rig):
    """Of the mounting, by the nominal length."""
    longer = rig.with_parameters({"biceps:braid.nominal_length": 0.3})
    for muscle, length in (("biceps", 0.3), ("triceps", 0.25)):
        (size,) = at_size(longer, rig_effect(longer, f"rest_length at {muscle}"), 1.0).values()
        own = longer.muscles[muscle].mounting.length_at_zero
        assert size - own == pytest.approx(2e-3 * length)


def test_sizes_of_effects_at_a_joint_that_slides_are_forces_and_masses(tmp_path):
    bench = pamsim.load_rig(pamsim.new_rig("mine", "bench", out=tmp_path / "mine"))
    for name, size in (("coulomb_friction", 12.0), ("added_inertia", 0.16)):
        (found,) = at_size(bench, rig_effect(bench, name), 1.0).values()
        assert found == pytest.approx(size)
    (friction,) = candidate(bench, rig_effect(bench, "coulomb_friction")).parameters
    assert friction.high == pytest.approx(200.0)  # N, of a seal of a large cylinder
    (smooth,) = candidates(bench, ["coulomb_friction:smooth"])[0]
    assert smooth.probes[0].shape == pytest.approx((0.05 * 0.025,))


def test_what_is_left_out_is_not_tried(rig):
    found, skipped = candidates(rig, without=["coulomb_friction", "angle_bias"])
    assert skipped == dict.fromkeys(("coulomb_friction", "angle_bias"), "left out on request")
    names = {one.effect.name for one in found}
    assert names == {one.effect.name for one in candidates(rig)[0]} - set(skipped)
    few, _ = candidates(rig, ["air_leak", "angle_bias"], ["angle_bias"])
    assert {one.effect.name for one in few} == {"air_leak"}
    with pytest.raises(InputError, match="did you mean 'air_leak'"):
        candidates(rig, without=["air_leek"])
    for part in ("coulomb_friction:dahl", "coulomb_friction at elbow"):
        with pytest.raises(InputError, match=r"whole effects.*give 'coulomb_friction'"):
            candidates(rig, without=[part])
    with pytest.raises(InputError, match="leaves no effect to try"):
        candidates(rig, ["air_leak"], ["air_leak"])


def test_forms_of_one_place_share_its_name_and_other_places_do_not(rig, tried):
    friction = [one for one in tried.values() if one.effect.name == "coulomb_friction"]
    assert [(one.name, one.effect.form) for one in friction] == [
        ("coulomb_friction at shoulder", "rigid"),
        ("coulomb_friction at elbow", "rigid"),
        ("coulomb_friction", "dahl"),
        ("coulomb_friction", "lugre"),
        ("coulomb_friction", "dwell"),
        ("coulomb_friction at shoulder", "smooth"),
        ("coulomb_friction at elbow", "smooth"),
    ]
    assert [one.usual for one in friction] == [True, True, True, False, False, False, False]
    single, _ = candidates(rig, ["coulomb_friction at elbow"])
    assert [one.label for one in single] == [
        "coulomb_friction:rigid at elbow",
        "coulomb_friction:smooth at elbow",
    ]


def test_hidden_at_one_place_it_changes_that_place_alone_and_no_other_exists(rig):
    found = at_size(rig, rig_effect(rig, "coulomb_friction at elbow"), 1.0)
    assert found == {"joint.elbow.frictionloss": 0.3}
    leaking = at_size(rig, rig_effect(rig, "air_leak at biceps"), 1.0)
    assert list(leaking) == ["biceps:chamber.leak_conductance"]
    for name, words in (
        ("coulomb_friction at elbw", "no such joint or muscle; did you mean 'elbow'"),
        ("air_leak at elbow", "air_leak does not act on a joint"),
        ("added_inertia at biceps", "added_inertia does not act on a muscle"),
        ("angle_bias at biceps", "angle_bias does not act on a muscle"),
    ):
        with pytest.raises(InputError, match=words):
            rig_effect(rig, name)
    with pytest.raises(InputError, match=r"write 'EFFECT at shoulder' or 'EFFECT at elbow'"):
        pamsim.hide(rig, {"viscous_friction": 1.0}, protocols=("bursts",), duration=1.0)


def test_the_size_is_measured_at_the_joint_that_has_the_effect(rig):
    there = rig.with_parameters({"joint.elbow.frictionloss": 0.3})
    sizes = {
        joint: TESTS["coulomb_friction"](bench(there, joint), bench(rig, joint), 0)
        for joint in rig.joints
    }
    assert sizes["elbow"]["sliding_torque"][0] == pytest.approx(0.3)
    assert sizes["shoulder"]["sliding_torque"][0] == 0.0
    assert physical_size.tested_joint(rig, "joint.elbow.frictionloss") == "elbow"
    assert physical_size.tested_joint(rig, "chamber.leak_conductance") == "shoulder"
    assert physical_size.tested_joint(rig, "triceps:chain.ripple") == "elbow"


def test_inertia_moment_arms_and_damping_are_those_of_each_joint(rig):
    shoulder, elbow = bench(rig, "shoulder"), bench(rig, "elbow")
    assert elbow.inertia == pytest.approx(0.0019 + 0.35 * 0.125**2)
    both = 0.0046 + 0.60 * 0.15**2 + 0.0019 + 0.35 * (0.30 + 0.125) ** 2
    assert shoulder.inertia == pytest.approx(both)
    assert shoulder.arms == pytest.approx([-0.025, 0.025, -0.016, 0.016])
    assert elbow.arms == pytest.approx([0.0, 0.0, -0.024, 0.024])
    with pytest.raises(InputError, match="needs a rig with one joint"):
        bench(rig)
    names = default_names(rig, moving=True)
    assert {"joint.shoulder.damping", "joint.elbow.damping"} <= set(names)


def test_an_effect_at_the_end_of_its_range_is_tried_the_other_way():
    rig = pamsim.load_rig("mas20_arm").with_parameters({"chamber.polytropic_index": 1.4})
    (one,) = (c for c in candidates(rig)[0] if c.label == "thermal_relaxation:index")
    index = one.probes[0].values["chamber.polytropic_index"]
    assert index == pytest.approx(1.4 - 0.3 * 0.15)
