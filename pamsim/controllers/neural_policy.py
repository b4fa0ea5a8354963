"""A trained policy as a controller; its input is the observation of the environments."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pamsim.controllers.controller import Command, JointObservation, Observation
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.recordings.policy_file import PolicyFile, read_policy


@dataclass(frozen=True, kw_only=True, eq=False)
class NeuralPolicy:
    """Layers with tanh between them, from an observation to the mean action.

    ``policy`` holds their numbers, and the rig that they are for.
    """

    policy: PolicyFile

    @property
    def command(self) -> str:
        """``pressure_set`` or ``valve``, as in the environment it was trained in."""
        return self.policy.command

    @classmethod
    def read(cls, path: str | os.PathLike[str], rig: Rig) -> NeuralPolicy:
        """Read a policy from the ``.npz`` that ``pamsim train`` writes.

        Raises:
            InputError: if it is missing, no policy, or for a rig of other joints and muscles.
        """
        policy = read_policy(Path(path))
        own, needed = (*rig.joints, *rig.muscles), (*policy.joints, *policy.muscles)
        if own != needed:
            raise InputError(
                f"{path} is for joints and muscles {', '.join(needed)}; rig {rig.name!r} has"
                f" {', '.join(own)}"
            )
        return cls(policy=policy)

    def start(self, first: Observation) -> None:
        """No memory."""

    def step(self, observation: Observation, memory: None) -> tuple[Command, None]:
        """See `Controller.step`."""
        fields = JointObservation.__dataclass_fields__
        signals = [[getattr(each, name) or 0.0 for each in observation.joints] for name in fields]
        value = np.concatenate([*signals[:2], observation.pressure, *signals[2:]])
        action = self.action((value - self.policy.centre) / self.policy.scale)
        if self.command == "pressure_set":
            action = 0.5 * self.policy.supply * (action + 1.0)
        return tuple(action.tolist()), None

    def action(self, observation: FloatArray) -> FloatArray:
        """Mean actions (..., m) of scaled observations (..., 6j + m)."""
        value = observation
        *hidden, (weight, bias) = zip(self.policy.weights, self.policy.biases, strict=True)
        for inner, offset in hidden:
            value = np.tanh(value @ inner.T + offset)
        return np.clip(value @ weight.T + bias, -1.0, 1.0)
