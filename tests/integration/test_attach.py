"""`pamsim.attach` on models of one's own: an arm with a muscle per joint, a weight on a cable."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import EngineError, InputError, PamsimError
from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.mckibben import IdealMcKibben
from pamsim.physics.muscle import Mounting
from pamsim.physics.passive import PassiveSpring
from pamsim.physics.record import pack, unpack
from tests.unit.physics.flat import kernel

TWO_JOINTS = """
<mujoco>
  <option timestep="0.001" gravity="0 0 -9.81"/>
  <worldbody>
    <site name="ceiling" pos="0.03 0 0.3"/>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" damping="0.5"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.4"/>
      <site name="upper_hook" pos="0.03 0 -0.08"/>
      <body name="lower" pos="0 0 -0.3">
        <joint name="elbow" axis="0 1 0" damping="0.5"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.25" size="0.02" mass="0.3"/>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="upper" body2="lower"/></contact>
  <tendon>
    <spatial name="shoulder_cable"><site site="ceiling"/><site site="upper_hook"/></spatial>
    <fixed name="elbow_cable"><joint joint="elbow" coef="0.02"/></fixed>
  </tendon>
</mujoco>
"""
CABLE = """
<mujoco>
  <worldbody>
    <site name="ceiling" pos="0 0 0.23"/>
    <body>
      <joint name="rail" type="slide" axis="0 0 1" damping="5"/>
      <geom size="0.03" mass="1"/><site name="hook"/>
    </body>
  </worldbody>
  <tendon><spatial name="cable"><site site="ceiling"/><site site="hook"/></spatial></tendon>
</mujoco>
"""
# Of the first cable at rest 0.13 m are rigid fittings: a 0.25 m muscle.
LENGTHS = {"shoulder_cable": -0.13, "elbow_cable": 0.25}


@pytest.fixture(scope="module")
def shipped():
    return pamsim.load_rig("mas20_arm").muscles["muscle_1"]


@pytest.fixture(scope="module")
def muscle(shipped):
    return replace(shipped, mounting=Mounting(length_at_zero=0.0), command="pressure_set")


@pytest.fixture
def model(muscle):
    spec = mujoco.MjSpec.from_string(TWO_JOINTS)
    for tendon, length in LENGTHS.items():
        pamsim.attach(spec, tendon=tendon, muscle=muscle, length_at_zero=length)
    return pamsim.compile_model(spec)


def settled(model, pressures):
    data = mujoco.MjData(model)
    pamsim.reset(model, data)
    assert pamsim.pressures(model, data) == pytest.approx(0.0, abs=1e-6)
    data.ctrl[:] = pressures
    with pamsim.live(model):
        mujoco.mj_step(model, data, 2000)
        mujoco.mj_forward(model, data)
    return data


def test_each_muscle_moves_its_own_joint_by_the_law_at_its_length(model, muscle):
    rest, shoulder, elbow = (settled(model, p) for p in ((0, 0), (3e5, 0), (0, 3e5)))
    np.testing.assert_allclose(pamsim.pressures(model, shoulder), (3e5, 0), atol=500.0)
    for joint, data in enumerate((shoulder, elbow)):
        assert data.warning.number.sum() == 0
        assert abs(data.qpos[joint] - rest.qpos[joint]) > 0.05
        # A muscle pulls its cable shorter, whichever way the joint then turns.
        assert data.ten_length[joint] < rest.ten_length[joint]
        act, at_zero = np.split(data.act, 2)[joint], list(LENGTHS.values())[joint]
        row = pack(replace(muscle, mounting=Mounting(length_at_zero=at_zero)))
        expected = kernel.tension(row, act, float(data.ten_length[joint]))
        assert data.actuator_force[joint] == -expected < 0.0


def test_a_broken_run_is_not_reset_behind_the_users_back(model):
    data = mujoco.MjData(model)
    data.act[:] = np.nan
    with pamsim.checks(False), pamsim.live(model):
        mujoco.mj_step(model, data, 10)
    assert data.time == pytest.approx(0.01)
    assert np.isnan(data.qpos).any()


@pytest.mark.parametrize(
    "stated",
    [
        'gear="5"',
        'forcerange="-10 10"',
        'actrange="0 1"',
        'damping="3"',
        'armature="2"',
        'ctrlrange="-1 1"',
        'delay="0.1" nsample="100"',
    ],
)
def test_what_a_model_states_for_its_motors_does_not_change_a_muscle(stated, muscle):
    """Nor that it wants every limit stated."""
    ends = []
    defaults = f'<compiler autolimits="false"/><default><general {stated}/></default>'
    for head in ("", defaults):
        text = TWO_JOINTS.replace("<worldbody>", f"{head}<worldbody>")
        spec = mujoco.MjSpec.from_string(text)
        pamsim.attach(spec, tendon="elbow_cable", muscle=muscle, length_at_zero=0.25)
        model = pamsim.compile_model(spec)
        data = mujoco.MjData(model)
        pamsim.reset(model, data, 1e5)
        data.ctrl[:] = 2e5
        mujoco.mj_step(model, data, 100)
        ends.append((data.qpos, model.actuator_ctrllimited, model.actuator_ctrlrange))
    for plain, own in zip(*ends, strict=True):
        assert np.array_equal(plain, own)


def test_models_put_into_one_move_as_alone_and_a_broken_run_of_theirs_is_not_reset(shipped):
    world = mujoco.MjSpec()
    for place in range(2):
        spec = mujoco.MjSpec.from_string(CABLE)
        pamsim.attach(spec, tendon="cable", muscle=shipped)
        frame = world.worldbody.add_frame(pos=[place, 0, 0])
        world.attach(spec.copy(), prefix=f"{place}_", frame=frame)
    ends = []
    for model in (pamsim.compile_model(spec), pamsim.compile_model(world)):
        data = mujoco.MjData(model)
        pamsim.reset(model, data, 1e5)
        data.ctrl[:] = 2e5
        mujoco.mj_step(model, data, 100)
        ends.append(data.qpos.copy())
    assert ends[1] == pytest.approx(np.repeat(ends[0], 2), rel=1e-9)
    data.act[:] = np.nan
    with pamsim.checks(False):
        mujoco.mj_step(model, data, 10)
    assert np.isnan(data.qpos).any()


def test_a_muscle_of_another_rig_has_its_nominal_length_on_any_tendon(shipped):
    """The arm's muscles sit on fixed tendons, which begin at a length of 0."""
    spec = mujoco.MjSpec.from_string(CABLE)
    pamsim.attach(spec, tendon="cable", muscle=shipped)
    model = pamsim.compile_model(spec)
    (row,) = model.actuator_user
    own = unpack(row).mounting.length_at_zero
    assert own == pytest.approx(shipped.braided.nominal_length - 0.23, abs=1e-12)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, 1e5)
    data.ctrl[:] = 1e5
    mujoco.mj_forward(model, data)
    assert 0.0 < -data.actuator_force[0] < 500.0
    mujoco.mj_step(model, data, 1000)
    assert np.isfinite(data.qpos).all()


def test_a_muscle_longer_than_its_fibres_or_shorter_than_nothing_is_refused(shipped):
    spec = mujoco.MjSpec.from_string(CABLE)
    pamsim.attach(spec, tendon="cable", muscle=shipped, length_at_zero=0.25)
    model = pamsim.compile_model(spec)
    straight = shipped.braided.nominal_length / np.cos(shipped.braided.fibre_angle)
    with pytest.raises(InputError, match=rf"'cable' would be 0\.48 m [^\n]* {straight:.4g} m;"):
        pamsim.reset(model, mujoco.MjData(model))
    spec.delete(spec.actuators[0])
    pamsim.attach(spec, tendon="cable", muscle=shipped, length_at_zero=-0.5)
    model = pamsim.compile_model(spec)
    with pytest.raises(InputError, match=r"'cable' cannot be filled .* its length of -0\.27 m"):
        pamsim.reset(model, mujoco.MjData(model))
    long = pamsim.load_rig("mas20_arm").with_parameters({"mounting.length_at_zero": 0.5})
    step = pamsim.pressure_step((1e5, 1e5), (2e5, 1e5), duration=0.1)
    with pytest.raises(InputError, match=r"'muscle_1' would be 0\.5 m long"):
        pamsim.simulate(long, step)


def test_a_muscle_that_is_pulled_longer_than_its_fibres_stops_the_run(shipped):
    """The ideal law has neither rubber nor a braid that locks, and no force without pressure."""
    ideal = replace(shipped, force=IdealMcKibben(), passive=PassiveSpring(), braid=Braid(
        nominal_length=0.25, diameter=0.02, fibre_angle=0.5
    ))  # fmt: skip
    spec = mujoco.MjSpec.from_string(CABLE.replace('mass="1"', 'mass="100"'))
    pamsim.attach(spec, tendon="cable", muscle=ideal)
    model = pamsim.compile_model(spec)
    data = mujoco.MjData(model)
    pamsim.reset(model, data)
    longest = 0.0
    for _ in range(200):
        mujoco.mj_step(model, data)
        longest = np.fmax(longest, data.ten_length[0] + 0.02)
    assert np.isnan(data.qpos[0])
    assert 0.9 * 0.25 / np.cos(0.5) < longest < 1.2 * 0.25 / np.cos(0.5)


def test_pressures_are_right_in_a_keyframe_and_in_a_restored_state(shipped):
    pose = '<keyframe><key qpos="0.02"/></keyframe></mujoco>'
    spec = mujoco.MjSpec.from_string(CABLE.replace("</mujoco>", pose))
    pamsim.attach(spec, tendon="cable", muscle=shipped)
    model = pamsim.compile_model(spec)
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    pamsim.charge(model, data, 2e5)
    assert data.ten_length[0] == pytest.approx(0.21)
    assert pamsim.pressures(model, data) == pytest.approx(2e5)
    pamsim.restore_state(model, other, pamsim.save_state(model, data))
    assert pamsim.pressures(model, other) == pytest.approx(2e5)


def test_what_cannot_be_attached_is_refused(muscle):
    spec = mujoco.MjSpec.from_string(TWO_JOINTS)
    for model in (TWO_JOINTS, mujoco.MjModel.from_xml_string(TWO_JOINTS)):
        with pytest.raises(InputError, match=f"MjSpec.*, not a {type(model).__name__}$"):
            pamsim.attach(model, tendon="elbow_cable", muscle=muscle)
    for no_muscle in ("muscle_1", pamsim.load_rig("mas20_arm")):
        with pytest.raises(InputError, match=rf"\['muscle_1'\], not a {type(no_muscle).__name__}$"):
            pamsim.attach(spec, tendon="elbow_cable", muscle=no_muscle)
    with pytest.raises(InputError, match="did you mean 'elbow_cable'"):
        pamsim.attach(spec, tendon="elbow_cabel", muscle=muscle)
    with pytest.raises(InputError, match=r"known: elbow_cable, shoulder_cable$"):
        pamsim.attach(spec, tendon=spec.tendons[0], muscle=muscle)
    nameless = mujoco.MjSpec.from_string(CABLE.replace('spatial name="cable"', "spatial"))
    with pytest.raises(InputError, match="no tendon 'cable' in this model; known: none"):
        pamsim.attach(nameless, tendon="cable", muscle=muscle)
    pamsim.attach(spec, tendon="elbow_cable", muscle=muscle)
    with pytest.raises(InputError, match="exists already"):
        pamsim.attach(spec, tendon="elbow_cable", muscle=muscle)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(EngineError, match="RK4"):
        pamsim.attach(spec, tendon="shoulder_cable", muscle=muscle)
    unfinished = mujoco.MjSpec.from_string(CABLE)
    unfinished.worldbody.add_body(name="massless").add_joint(name="later")
    with pytest.raises(InputError, match="give length_at_zero"):
        pamsim.attach(unfinished, tendon="cable", muscle=muscle)
    pamsim.attach(unfinished, tendon="cable", muscle=muscle, length_at_zero=0.02)


@pytest.mark.parametrize(
    ("stated", "refused"),
    [("delay", "does not delay"), ("actfrcrange", "does not limit"), ("integrator", "RK4")],
)
def test_what_the_engine_would_leave_out_is_refused_when_the_model_is_compiled(
    stated, refused, muscle
):
    """A model with another integrator may take one with muscles in, after `pamsim.attach`."""
    spec = mujoco.MjSpec.from_string(CABLE)
    actuator = pamsim.attach(spec, tendon="cable", muscle=muscle, length_at_zero=0.02)
    if stated == "delay":
        actuator.delay, actuator.nsample = 0.1, 100
    elif stated == "actfrcrange":
        spec.tendons[0].actfrcrange = (-5, 5)
    else:
        world = mujoco.MjSpec()
        world.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        world.attach(spec, prefix="arm_", frame=world.worldbody.add_frame())
        spec = world
    with pytest.raises(PamsimError, match=refused):
        pamsim.compile_model(spec)
