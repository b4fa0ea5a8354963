"""A rig with two joints and four muscles from its recording to calibration and diagnosis."""

import pytest

import pamsim
from pamsim.comparison.effects_on_rig import at_size, rig_effect
from pamsim.core.errors import InputError

SHORT = {"protocols": ("multisine",), "variation": 0.0, "seed": 1}
DAMPING = {"joint.shoulder.damping": 0.55, "joint.elbow.damping": 0.10}
RUBS = "viscous_friction at elbow"


@pytest.fixture(scope="module")
def arm():
    rig = pamsim.load_rig("two_joint_arm")
    rig.model.opt.timestep = 1e-3  # for synthetic data and fit
    return rig


@pytest.fixture(scope="module")
def rubbing(arm, tmp_path_factory):
    """Recordings in which the elbow has viscous friction."""
    folder = tmp_path_factory.mktemp("twin") / "elbow"
    pamsim.hide(arm, {RUBS: 1.0}, repeats=5, duration=2.5, forces=False, **SHORT).save(folder)
    return folder


def test_friction_hidden_at_one_joint_is_named_at_that_joint(arm, rubbing):
    tried = ["viscous_friction", "added_inertia"]
    found = pamsim.diagnose([rubbing], rig=arm, effects=tried, nuisance=["force.scale"])
    (effect,) = found.effects
    assert (effect.name, effect.place) == ("viscous_friction", "elbow")
    planted = at_size(arm, rig_effect(arm, RUBS), 1.0)["joint.elbow.damping"]
    size = effect.sizes["joint.elbow.damping"].value
    assert size > 1.4 * arm.model.joint("elbow").damping[0]
    assert size == pytest.approx(planted, rel=0.03)
    assert found.links[-1].after < 1.1 < found.links[-1].before


def test_damping_of_both_joints_is_recovered_and_written(arm, tmp_path):
    planted = arm.with_parameters(DAMPING)
    pamsim.hide(planted, {}, repeats=1, duration=1.2, **SHORT).save(tmp_path / "data")
    out = tmp_path / "out"
    asked = {"free": list(DAMPING), "channels": ["angle"], "out": out}
    found = pamsim.calibrate([tmp_path / "data"], rig=arm, **asked)
    assert found.status == "converged"
    for parameter in found.parameters:
        low, high = parameter.interval95
        assert low < DAMPING[parameter.name] < high
        assert high - low < 0.1 * parameter.value
    assert [row["channel"] for row in found.misfit()] == ["shoulder.angle", "elbow.angle"]
    written = pamsim.load_rig(found.folder)
    assert written.joints == planted.joints
    assert written.model.joint("elbow").damping[0] == pytest.approx(0.10, rel=0.1)


def test_data_of_another_rig_and_angles_at_rest_of_one_joint_are_refused(rubbing, tmp_path):
    table = tmp_path / "rest.csv"
    rows = ("p1_kpa,p2_kpa,p3_kpa,p4_kpa,angle_deg,load_kg", "300,100,200,200,10,0")
    table.write_text("\n".join([*rows, "100,300,200,200,-9,0"]) + "\n")
    for data, rig, words in (
        (rubbing, "mas20_arm", "is of 4 muscles, rig 'mas20_arm' has 2"),
        (table, "two_joint_arm", "angles at rest of one joint.*has shoulder, elbow"),
    ):
        with pytest.raises(InputError, match=words):
            pamsim.calibrate([data], rig=rig, free=["force.scale"])
