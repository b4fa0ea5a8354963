"""Play of the chain in the engine: no hunting, nothing gained, and a gap where the torque turns."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.physics.record import slot

PLAY = 3e-4
RADIUS = 12.1276e-3
NO_LOOP = {"hysteresis.force_per_pressure": 0.0, "braid.extensibility": 0.0}
"""Muscles whose force depends on length and pressure alone, linear in pressure."""


def rig_with(play, **changes):
    return pamsim.load_rig("mas20_arm").with_parameters({"chain.backlash": play} | changes)


@pytest.mark.parametrize("load", [0.0, 1.2])
def test_a_loaded_arm_rests_where_its_tooth_stops_it(load):
    rest = pamsim.pressure_step((3e5, 2e5), (3e5, 2e5), duration=3.0, load=load)
    run = pamsim.simulate(
        rig_with(PLAY, **NO_LOOP), dataclasses.replace(rest, settle=6.0)
    ).completed()
    assert np.degrees(np.ptp(run.angle)) < 1e-4
    tight = pamsim.simulate(rig_with(0.0, **NO_LOOP), rest).completed()
    moved = run.angle[0] - tight.angle[0]
    assert moved == pytest.approx(0.5 * PLAY / RADIUS, rel=0.02)


def driven(rig, seconds=4.0):
    """Angle and rate of an arm turned slowly to and fro by its pressures."""
    time = np.arange(round(seconds * 100)) / 100.0
    swing = 1e5 * np.abs(np.mod(time / 2.0 + 0.25, 1.0) - 0.5) * 4.0 - 1e5
    experiment = pamsim.Experiment(
        drive="pressure_set",
        command_time=time,
        command_value=np.stack([2.5e5 - swing, 2.5e5 + swing], axis=1),
        start_pressure=np.array([2.5e5 - swing[0], 2.5e5 + swing[0]]),
        duration=seconds,
        sample_rate=100.0,
    )
    return pamsim.simulate(rig, experiment).completed()


def test_after_a_reversal_it_stands_still_for_the_play():
    """Running either way it lags by half the play: all of it is lost where the torque turns.

    Two plays are compared: what the chain lags besides, sliding into its tooth, is the same.
    """
    tight = driven(rig_with(0.0, **NO_LOOP))
    late = tight.time > 2.0

    def lags(play):
        lag = tight.angle - driven(rig_with(play, **NO_LOOP)).angle
        return [np.median(lag[late & (sign * tight.velocity > 0.25)]) for sign in (1.0, -1.0)]

    more = np.subtract(lags(1e-3), lags(PLAY))
    half = 0.5 * (1e-3 - PLAY) / RADIUS
    assert more == pytest.approx([half, -half], rel=0.02)


def test_between_shut_muscles_a_swinging_arm_only_loses():
    """No friction but the chain's own: turning points come ever closer to rest."""
    rig = rig_with(1e-3, **NO_LOOP, **{"joint.shaft.damping": 0.0, "body.rig.tilt": 0.0})
    model = rig.model_for(load=1.2, command="valve", timestep=2e-4)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, (2e5, 2e5))
    data.qpos[0] = 0.15
    path = []
    with pamsim.live(model):
        for _ in range(10000):
            mujoco.mj_step(model, data)
            path.append(float(data.qpos[0]))
    turns = np.flatnonzero(np.diff(np.sign(np.diff(path)))) + 1
    heights = np.abs(np.array(path)[turns])
    assert len(heights) > 4
    assert np.all(np.diff(heights) < 0.0)
    assert heights[-1] < 0.95 * heights[0]


ARM = """
<mujoco><worldbody><body><joint name="elbow" axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5"/></body></worldbody>
<tendon>{}</tendon></mujoco>
"""
CORD = '<fixed name="cord{}"><joint joint="elbow" coef="{}"/></fixed>'


def partners(*coefs):
    cords = "".join(CORD.format(i, coef) for i, coef in enumerate(coefs))
    spec = mujoco.MjSpec.from_string(ARM.format(cords))
    muscle = pamsim.load_rig("mas20_arm").muscles["muscle_1"]
    for i in range(len(coefs)):
        pamsim.attach(spec, tendon=f"cord{i}", muscle=muscle)
    return pamsim.compile_model(spec).actuator_user[:, slot("partner")].tolist()


def test_only_two_muscles_on_both_sides_of_one_joint_share_a_chain():
    assert partners(-0.02, 0.02) == [2.0, 1.0]
    assert partners(0.02, 0.02) == [0.0, 0.0]
    assert partners(0.02) == [0.0]
    assert partners(-0.02, 0.02, 0.02) == [0.0, 0.0, 0.0]


def test_a_chain_whose_ends_state_different_play_is_refused():
    step = pamsim.pressure_step((3e5, 3e5), (4e5, 2e5), duration=0.1)
    rig = pamsim.load_rig("mas20_arm")
    for changes in (
        {"muscle_1:chain.backlash": PLAY},
        {"chain.backlash": PLAY, "muscle_2:chain.seating_damping": 500.0},
    ):
        with pytest.raises(InputError, match=r"\Amuscle_1 and muscle_2 share a chain: [^\n]*\Z"):
            pamsim.simulate(rig.with_parameters(changes), step)
