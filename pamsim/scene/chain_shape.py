"""Geometry of the drawn chain: strands from the sprocket over the guide rollers to the muscles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from pamsim.core.errors import EngineError
from pamsim.scene.muscle_shape import MOVING_REACH, Rgba, Solid, Vector, rod
from pamsim.scene.pose import object_id, site_pose

STEEL: Rgba = (0.50, 0.51, 0.53, 1.0)
_PLATE: Rgba = (0.40, 0.41, 0.43, 1.0)
_PITCH = 0.009525
"""Of a 3/8 in chain (ISO 606, 06B) [m]; drawn is the nearest that fits a whole number of teeth."""
_ROLLER, _PIN, _LINK = 0.0031, 0.0015, 0.0039
"""Radii of the chain's rollers, of its pins and of the ends of its side plates [m]."""
_INNER, _OUTER, _THIN = 0.0037, 0.0050, 0.0006
"""Heights of inner and outer side plates off the chain's plane and their half thickness [m]."""


@dataclass(frozen=True, kw_only=True)
class _Strand:
    """One half of the chain: from the sprocket's far side over a guide roller to a muscle.

    The path is an arc on the sprocket, the common outer tangent, an arc on the roller, then a
    straight line. Coordinates are (along the muscles towards the arm, outwards), origin on the
    shaft.
    """

    origin: Vector
    axes: Vector  # (3, 2) the plane's two unit vectors in the world
    sprocket: float  # effective radius of the sprocket [m]
    guide: tuple[float, float]  # centre of the roller [m]
    roller: float  # radius of the roller [m]
    end: float  # where the chain ends, first coordinate [m]

    @property
    def departure(self) -> float:
        """Angle at which the chain leaves the sprocket, from the sprocket's far side [rad]."""
        distance = math.hypot(*self.guide)
        return math.atan2(self.guide[1], self.guide[0]) - math.acos(
            (self.sprocket - self.roller) / distance
        )

    @property
    def breaks(self) -> tuple[float, float, float, float]:
        """Path lengths at the ends of the four pieces [m]."""
        arc = self.sprocket * self.departure
        tangent = math.sqrt(
            self.guide[0] ** 2 + self.guide[1] ** 2 - (self.sprocket - self.roller) ** 2
        )
        bend = self.roller * (math.pi / 2 - self.departure)
        return (
            arc,
            arc + tangent,
            arc + tangent + bend,
            arc + tangent + bend + self.guide[0] - self.end,
        )

    def point(self, path: float) -> Vector:
        """Return the (3,) world point [m] at a path length [m] from the sprocket's far side."""
        arc, tangent, bend, _ = self.breaks
        theta = min(path, arc) / self.sprocket
        turn = theta
        centre = np.zeros(2)
        radius, straight = self.sprocket, max(min(path, tangent) - arc, 0.0)
        if path > tangent:
            turn = theta + (min(path, bend) - tangent) / self.roller
            centre, radius, straight = np.array(self.guide), self.roller, max(path - bend, 0.0)
        normal = np.array([math.cos(turn), math.sin(turn)])
        along = np.array([-normal[1], normal[0]])
        return self.origin + self.axes @ (centre + radius * normal + straight * along)


def chain_solids(
    model: mujoco.MjModel, data: mujoco.MjData, lengths: Sequence[float], *, fine: bool = True
) -> list[Solid]:
    """Lay the chain along both strands, turned by the shaft's angle, with a tooth in every gap.

    Args:
        model: a compiled rig with the sites the MJCF names.
        data: state after ``mj_forward``.
        lengths: (2,) active lengths of muscles 1 and 2 [m].
        fine: whether the links have rollers and round ends.

    Raises:
        EngineError: the model has no such object, or the sprocket's radius cannot be drawn.
    """
    joint = object_id(model, mujoco.mjtObj.mjOBJ_JOINT, "shaft")
    beta = float(data.qpos[model.jnt_qposadr[joint]])
    strand_1, strand_2 = (_strand(model, data, number, lengths[number - 1]) for number in (1, 2))
    hub, frame = site_pose(model, data, "sprocket")
    up, sprocket = frame[:, 2], strand_1.sprocket
    teeth = max(6, round(2.0 * math.pi * sprocket / _PITCH))
    pitch = 2.0 * math.pi * sprocket / teeth

    # Path lengths count from the sprocket's far side, positive towards muscle 1, which pulls the
    # chain by r beta. Half a link remains at either end, hidden in the clevis.
    first = math.ceil(-(strand_2.breaks[3] + sprocket * beta) / pitch)
    last = math.floor((strand_1.breaks[3] - sprocket * beta) / pitch)
    paths = [k * pitch + sprocket * beta for k in range(first, last + 1)]
    pins = [strand_1.point(path) if path >= 0.0 else strand_2.point(-path) for path in paths]
    ends = strand_2.point(strand_2.breaks[3]), strand_1.point(strand_1.breaks[3])

    solids = [_upright(hub, up, sprocket - _ROLLER, 0.0024, STEEL)]
    for k in range(teeth):
        angle = beta + (k + 0.5) * 2.0 * math.pi / teeth
        tip = hub + (sprocket + 0.0006) * strand_1.axes @ np.array(
            [math.cos(angle), math.sin(angle)]
        )
        solids.append(rod(hub, tip, 0.0017, STEEL, kind="capsule", gloss=0.8))
    for pin in (ends[0], *pins, ends[1]):
        if fine:
            solids.append(_upright(pin, up, _ROLLER, 0.0029, STEEL))
        solids.append(_upright(pin, up, _PIN, 0.0062, STEEL))
    for k, (a, b) in enumerate(pairwise((ends[0], *pins, ends[1])), start=first):
        solids += _link(a, b, up, _INNER if k % 2 else _OUTER, round_ends=fine)
    for end in ends:
        along = strand_1.axes[:, 0]
        solids += [
            _box(end - 0.0045 * along + side * 0.0067 * up, along, up, (0.0085, 0.0045, 0.0010))
            for side in (-1.0, 1.0)
        ]
        solids.append(_box(end - 0.0100 * along, along, up, (0.0030, 0.0045, 0.0077)))
    return solids


def _link(a: Vector, b: Vector, up: Vector, height: float, *, round_ends: bool) -> list[Solid]:
    """Join two pins by a plate above the chain's plane and one below."""
    reach = float(np.linalg.norm(b - a))
    if reach < 1e-6:  # the last pin may coincide with the end of the chain
        return []
    solids = []
    for shift in (-height * up, height * up):
        size = (reach / 2.0, 0.77 * _LINK, _THIN)
        solids.append(_box((a + b) / 2.0 + shift, (b - a) / reach, up, size, _PLATE))
        if round_ends:
            solids += [_upright(end + shift, up, _LINK, _THIN, _PLATE) for end in (a, b)]
    return solids


def _upright(centre: Vector, up: Vector, radius: float, half_height: float, rgba: Rgba) -> Solid:
    """Return a cylinder parallel to the shaft."""
    return rod(centre - half_height * up, centre + half_height * up, radius, rgba, gloss=0.8)


def _box(
    centre: Vector,
    along: Vector,
    up: Vector,
    size: tuple[float, float, float],
    rgba: Rgba = STEEL,
) -> Solid:
    """Return a box with its first axis along the chain and its third along the shaft."""
    axes = np.column_stack([along, np.cross(up, along), up])
    return Solid(kind="box", size=size, position=centre, rotation=axes, rgba=rgba)


def _strand(model: mujoco.MjModel, data: mujoco.MjData, number: int, length: float) -> _Strand:
    """Read one strand's path from the model's sites and tendon."""
    tendon = object_id(model, mujoco.mjtObj.mjOBJ_TENDON, f"chain_{number}")
    hub, hub_frame = site_pose(model, data, "sprocket")
    anchor, frame = site_pose(model, data, f"muscle_{number}_anchor")
    roller, _ = site_pose(model, data, f"muscle_{number}_guide")
    forward, side = frame[:, 2], np.cross(hub_frame[:, 2], frame[:, 2])
    axes = np.column_stack([forward, math.copysign(1.0, float(side @ (anchor - hub))) * side])
    along, outward = ((roller - hub) @ axes).tolist()
    sprocket = abs(float(model.wrap_prm[model.tendon_adr[tendon]]))
    pulley = float(model.site(f"muscle_{number}_guide").size[0])
    if not 2.0 * _ROLLER < sprocket < pulley + math.hypot(along, outward):
        raise EngineError(
            f"cannot draw a chain over a sprocket of radius {sprocket:g} m (chain_{number})"
        )
    return _Strand(
        origin=hub,
        axes=axes,
        sprocket=sprocket,
        guide=(along, outward),
        roller=pulley,
        end=float((anchor - hub) @ forward) + length + MOVING_REACH,
    )
