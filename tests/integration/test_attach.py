"""`pamsim.attach` on a model of one's own: a two-joint arm with a muscle per joint."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import EngineError, InputError
from pamsim.physics.record import unpack

TWO_JOINTS = """
<mujoco>
  <option timestep="0.001" gravity="0 0 -9.81"/>
  <worldbody>
    <site name="ceiling" pos="0.03 0 0.3"/>
    <body name="upper" pos="0 0 0">
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


def muscle(length_at_zero):
    from dataclasses import replace

    from pamsim.physics.muscle import Mounting

    shipped = pamsim.load_rig("mas20_arm").muscles["muscle_1"]
    return replace(
        shipped, mounting=Mounting(length_at_zero=length_at_zero), command="pressure_set"
    )


def build():
    spec = mujoco.MjSpec.from_string(TWO_JOINTS)
    # 0.38 m of cable at rest, of which 0.13 m are rigid fittings: a 0.25 m muscle.
    pamsim.attach(
        spec,
        tendon="shoulder_cable",
        muscle=muscle(0.0),
        name="shoulder_muscle",
        length_at_zero=-0.13,
    )
    pamsim.attach(spec, tendon="elbow_cable", muscle=muscle(0.25), length_at_zero=0.25)
    return pamsim.compile_model(spec)


def settle(model, pressures):
    data = mujoco.MjData(model)
    pamsim.reset(model, data)
    data.ctrl[:] = pressures
    with pamsim.live(model):
        mujoco.mj_step(model, data, 4000)
    return data


def test_a_reset_without_pressures_leaves_the_chambers_at_the_atmosphere():
    model = build()
    data = mujoco.MjData(model)
    pamsim.reset(model, data)
    assert pamsim.pressures(model, data) == pytest.approx(0.0, abs=1e-6)


def test_each_muscle_moves_its_own_joint():
    model = build()
    rest, shoulder, elbow = (settle(model, p) for p in ((0, 0), (3e5, 0), (0, 3e5)))
    assert rest.warning.number.sum() == 0
    pulled_shoulder = shoulder.qpos - rest.qpos
    pulled_elbow = elbow.qpos - rest.qpos
    assert abs(pulled_shoulder[0]) > 0.05
    assert abs(pulled_elbow[1]) > 0.05
    np.testing.assert_allclose(pamsim.pressures(model, shoulder), (3e5, 0), atol=500.0)
    # A muscle pulls its cable shorter, whichever way the joint then turns.
    assert shoulder.ten_length[0] < rest.ten_length[0]
    assert elbow.ten_length[1] < rest.ten_length[1]


def test_force_on_the_cable_is_the_muscle_law_at_its_length():
    from pamsim.physics.record import pack
    from tests.unit.physics.flat import kernel

    model = build()
    data = settle(model, (2e5, 1e5))
    with pamsim.live(model):
        mujoco.mj_forward(model, data)
    states = np.split(data.act, 2)
    for index, (rest, act) in enumerate(zip((-0.13, 0.25), states, strict=True)):
        expected = kernel.tension(pack(muscle(rest)), act, float(data.ten_length[index]))
        assert expected >= 0.0
        assert data.actuator_force[index] == -expected


def test_unknown_tendon_taken_name_and_runge_kutta_are_refused():
    spec = mujoco.MjSpec.from_string(TWO_JOINTS)
    with pytest.raises(InputError, match="did you mean 'elbow_cable'"):
        pamsim.attach(spec, tendon="elbow_cabel", muscle=muscle(0.25))
    pamsim.attach(spec, tendon="elbow_cable", muscle=muscle(0.25))
    with pytest.raises(InputError, match="exists already"):
        pamsim.attach(spec, tendon="elbow_cable", muscle=muscle(0.25))
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(EngineError, match="RK4"):
        pamsim.attach(spec, tendon="shoulder_cable", muscle=muscle(-0.13))


def test_a_broken_run_is_not_reset_behind_the_users_back():
    model = build()
    data = mujoco.MjData(model)
    data.act[:] = np.nan
    with pamsim.checks(False), pamsim.live(model):
        mujoco.mj_step(model, data, 10)
    assert data.time == pytest.approx(0.01)
    assert np.isnan(data.qpos).any()


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


def test_a_muscle_of_another_rig_has_its_nominal_length_on_any_tendon():
    """The arm's muscles sit on fixed tendons, which begin at a length of 0."""
    arm = pamsim.load_rig("mas20_arm").muscles["muscle_1"]
    spec = mujoco.MjSpec.from_string(CABLE)
    pamsim.attach(spec, tendon="cable", muscle=arm)
    model = pamsim.compile_model(spec)
    (row,) = model.actuator_user
    own = unpack(row).mounting.length_at_zero
    assert own == pytest.approx(arm.braided.nominal_length - 0.23, abs=1e-12)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, 1e5)
    data.ctrl[:] = 1e5
    mujoco.mj_forward(model, data)
    assert 0.0 < -data.actuator_force[0] < 500.0
    mujoco.mj_step(model, data, 1000)
    assert np.isfinite(data.qpos).all()


def test_a_muscle_longer_than_its_fibres_is_refused_with_both_lengths():
    arm = pamsim.load_rig("mas20_arm").muscles["muscle_1"]
    spec = mujoco.MjSpec.from_string(CABLE)
    pamsim.attach(spec, tendon="cable", muscle=arm, length_at_zero=0.25)
    model = pamsim.compile_model(spec)
    straight = arm.braided.nominal_length / np.cos(arm.braided.fibre_angle)
    message = rf"\Amuscle 'cable' would be 0\.48 m [^\n]* {straight:.4g} m; [^\n]*\Z"
    with pytest.raises(InputError, match=message):
        pamsim.reset(model, mujoco.MjData(model))
    long = pamsim.load_rig("mas20_arm").with_parameters({"mounting.length_at_zero": 0.5})
    step = pamsim.pressure_step((1e5, 1e5), (2e5, 1e5), duration=0.1)
    with pytest.raises(InputError, match=r"'muscle_1' would be 0\.5 m long"):
        pamsim.simulate(long, step)


def test_the_length_of_a_tendon_in_an_unfinished_model_has_to_be_given():
    arm = pamsim.load_rig("mas20_arm").muscles["muscle_1"]
    spec = mujoco.MjSpec.from_string(CABLE)
    spec.worldbody.add_body(name="massless").add_joint(name="later")
    with pytest.raises(InputError, match="give length_at_zero"):
        pamsim.attach(spec, tendon="cable", muscle=arm)
    pamsim.attach(spec, tendon="cable", muscle=arm, length_at_zero=0.02)
