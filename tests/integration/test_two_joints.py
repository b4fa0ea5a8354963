"""A rig with two joints and four muscles from its recording to calibration and diagnosis."""

from __future__ import annotations

import pytest

import pamsim
from pamsim.comparison.effects_on_rig import at_size, rig_effect
from pamsim.core.errors import InputError

SHORT = {"protocols": ("triangle", "multisine"), "duration": 2.5, "variation": 0.0, "seed": 1}
DAMPING = {"joint.shoulder.damping": 0.55, "joint.elbow.damping": 0.10}


@pytest.fixture(scope="module")
def arm():
    rig = pamsim.load_rig("two_joint_arm")
    rig.model.opt.timestep = 1e-3  # for synthetic data and fit
    return rig


@pytest.fixture(scope="module")
def rubbing(arm, tmp_path_factory):
    """Recordings in which the elbow has viscous friction."""
    folder = tmp_path_factory.mktemp("twin") / "elbow"
    hidden = {"viscous_friction at elbow": 1.0}
    short = SHORT | {"protocols": ("multisine",), "forces": False}
    pamsim.hide(arm, hidden, repeats=5, **short).save(folder)
    return folder


def test_friction_hidden_at_one_joint_is_named_at_that_joint(arm, rubbing):
    found = pamsim.diagnose(
        [rubbing],
        rig=arm,
        effects=["viscous_friction", "added_inertia"],
        nuisance=["force.scale"],
    )
    (effect,) = found.effects
    assert (effect.name, effect.place) == ("viscous_friction", "elbow")
    own = arm.model.joint("elbow").damping[0]
    planted = at_size(arm, rig_effect(arm, "viscous_friction at elbow"), 1.0)
    size = effect.sizes["joint.elbow.damping"]
    assert size.value > 1.4 * own
    assert size.value == pytest.approx(planted["joint.elbow.damping"], rel=0.03)
    assert found.links[-1].after < 1.1 < found.links[-1].before


def test_damping_of_both_joints_is_recovered_and_written(arm, tmp_path):
    planted = arm.with_parameters(DAMPING)
    short = SHORT | {"protocols": ("multisine",), "duration": 1.2}
    recording = pamsim.hide(planted, {}, repeats=1, **short)
    recording.save(tmp_path / "data")
    found = pamsim.calibrate(
        [tmp_path / "data"], rig=arm, free=list(DAMPING), channels=["angle"],
        out=tmp_path / "out",
    )  # fmt: skip
    assert found.status == "converged"
    for parameter in found.parameters:
        low, high = parameter.interval95
        assert low < DAMPING[parameter.name] < high
        assert high - low < 0.1 * parameter.value
    assert [row["channel"] for row in found.misfit()] == ["shoulder.angle", "elbow.angle"]
    written = pamsim.load_rig(found.folder)
    assert written.joints == planted.joints
    assert written.model.joint("elbow").damping[0] == pytest.approx(0.10, rel=0.1)


def test_a_recording_of_another_rig_is_refused_with_its_muscles(rubbing):
    with pytest.raises(InputError, match="is of 4 muscles, rig 'mas20_arm' has 2"):
        pamsim.calibrate([rubbing], rig="mas20_arm", free=["force.scale"])


def test_angles_at_rest_of_one_joint_are_refused(tmp_path):
    table = tmp_path / "rest.csv"
    columns = ["p1_kpa", "p2_kpa", "p3_kpa", "p4_kpa", "angle_deg", "load_kg"]
    rows = [
        columns,
        ["300", "100", "200", "200", "10", "0"],
        ["100", "300", "200", "200", "-9", "0"],
    ]
    table.write_text("\n".join(map(",".join, rows)) + "\n")
    with pytest.raises(InputError, match=r"angles at rest of one joint.*has shoulder, elbow"):
        pamsim.calibrate([table], rig="two_joint_arm", free=["force.scale"])
