"""One log of a joint that a motor turns against two sealed muscles, as other labs record it.

The friction is no formula of the library: its steps are made here, between those of the engine.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import pamsim

pytestmark = pytest.mark.slow

DURATION, RATE = 28.0, 25.0
LEVEL, GIVES_IN = 0.25, 0.004  # torque of sliding friction [N m]; angle in which it builds up [rad]
NUISANCE = ("force.scale", "chamber.dead_volume")
FRICTION = {"coulomb_friction", "viscous_friction", "stribeck_friction"}
OTHERS = {"load_torque", "angle_lag"}


def motor_torque(time):
    """Slow swings of several sizes, holds among them [N m]."""
    knots = [0.0, 2.0, 4.0, 5.0, 8.0, 11.0, 12.0, 14.0, 16.0, 18.0, 19.0, 22.0, 25.0, 28.0]
    torque = [0.0, 2.0, -2.0, -2.0, 3.0, -3.0, -3.0, 1.0, -1.0, 1.0, 1.0, 3.0, -1.5, 0.0]
    return np.interp(time, knots, torque)


class Turned:
    """Turns the joint by a motor, against friction of Dahl's kind unless its level is 0."""

    def __init__(self, level):
        self.level, self.friction = level, 0.0

    def __call__(self, model, data):
        moved = float(data.qvel[0]) * model.opt.timestep
        if self.level > 0.0:
            # df/dq = (level / x)(1 - f sign(q') / level), integrated over the step.
            limit = math.copysign(self.level, moved)
            share = math.exp(-abs(moved) / GIVES_IN)
            self.friction = limit + (self.friction - limit) * share
        data.qfrc_applied[0] = float(motor_torque(max(data.time, 0.0))) - self.friction


def log(rig, level, path):
    """A log of the joint in a lab's own words and units."""
    still = pamsim.Experiment(
        drive="valve",
        command_time=np.array([0.0]),
        command_value=np.zeros((1, 2)),
        start_pressure=np.array([2.5e5, 2.5e5]),
        duration=DURATION,
        sample_rate=RATE,
    )
    run = pamsim.simulate(rig, still, each_step=Turned(level)).completed()
    rng = np.random.default_rng(5)
    columns = {
        "t [s]": run.time,
        "phi [deg]": np.degrees(run.angle) + 0.05 * rng.standard_normal(run.time.size),
        "p left [kPa]": (run.pressure[:, 0] + 300.0 * rng.standard_normal(run.time.size)) / 1e3,
        "p right [kPa]": (run.pressure[:, 1] + 300.0 * rng.standard_normal(run.time.size)) / 1e3,
        "motor torque [Nm]": motor_torque(run.time),
    }
    np.savetxt(
        path, np.column_stack(list(columns.values())), "%.6g", ",", comments="",
        header=",".join(columns),
    )  # fmt: skip
    return path


@pytest.fixture(scope="module")
def rig():
    rig = pamsim.load_rig("mas20_arm")
    rig.model.opt.timestep = 1e-3  # for synthetic data and fit
    return rig


def diagnosed(rig, level, folder):
    pamsim.import_log(
        log(rig, level, folder / "run.csv"),
        rig=rig,
        out=folder / "data",
        drive="muscle_1=sealed,muscle_2=sealed,shaft=torque",
        columns=["muscle_1.pressure=p left [kPa]", "muscle_2.pressure=p right [kPa]"],
    )
    return pamsim.diagnose(
        folder / "data", rig=rig, effects=sorted(FRICTION | OTHERS), nuisance=NUISANCE
    )


def test_friction_of_another_formula_is_found_in_one_log_of_a_sealed_joint(rig, tmp_path):
    found = diagnosed(rig, LEVEL, tmp_path)
    named = {effect.name for effect in found.effects}
    assert named, found.sentence
    assert named <= FRICTION, found.sentence


def test_nothing_is_claimed_of_the_same_joint_without_friction(rig, tmp_path):
    found = diagnosed(rig, 0.0, tmp_path)
    assert not found.effects, found.sentence
