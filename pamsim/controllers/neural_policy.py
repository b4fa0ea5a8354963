"""A trained policy as a controller; its input is the observation of the environments."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pamsim.controllers.controller import Command, Observation
from pamsim.core.errors import InputError
from pamsim.store.policy_file import PolicyFile, read_policy

_INPUTS = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class NeuralPolicy:
    """Layers with tanh between them, from an observation to the mean action.

    Attributes:
        layers: the policy's numbers.
        supply: pressure that measured and commanded ones are scaled by [Pa].
        command: ``pressure`` or ``valve``, as in the environment it was trained in.
    """

    layers: PolicyFile
    supply: float
    command: str = "pressure_set"

    @classmethod
    def read(cls, path: Path, *, supply: float, command: str = "pressure_set") -> NeuralPolicy:
        """Read a policy from the ``.npz`` that scripts/train_policy.py writes.

        Raises:
            InputError: if it is missing, or none for these observations and actions.
        """
        layers = read_policy(path)
        if layers.scale.shape != (_INPUTS,) or layers.biases[-1].shape != (2,):
            raise InputError(
                f"{path} turns {len(layers.scale)} numbers into {len(layers.biases[-1])}; the arm"
                f" shows {_INPUTS} and takes 2"
            )
        return cls(layers=layers, supply=supply, command=command)

    def start(self, first: Observation) -> None:
        """No memory."""

    def act(self, observation: Observation, memory: None) -> tuple[Command, None]:
        """See `Controller.act`."""
        value = np.array(
            [
                observation.angle,
                observation.velocity,
                *(pressure / self.supply for pressure in observation.pressure),
                observation.reference,
                observation.reference_rate,
                observation.reference_acceleration,
                observation.stiffness or 0.0,
            ]
        )
        value = (value - self.layers.centre) / self.layers.scale
        *hidden, last = zip(self.layers.weights, self.layers.biases, strict=True)
        for weight, bias in hidden:
            value = np.tanh(weight @ value + bias)
        weight, bias = last
        first, second = np.clip(weight @ value + bias, -1.0, 1.0).tolist()
        if self.command == "pressure_set":
            half = 0.5 * self.supply
            return (half * (first + 1.0), half * (second + 1.0)), None
        return (first, second), None
