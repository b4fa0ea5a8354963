"""Controllers around the rig and around linear plants, as tests run them."""

import math
from contextlib import closing

import gymnasium
import numpy as np
from scipy.signal import cont2discrete

from pamsim.controllers.controller import JointObservation, Observation, PressureSplit
from pamsim.controllers.model_based import LinearisationPoint
from pamsim.controllers.second_order_model import SecondOrderModel
from pamsim.envs import ENVIRONMENT
from pamsim.envs.closed_loop import run_episode
from pamsim.envs.tasks import TaskSignals

PERIOD = 0.02
SUPPLY = 6e5
LEVEL = 3e5
SPLIT = PressureSplit(common=LEVEL, supply=SUPPLY)
MODEL = SecondOrderModel(gain=3e-6, a1=0.066, a2=0.0092)
POINT = LinearisationPoint(split=SPLIT, difference=2e4, angle=0.05)


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


def out_of_reach_and_back(time):
    """An angle that the pressures cannot reach for 6 s, then one that they can."""
    return (3.0 if time < 6.0 else 0.2), 0.0, 0.0


def run(rig, controller, wanted, duration):
    """Episode of a controller on a rig with a load that starts at rest at equal pressures."""

    def task(rng, time, reach):
        free = np.zeros(time.size)
        angle, rate, acceleration = np.array([wanted(t) for t in time.tolist()]).T
        signals = {"position": angle, "velocity": rate, "acceleration": acceleration}
        return TaskSignals(**signals, stiffness=free, torque=free)

    own = {"rig": rig, "action": controller.command, "task": task, "load": 1.2}
    env = gymnasium.make(ENVIRONMENT, **own, max_episode_steps=round(duration / PERIOD))
    with closing(env):
        return run_episode(env, controller, seed=0)


def miss(episode, after):
    """RMS of angle less wanted angle [rad] after a time [s]."""
    error = (episode.position - episode.reference)[round(after / PERIOD) :]
    return float(np.sqrt(np.mean(error**2)))


class LinearPlant:
    """G2 sampled under a held input, about a trim point; ``disturbance`` adds to the input [Pa]."""

    def __init__(self, period, disturbance=lambda time: 0.0, state=(0.0, 0.0)):
        a, b = MODEL.matrices()
        whole = np.array(a), np.array(b), np.eye(2), np.zeros((2, 1))
        self._a, self._b, *_ = cont2discrete(whole, period, method="zoh")
        self._period, self._disturbance = period, disturbance
        self.state, self.time = np.array(state, dtype=float), 0.0

    def observation(self, wanted=(POINT.angle, 0.0, 0.0), difference=0.0):
        angle, velocity = self.state.tolist()
        pressure = POINT.pressures(difference)
        return observe(POINT.angle + angle, velocity, pressure, wanted)

    def take(self, command):
        departure = command[0] - command[1] - POINT.difference + self._disturbance(self.time)
        self.state = self._a @ self.state + self._b[:, 0] * departure
        self.time += self._period

    def close(self, controller, wanted, samples):
        """Angles [rad] at every sample under a controller, and its memory at the end."""
        memory, angles = controller.start(self.observation()), []
        for _ in range(samples):
            angles.append(POINT.angle + self.state[0])
            observation = self.observation(wanted(self.time + self._period))
            command, memory = controller.step(observation, memory)
            self.take(command)
        return np.array(angles), memory
