"""Controllers around the rig and around linear plants, as tests run them."""

from __future__ import annotations

import math

import numpy as np

import pamsim
from pamsim.controllers.controller import JointObservation, Observation

PERIOD = 0.02
SUPPLY = 6e5
LEVEL = 3e5


def observe(angle=0.0, velocity=0.0, pressure=(LEVEL, LEVEL), wanted=(0.0, 0.0, 0.0), **more):
    """An observation; ``wanted`` is the angle of the next sample and its two derivatives."""
    joint = JointObservation(
        position=angle,
        velocity=velocity,
        reference=wanted[0],
        reference_rate=wanted[1],
        reference_acceleration=wanted[2],
        **more,
    )
    return Observation(time=0.0, joints=(joint,), pressure=pressure)


def sine(frequency, degrees):
    """Time to (angle, rate, acceleration) of a sine."""
    w, a = 2.0 * math.pi * frequency, math.radians(degrees)
    return lambda t: (a * math.sin(w * t), a * w * math.cos(w * t), -a * w * w * math.sin(w * t))


def constant(angle):
    """Time to an angle that stays."""
    return lambda t: (angle, 0.0, 0.0)


class _Hook:
    """Lets a controller act at every period of a run."""

    def __init__(self, controller, wanted):
        self._controller, self._wanted = controller, wanted
        self._samples, self._memory, self._command = 0, None, None

    def __call__(self, model, data):
        if data.time < -1e-9:
            return
        if data.time > self._samples * PERIOD - 1e-9:
            self._samples += 1
            observation = observe(
                angle=float(data.qpos[0]),
                velocity=float(data.qvel[0]),
                pressure=tuple(pamsim.pressures(model, data).tolist()),
                wanted=self._wanted(self._samples * PERIOD),
            )
            if self._memory is None:
                self._memory = self._controller.start(observation)
            self._command, self._memory = self._controller.step(observation, self._memory)
        data.ctrl[:] = self._command


def run(rig, controller, wanted, duration, load=1.2):
    """Recording of a controller on a rig that starts at rest at equal pressures."""
    start = np.full(2, LEVEL)
    experiment = pamsim.Experiment(
        drive=controller.command,
        command_time=np.zeros(1),
        command_value=np.array([start if controller.command == "pressure_set" else np.zeros(2)]),
        start_pressure=start,
        duration=duration,
        sample_rate=1.0 / PERIOD,
        load=load,
        settle=1.0,
    )
    hook = _Hook(controller, wanted)
    return pamsim.simulate(rig, experiment, each_step=hook).completed()


def miss(recording, wanted, after=0.0):
    """RMS of angle less wanted angle [rad]."""
    goal = np.array([wanted(t)[0] for t in recording.time])
    return float(np.sqrt(np.mean((recording.angle - goal)[recording.time >= after] ** 2)))
