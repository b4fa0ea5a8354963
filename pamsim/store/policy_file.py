"""A trained policy as plain numbers: an ``.npz`` of weights."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class PolicyFile:
    """Layers from a scaled observation to an action, tanh between them.

    Attributes:
        centre: (n,) subtracted from the observation first.
        scale: (n,) that it is divided by then.
        weights: of each layer, (out, in).
        biases: of each layer, (out,).
    """

    centre: FloatArray
    scale: FloatArray
    weights: tuple[FloatArray, ...]
    biases: tuple[FloatArray, ...]


def read_policy(path: Path) -> PolicyFile:
    """Read a policy.

    Raises:
        InputError: if the file is missing, no policy, or its layers do not fit each other.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: np.asarray(file[name], dtype=np.float64) for name in file.files}
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from None
    except ValueError:
        raise InputError(f"{path} is no .npz of numbers") from None
    depth = sum(name.startswith("w_") for name in arrays)
    try:
        policy = PolicyFile(
            centre=arrays["centre"],
            scale=arrays["scale"],
            weights=tuple(arrays[f"w_{k}"] for k in range(depth)),
            biases=tuple(arrays[f"b_{k}"] for k in range(depth)),
        )
    except KeyError as error:
        raise InputError(f"{path} is no policy: it has no array {error}") from None
    sizes = [policy.scale.shape, *(bias.shape for bias in policy.biases)]
    fit = [
        weight.shape == (*out, *into)
        for weight, (into, out) in zip(policy.weights, pairwise(sizes), strict=True)
    ]
    if not depth or policy.centre.shape != policy.scale.shape or not all(fit):
        raise InputError(f"{path} is no policy: its layers do not fit each other")
    return policy
