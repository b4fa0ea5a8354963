"""Task 5 with gymnasium and stable-baselines3 around the plain simulation: follow a sine."""

import sys

import gymnasium
import mujoco
import numpy as np
from plain_arm import ATMOSPHERE, BAND, INDEX, LENGTH, SUPPLY, XML, flow, force, volume
from stable_baselines3 import PPO


class Arm(gymnasium.Env):
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
    observation_space = gymnasium.spaces.Box(-10.0, 10.0, (6,), np.float32)

    def __init__(self):
        self.model = mujoco.MjModel.from_xml_string(XML)
        self.data = mujoco.MjData(self.model)

    def _reference(self):
        return 0.4 * np.sin(2 * np.pi * 0.5 * self.data.time + self.phase)

    def _seen(self):
        found = self.data.qpos[0], self.data.qvel[0] / 5, *(self.pressure / 6e5), self._reference()
        return np.array([*found, np.cos(np.pi * self.data.time + self.phase)], np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        mujoco.mj_resetData(self.model, self.data)
        self.pressure, self.phase = (
            np.full(2, 2e5 + ATMOSPHERE),
            self.np_random.uniform(0, 2 * np.pi),
        )
        return self._seen(), {}

    def step(self, action):
        wanted, dt = 3e5 * (1 + np.clip(action, -1, 1)) + ATMOSPHERE, self.model.opt.timestep
        for _ in range(40):
            length = LENGTH + self.data.ten_length
            opening = np.clip((wanted - self.pressure) / BAND, -1, 1)
            out, inward = flow(self.pressure, ATMOSPHERE), flow(SUPPLY + ATMOSPHERE, self.pressure)
            air = np.where(opening > 0, opening * inward, opening * out)
            squeeze = (volume(length + 1e-6) - volume(length)) / 1e-6 * self.data.ten_velocity
            change = 287 * 293.15 * air - self.pressure * squeeze
            self.pressure = self.pressure + dt * INDEX * change / volume(length)
            self.pressure = np.clip(self.pressure, ATMOSPHERE, SUPPLY + ATMOSPHERE)
            self.data.ctrl[:] = -force(self.pressure - ATMOSPHERE, length)
            mujoco.mj_step(self.model, self.data)
        error = abs(self.data.qpos[0] - self._reference()) / np.radians(5)
        return self._seen(), -float(error), False, self.data.time >= 8.0, {}


policy = PPO("MlpPolicy", Arm(), n_steps=1024, seed=0, verbose=0)
policy.learn(int(sys.argv[1]))
policy.save("plain_policy")
arm = Arm()
seen, _ = arm.reset(seed=1)
missed = []
for _ in range(400):
    seen, *_ = arm.step(policy.predict(seen, deterministic=True)[0])
    missed.append(arm.data.qpos[0] - arm._reference())
print(f"RMS error {np.degrees(np.sqrt(np.mean(np.square(missed)))):.1f} deg")
