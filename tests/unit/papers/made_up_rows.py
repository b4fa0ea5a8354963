"""The printed rows answered in closed form, no engine: what a reproduction is checked by."""

from __future__ import annotations

import numpy as np

from pamsim.papers.printed_steps import STARTS, Row, start_pressures
from pamsim.recordings.printed import mas20_models
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.step_metrics import step_metrics
from tests.unit.identification.planted import second_order_step

PRINTED = mas20_models()
TIME = np.arange(3001) / 500.0
STEP = second_order_step(TIME, PRINTED["g2"]["T1_s"], PRINTED["g2"]["T2_s"])
SWING = 0.5 * np.exp(-1.5 * TIME) * np.sin(10.0 * TIME)
INCREMENT = 2.0 * np.pi / 2500.0


def course(step, error=0.0):
    """As the paper says: small steps with load swing, all others rise to the printed angle."""
    swings = step.size == "small" and step.load > 0.0
    return (step.angle + error) * (STEP / STEP[-1] + (SWING if swings else 0.0))


def row(step, angle):
    """A row with this course of the angle [rad]."""
    start = start_pressures(step, STARTS["vent"])
    moved = np.subtract(step.pressure, start)
    pressure = start + np.outer(1.0 - np.exp(-TIME / 0.3), moved)
    recording = Recording(
        time=TIME, joints={"shaft": "angle"}, positions=angle[:, None],
        velocities=np.gradient(angle, TIME)[:, None], pressure=pressure, tension=pressure * 3e-4,
        command=np.tile(np.sign(moved), (TIME.size, 1)), drive="valve", load=step.load,
        muscles=("muscle_1", "muscle_2"), outcome=Outcome.COMPLETED, message="completed",
        final_state=np.zeros(1), meta={"timestep_s": 2e-3, "sample_hz": 500.0},
    )  # fmt: skip
    return Row(
        step=step,
        start=start,
        recording=recording,
        metrics=step_metrics(TIME, angle),
        increment=INCREMENT,
    )
