"""A trained policy: its numbers, an ``.npz`` of them, and the controller that they make.

Its input is the observation of the environments.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pamsim.controllers.controller import Command, JointObservation, Observation
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.recordings.array_files import read_arrays


@dataclass(frozen=True, kw_only=True, eq=False)
class PolicyFile:
    """Layers from a scaled observation of j joints and m muscles to an action, tanh between them.

    Attributes:
        joints: names of the rig's.
        muscles: names of the rig's.
        command: ``pressure_set`` or ``valve``.
        supply: pressure that is commanded by an action of 1 [Pa].
        centre: (6j + m,) subtracted from the observation [SI] first.
        scale: (6j + m,) that it is divided by then [SI].
        weights: of each layer, (out, in).
        biases: of each layer, (out,).
    """

    joints: tuple[str, ...]
    muscles: tuple[str, ...]
    command: str
    supply: float
    centre: FloatArray
    scale: FloatArray
    weights: tuple[FloatArray, ...]
    biases: tuple[FloatArray, ...]


def write_policy(path: Path, policy: PolicyFile) -> None:
    """Write a policy as an ``.npz``."""
    arrays: dict[str, Any] = {**vars(policy)}
    for name in ("weights", "biases"):
        arrays |= {f"{name[0]}_{k}": layer for k, layer in enumerate(arrays.pop(name))}
    np.savez_compressed(path, **arrays)


def read_policy(path: Path) -> PolicyFile:
    """Read a policy; InputError if the file is missing, none, or its layers do not fit."""
    arrays = read_arrays(path)
    depth = sum(name.startswith("w_") for name in arrays)
    try:
        policy = PolicyFile(
            joints=tuple(arrays["joints"].tolist()),
            muscles=tuple(arrays["muscles"].tolist()),
            command=str(arrays["command"]),
            supply=float(arrays["supply"]),
            centre=arrays["centre"].astype(np.float64),
            scale=arrays["scale"].astype(np.float64),
            weights=tuple(arrays[f"w_{k}"].astype(np.float64) for k in range(depth)),
            biases=tuple(arrays[f"b_{k}"].astype(np.float64) for k in range(depth)),
        )
    except KeyError as error:
        raise InputError(f"{path} is no policy: it has no array {error}") from None
    except (TypeError, ValueError):
        raise InputError(f"{path} is no policy: an array is not what its name says") from None
    inputs, actions = (6 * len(policy.joints) + len(policy.muscles),), (len(policy.muscles),)
    widths = [inputs, *(bias.shape for bias in policy.biases)]
    layers = [(*out, *into) for into, out in pairwise(widths)]
    scaled = policy.centre.shape == policy.scale.shape == inputs
    fit = layers == [weight.shape for weight in policy.weights] and widths[-1] == actions
    if not (depth and scaled and fit):
        raise InputError(f"{path} is no policy: its layers do not fit each other or its rig")
    return policy


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
