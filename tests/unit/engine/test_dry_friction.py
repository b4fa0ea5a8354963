"""Friction of a joint: dry friction holds under load, quadratic damping is that of its formula."""

import math

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.engine.mjcf_fields import make_friction_stick, native_value

LEVEL, TORQUE = 0.5, 0.45
SPEED = 0.05
STATED = 'solreffriction="0.005 1" solimpfriction="0.99 0.99 0.001 0.5 2"'
TWO_LINKS = """<mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody>
<body><joint name="a" axis="0 0 1" frictionloss="0.3" {first}/>
<geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.01" contype="{touch}" conaffinity="0"/>
<body pos="0.2 0 0"><joint name="b" axis="0 0 1" frictionloss="0.2"/>
<geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.01" contype="0" conaffinity="0"/>
</body></body></worldbody>
<tendon><fixed frictionloss="1"><joint joint="a" coef="0.01"/></fixed></tendon></mujoco>"""


@pytest.fixture(scope="module")
def rubbing():
    return pamsim.load_rig("mas20_arm").with_parameters({"joint.shaft.frictionloss": LEVEL})


def held(model, seconds, torque=TORQUE):
    """Travel of the bare joint [deg] under a steady torque below its friction."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, 1e5)
    data.qfrc_applied[0] = torque
    with pamsim.live(model):
        mujoco.mj_step(model, data, round(seconds / model.opt.timestep))
    return math.degrees(data.qpos[0])


def test_a_joint_below_its_friction_stays_for_minutes(rubbing):
    for timestep, seconds in ((2.5e-4, 10.0), (2e-3, 120.0)):
        assert abs(held(rubbing.model_for(timestep=timestep), seconds)) < 1e-6


def test_above_its_friction_a_joint_accelerates_by_what_is_left(rubbing):
    model = rubbing.model_for(load=0.4)
    model.dof_damping[:] = 0.0
    angle = math.radians(held(model, 0.2, torque=0.7))
    inertia = 1.0 / model.dof_invweight0[0]
    assert angle == pytest.approx(0.5 * (0.7 - LEVEL) / inertia * 0.2**2, rel=5e-3)


def test_quadratic_damping_slows_a_joint_as_its_closed_form_says():
    """Under a torque M the speed tends to sqrt(M / D) as a hyperbolic tangent of time."""
    damping = 0.4
    rig = pamsim.load_rig("mas20_arm").with_parameters({"joint.shaft.quadratic_damping": damping})
    assert native_value(rig.model, "joint.shaft.quadratic_damping") == damping
    model = rig.model_for(load=0.4, timestep=2.5e-4)
    model.dof_damping[:] = 0.0
    inertia = 1.0 / model.dof_invweight0[0]
    for torque in (0.9, -0.9):
        angle = math.radians(held(model, 0.3, torque=torque))
        slowed = math.log(math.cosh(0.3 * math.sqrt(abs(torque) * damping) / inertia))
        assert angle == pytest.approx(math.copysign(inertia / damping * slowed, torque), rel=2e-3)


def test_friction_of_one_joint_that_loads_the_next_holds_too():
    model = mujoco.MjModel.from_xml_string(TWO_LINKS.format(first="", touch=0))
    make_friction_stick(model)
    data = mujoco.MjData(model)
    data.qfrc_applied[:] = 0.28, -0.19
    mujoco.mj_step(model, data, 20_000)
    assert np.abs(np.degrees(data.qpos)).max() < 1e-5


def test_settings_that_the_mjcf_states_and_contacts_keep_their_own():
    model = mujoco.MjModel.from_xml_string(TWO_LINKS.format(first=STATED, touch=0))
    make_friction_stick(model)
    np.testing.assert_array_equal(model.dof_solref, [[0.005, 1.0], [0.001, 1.0]])
    np.testing.assert_array_equal(model.dof_solimp[0], [0.99, 0.99, 0.001, 0.5, 2.0])
    assert model.tendon_solref_fri[0, 0] == 0.001
    assert model.dof_solimp[1, 0] == model.tendon_solimp_fri[0, 0] == 0.9999
    assert model.opt.noslip_iterations > 0
    touching = mujoco.MjModel.from_xml_string(TWO_LINKS.format(first="", touch=1))
    make_friction_stick(touching)
    assert touching.opt.noslip_iterations == 0
    assert touching.dof_solref[0, 0] == 0.001


@pytest.fixture(scope="module")
def smooth(rubbing):
    return rubbing.with_parameters({"joint.shaft.friction_speed": SPEED})


def test_below_its_friction_speed_a_joint_that_does_not_stick_creeps_in_proportion(smooth):
    for share, timestep in ((0.02, 2e-3), (0.3, 2.5e-4), (0.9, 2e-3)):
        model = smooth.model_for(timestep=timestep)
        model.dof_damping[:] = 0.0
        seconds = 3.0
        crept = math.radians(held(model, seconds, torque=share * LEVEL))
        # On the way to its speed it lags by the time constant J / c times that speed.
        behind = SPEED / LEVEL / model.dof_invweight0[0]
        assert crept == pytest.approx(share * SPEED * (seconds - behind), rel=2e-3), share


def test_friction_that_does_not_stick_adds_no_inertia_and_ends_at_its_full_size(smooth, rubbing):
    own, sticking = (rig.model_for(load=0.4) for rig in (smooth, rubbing))
    for model in (own, sticking):
        model.dof_damping[:] = 0.0
    moved, there = (math.radians(held(m, 0.2, torque=0.9)) for m in (own, sticking))
    # It brakes by half of it on the way to the friction speed, which is the only difference.
    gained = 0.5 * LEVEL * SPEED / (0.9 - 0.5 * LEVEL)
    assert moved - there == pytest.approx(gained * 0.2, rel=0.25)


def test_a_friction_speed_is_kept_and_taken_back(smooth):
    assert native_value(smooth.model, "joint.shaft.friction_speed") == SPEED
    again = smooth.with_parameters({"joint.shaft.friction_speed": 0.0})
    assert abs(held(again.model_for(), 5.0)) < 1e-6
