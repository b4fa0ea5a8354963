"""The drawn chain: two strands from the sprocket over guide rollers to the muscles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import mujoco
import numpy as np

from pamsim.core.errors import EngineError
from pamsim.scene.muscle_shape import MOVING_REACH
from pamsim.scene.pose import object_id, site_pose
from pamsim.scene.solids import CAPSULE, Rgba, Vector, add_box, add_rod

STEEL: Rgba = (0.50, 0.51, 0.53, 1.0)
_PLATE: Rgba = (0.40, 0.41, 0.43, 1.0)
_GLOSS = 0.8
_PITCH = 0.009525
"""Of a 3/8 in chain (ISO 606, 06B) [m]; drawn is the nearest that fits a whole number of teeth."""
_ROLLER, _PIN, _LINK = 0.0031, 0.0015, 0.0039
"""Radii of the chain's rollers, of its pins and of the ends of its side plates [m]."""
_INNER, _OUTER, _THIN = 0.0037, 0.0050, 0.0006
"""Heights of inner and outer side plates off the chain's plane and their half thickness [m]."""
# Boxes of the clevis at a chain's end: centre and halves along the chain, across, up [m].
_CLEVIS = (
    ((-0.0045, 0.0, -0.0067), (0.0085, 0.0045, 0.0010)),
    ((-0.0045, 0.0, 0.0067), (0.0085, 0.0045, 0.0010)),
    ((-0.0100, 0.0, 0.0), (0.0030, 0.0045, 0.0077)),
)


class Strand:
    """One half of the chain: from the sprocket's far side over a guide roller to a muscle.

    The path is an arc on the sprocket, the common outer tangent, an arc on the roller, then a
    straight line. Coordinates are (along the muscles towards the arm, outwards), origin on the
    shaft. It is that of muscle 1 or 2 at an active length [m].

    Attributes:
        axes: (3, 2) the plane's two unit vectors in the world.
        sprocket: effective radius of the sprocket [m].
        breaks: (4,) path lengths at the ends of the four pieces [m].

    Raises:
        EngineError: the model has no such object, or the sprocket's radius cannot be drawn.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, number: int, length: float
    ) -> None:
        tendon = object_id(model, mujoco.mjtObj.mjOBJ_TENDON, f"chain_{number}")
        self._hub, hub_frame = site_pose(model, data, "sprocket")
        anchor, frame = site_pose(model, data, f"muscle_{number}_anchor")
        roller, _ = site_pose(model, data, f"muscle_{number}_guide")
        forward, side = frame[:, 2], np.cross(hub_frame[:, 2], frame[:, 2])
        outward = math.copysign(1.0, side @ (anchor - self._hub)) * side
        self.axes = np.column_stack([forward, outward])
        self._guide = (roller - self._hub) @ self.axes
        distance = math.hypot(*self._guide)
        self._pulley = float(model.site(f"muscle_{number}_guide").size[0])
        self.sprocket = abs(float(model.wrap_prm[model.tendon_adr[tendon]]))
        if not 2.0 * _ROLLER < self.sprocket < self._pulley + distance:
            raise EngineError(
                f"cannot draw a chain over a sprocket of radius {self.sprocket:g} m"
                f" (chain_{number})"
            )
        drop = math.acos((self.sprocket - self._pulley) / distance)
        self._departure = math.atan2(self._guide[1], self._guide[0]) - drop
        pieces = [
            self.sprocket * self._departure,
            distance * math.sin(drop),
            self._pulley * (math.pi / 2 - self._departure),
            self._guide[0] - ((anchor - self._hub) @ forward + length + MOVING_REACH),
        ]
        self.breaks = np.cumsum(pieces)

    def points(self, path: Vector) -> Vector:
        """(n, 3) world points [m] at path lengths (n,) [m] from the sprocket's far side."""
        arc, tangent, bend, _ = self.breaks
        turned = [0.0, self._departure, self._departure, math.pi / 2]
        turn = np.interp(path, [0.0, arc, tangent, bend], turned)[:, None]
        normal, along = (np.hstack([np.cos(a), np.sin(a)]) for a in (turn, turn + math.pi / 2))
        guided = path[:, None] > tangent
        straight = np.maximum(path[:, None] - np.where(guided, bend, arc), 0.0)
        radius = np.where(guided, self._pulley, self.sprocket)
        flat = np.where(guided, self._guide, 0.0) + radius * normal + straight * along
        return self._hub + flat @ self.axes.T


def add_chain(
    scene: mujoco.MjvScene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    lengths: Sequence[float],
    *,
    fine: bool = True,
) -> None:
    """Lay the chain along both strands, turned by the shaft's angle, with a tooth in every gap.

    It ends where muscles 1 and 2 of active lengths (2,) [m] do. Fine links have rollers and round
    ends.

    Raises:
        EngineError: as `Strand`.
    """
    joint = object_id(model, mujoco.mjtObj.mjOBJ_JOINT, "shaft")
    beta = float(data.qpos[model.jnt_qposadr[joint]])
    strand_1, strand_2 = (Strand(model, data, number, lengths[number - 1]) for number in (1, 2))
    hub, frame = site_pose(model, data, "sprocket")
    up, sprocket = frame[:, 2], strand_1.sprocket
    teeth = max(6, round(2.0 * math.pi * sprocket / _PITCH))
    pitch = 2.0 * math.pi * sprocket / teeth

    def upright(centre: Vector, radius: float, half: float, rgba: Rgba = STEEL) -> None:
        add_rod(scene, centre - half * up, centre + half * up, radius, rgba, gloss=_GLOSS)

    def box(centre: Vector, along: Vector, halves: Sequence[float], rgba: Rgba) -> None:
        axes = np.column_stack([along, np.cross(up, along), up])
        add_box(scene, centre, axes, halves, rgba)

    upright(hub, sprocket - _ROLLER, 0.0024)
    for angle in beta + (np.arange(teeth) + 0.5) * 2.0 * math.pi / teeth:
        outward = strand_1.axes @ (math.cos(angle), math.sin(angle))
        tip = hub + (sprocket + 0.0006) * outward
        add_rod(scene, hub, tip, 0.0017, STEEL, kind=CAPSULE, gloss=_GLOSS)

    # Path lengths count from the sprocket's far side, positive towards muscle 1, which pulls the
    # chain by r beta. Half a link remains at either end, hidden in the clevis.
    shift, back, ahead = sprocket * beta, -strand_2.breaks[3], strand_1.breaks[3]
    first = math.ceil((back - shift) / pitch)
    pins = np.arange(first, math.floor((ahead - shift) / pitch) + 1) * pitch + shift
    path = np.concatenate([[back], pins, [ahead]])
    points = np.where(path[:, None] >= 0.0, strand_1.points(path), strand_2.points(-path))
    for pin in points:
        if fine:
            upright(pin, _ROLLER, 0.0029)
        upright(pin, _PIN, 0.0062)
    for number, (a, b) in enumerate(pairwise(points), start=first):
        reach = float(np.linalg.norm(b - a))
        height = _INNER if number % 2 else _OUTER
        if reach < 1e-6:  # the last pin may coincide with the end of the chain
            continue
        for rise in (-height * up, height * up):
            halves = reach / 2.0, 0.77 * _LINK, _THIN
            box((a + b) / 2.0 + rise, (b - a) / reach, halves, _PLATE)
            for end in (a, b) if fine else ():
                upright(end + rise, _LINK, _THIN, _PLATE)
    along = strand_1.axes[:, 0]
    for end in (points[0], points[-1]):
        for (forward, _, rise), halves in _CLEVIS:
            box(end + forward * along + rise * up, along, halves, STEEL)
