"""A chain that gives or has play, in the engine: where the arm rests and what it costs."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.physics.record import slot

COMPLIANCE, PLAY, RADIUS, LOAD = 2e-6, 3e-4, 12.1276e-3, 1.2
NO_LOOP = {"hysteresis.force_per_pressure": 0.0, "braid.extensibility": 0.0}
"""Muscles whose force depends on length and pressure alone, linear in pressure."""
FREE = {"joint.shaft.damping": 0.0, "body.rig.tilt": 0.0}
STEP = pamsim.pressure_step((3e5, 3e5), (4.5e5, 1e5), duration=0.6, load=LOAD, sample_rate=100.0)


def rig_with(compliance=0.0, relaxation=0.01, **changes):
    chain = {"chain.compliance": compliance, "chain.relaxation_time": relaxation}
    return pamsim.load_rig("mas20_arm").with_parameters(chain | changes)


def play(size, **changes):
    return rig_with(**{"chain.backlash": size}, **NO_LOOP, **changes)


def swing(rig):
    """Turning points [rad] of an arm that is let go between two shut muscles."""
    model = rig.model_for(load=LOAD, command="valve", timestep=2e-4)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, (2e5, 2e5))
    data.qpos[0] = 0.15
    angles = []
    with pamsim.live(model):
        for _ in range(10000):
            mujoco.mj_step(model, data)
            angles.append(float(data.qpos[0]))
    path = np.array(angles)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(path)))) + 1
    return np.abs(path[turns])


def test_shut_muscles_keep_an_arm_swinging_and_their_chains_bring_it_to_rest():
    """No friction but the chain's own, in its damper or where it slides on the sprocket."""
    loop = {"hysteresis.force_per_pressure": 0.0}
    rigid, chained = (swing(rig_with(c, 0.05, **loop, **FREE)) for c in (0.0, COMPLIANCE))
    assert len(rigid) > 6
    assert np.ptp(rigid) < 1e-4 * rigid[0]
    for turns, left in ((chained, 0.8), (swing(play(1e-3, **FREE)), 0.95)):
        assert len(turns) > 4
        assert np.all(np.diff(turns) < 0.0)
        assert turns[-1] < left * turns[0]


# --- play ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("load", [0.0, 1.2])
def test_a_loaded_arm_rests_where_its_tooth_stops_it(load):
    rest = pamsim.pressure_step((3e5, 2e5), (3e5, 2e5), duration=2.0, load=load)
    run = pamsim.simulate(play(PLAY), replace(rest, settle=6.0)).completed()
    assert np.degrees(np.ptp(run.angle)) < 1e-4
    tight = pamsim.simulate(play(0.0), rest).completed()
    moved = run.angle[0] - tight.angle[0]
    assert moved == pytest.approx(0.5 * PLAY / RADIUS, rel=0.02)


ARM = """
<mujoco><worldbody><body><joint name="elbow" axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5"/></body></worldbody>
<tendon>{}</tendon></mujoco>
"""
CORD = '<fixed name="cord{}"><joint joint="elbow" coef="{}"/></fixed>'


def test_only_two_muscles_on_both_sides_of_one_joint_share_a_chain():
    muscle = pamsim.load_rig("mas20_arm").muscles["muscle_1"]
    for coefs, partners in (
        ((-0.02, 0.02), [2.0, 1.0]),
        ((0.02, 0.02), [0.0, 0.0]),
        ((0.02,), [0.0]),
        ((-0.02, 0.02, 0.02), [0.0, 0.0, 0.0]),
    ):
        cords = "".join(CORD.format(i, coef) for i, coef in enumerate(coefs))
        spec = mujoco.MjSpec.from_string(ARM.format(cords))
        for i in range(len(coefs)):
            pamsim.attach(spec, tendon=f"cord{i}", muscle=muscle)
        found = pamsim.compile_model(spec).actuator_user[:, slot("partner")].tolist()
        assert found == partners, coefs


def test_a_chain_whose_ends_state_different_play_is_refused():
    rig = pamsim.load_rig("mas20_arm")
    for changes in (
        {"muscle_1:chain.backlash": PLAY},
        {"chain.backlash": PLAY, "muscle_2:chain.seating_damping": 500.0},
        {"chain.backlash": PLAY, "muscle_2:chain.tooth_compliance": 1e-6},
    ):
        with pytest.raises(InputError, match=r"\Amuscle_1 and muscle_2 share a chain: [^\n]*\Z"):
            pamsim.simulate(rig.with_parameters(changes), STEP)
