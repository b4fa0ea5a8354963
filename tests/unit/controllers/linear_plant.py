"""G2 sampled under a held input, as a plant for controllers designed on it."""

from __future__ import annotations

import numpy as np
from scipy.signal import cont2discrete

from pamsim.controllers.controller import PressureSplit
from pamsim.controllers.model_based import LinearisationPoint
from pamsim.controllers.second_order_model import SecondOrderModel
from tests.unit.controllers.closed_loop import LEVEL, SUPPLY, observe

MODEL = SecondOrderModel(gain=3e-6, a1=0.066, a2=0.0092)
POINT = LinearisationPoint(
    split=PressureSplit(common=LEVEL, supply=SUPPLY), difference=2e4, angle=0.05
)


class LinearPlant:
    """Angle and rate about a trim point; ``disturbance`` adds to the input [Pa]."""

    def __init__(self, period, disturbance=lambda time: 0.0, state=(0.0, 0.0)):
        a, b = MODEL.matrices()
        whole = np.array(a), np.array(b), np.eye(2), np.zeros((2, 1))
        self._a, self._b, *_ = cont2discrete(whole, period, method="zoh")
        self._period, self._disturbance = period, disturbance
        self.state, self.time = np.array(state, dtype=float), 0.0

    def observation(self, wanted=(POINT.angle, 0.0, 0.0), difference=0.0):
        first, second = POINT.pressures(difference)
        return observe(
            angle=POINT.angle + float(self.state[0]),
            velocity=float(self.state[1]),
            pressure=(first, second),
            wanted=wanted,
        )

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
