"""Contacts between geoms: whether a model can have them, and which there are in given positions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray


def may_collide(model: mujoco.MjModel) -> bool:
    """Whether any geom of a model may touch another."""
    return bool(model.npair or model.geom_contype.any() or model.geom_conaffinity.any())


def contacts(
    model: mujoco.MjModel, addresses: Sequence[int], positions: NDArray[np.float64]
) -> dict[tuple[str, str], int]:
    """Pairs of geoms that touch, and in how many positions.

    Args:
        model: whose geoms.
        addresses: of joints in ``qpos``; the others are where the model begins.
        positions: (n, j) of these joints [rad or m].
    """
    data = mujoco.MjData(model)
    found: Counter[tuple[str, str]] = Counter()
    for row in positions:
        data.qpos[list(addresses)] = row
        mujoco.mj_fwdPosition(model, data)
        touching = data.contact.geom[data.contact.exclude == 0]
        found.update({(_name(model, int(one)), _name(model, int(two))) for one, two in touching})
    return dict(found)


def _name(model: mujoco.MjModel, geom: int) -> str:
    body = model.body(model.geom_bodyid[geom]).name
    return model.geom(geom).name or f"geom {geom} of {body}"
