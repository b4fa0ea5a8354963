"""Parts that are drawn beside the model's own geoms: muscles, chain and load discs, as solids.

The solids have no mass, touch nothing and stay for one frame. A muscle follows its length as its
braid does: fibres of constant length and a constant number of turns, so a shorter muscle is thicker
and its braid opens. The chain has two strands from the sprocket over guide rollers to the muscles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import mujoco
import numpy as np

from pamsim.core.errors import EngineError, InputError
from pamsim.core.units import FloatArray
from pamsim.physics.braid import Braid
from pamsim.scene.pose import object_id, site_pose
from pamsim.scene.series_colours import Rgb

Rgba = tuple[float, float, float, float]
CYLINDER, CAPSULE = mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE
BOX, ELLIPSOID = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_ELLIPSOID
_NOBODY = int(mujoco.mjtObj.mjOBJ_UNKNOWN)
_ORIGIN, _UPRIGHT = np.zeros(3), np.eye(3)
_SHADOWLESS, _SHADOWY = int(mujoco.mjtCatBit.mjCAT_DECOR), int(mujoco.mjtCatBit.mjCAT_DYNAMIC)

DRAWN_FOR = 0.020
"""Inner diameter that the radii below are of, a MAS-20's [m]; others are drawn in proportion."""
WALL = 0.002
"""Wall thickness [m], taken as constant: a change of some 0.3 mm would not be seen."""
MOVING_REACH = 0.050
"""Distance from the end of the active length to the first pin of the chain [m]."""
FULL_PRESSURE = 600e3
"""Gauge pressure at which a muscle has the full colour of its curve [Pa]."""

_VENTED = (0.12, 0.14, 0.18)
_WHITE = (1.0, 1.0, 1.0)
_FIBRE_LIGHT = 0.35  # how much lighter than the tube its fibres are, as a share of the way to white
_UNKNOWN_RUBBER: Rgba = (0.42, 0.42, 0.43, 1.0)
_UNKNOWN_FIBRE: Rgba = (0.66, 0.66, 0.67, 1.0)
_ALUMINIUM: Rgba = (0.74, 0.76, 0.78, 1.0)
_STEEL: Rgba = (0.58, 0.59, 0.60, 1.0)

_NECK = DRAWN_FOR / 2 + WALL - 0.0005
_COUNT, _SEGMENTS, _THREAD = 8, 36, 0.00045
"""Fibres of either sense, straight pieces of each, and half their width [m]."""
# One end fitting outward from the active length: start [m], end [m], radius [m], colour; None: the
# muscle's own.
_FITTING: tuple[tuple[float, float, float, Rgba | None], ...] = (
    (-0.005, 0.014, 0.0155, None),
    (0.014, 0.0155, 0.0140, _STEEL),
    (0.0155, 0.023, 0.0150, None),
    (0.023, 0.031, 0.0100, _ALUMINIUM),
    (0.031, 0.034, 0.0080, _STEEL),
    (0.034, 0.0455, 0.0045, _STEEL),
)

_CHAIN_STEEL: Rgba = (0.50, 0.51, 0.53, 1.0)
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

_IRON: Rgba = (0.27, 0.27, 0.28, 1.0)
_IRON_DENSITY = 7300.0  # of the load discs, cast iron [kg/m^3]


def add_rod(
    scene: mujoco.MjvScene,
    start: FloatArray,
    end: FloatArray,
    radius: float,
    rgba: Rgba,
    *,
    kind: mujoco.mjtGeom = CYLINDER,
    gloss: float = 0.5,
    shadow: bool = True,
) -> None:
    """Add a solid between two points (3,) [m], with a radius [m], of a box half its thickness.

    Colour, opacity and gloss, its specular reflection, are from 0 to 1.

    Raises:
        EngineError: if the scene is full.
    """
    geom = add_box(scene, _ORIGIN, _UPRIGHT, _ORIGIN, rgba, gloss)
    mujoco.mjv_connector(geom, CYLINDER, radius, start, end)
    geom.type = kind
    if not shadow:
        geom.category = _SHADOWLESS


def add_box(
    scene: mujoco.MjvScene,
    centre: FloatArray,
    axes: FloatArray,
    halves: Sequence[float] | FloatArray,
    rgba: Rgba,
    gloss: float = 0.5,
) -> Any:
    """Add a box of half sizes (3,) [m] along the columns of its axes (3, 3); else as `add_rod`."""
    if scene.ngeom >= scene.maxgeom:
        raise EngineError(
            f"the scene is full ({scene.maxgeom} geoms): open it with a larger maxgeom"
        )
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, BOX, halves, centre, axes.flatten(), np.array(rgba, np.float32))
    # The call above leaves what memory held in these: whose geom it is, and how it is sorted.
    geom.objtype, geom.category, geom.transparent = _NOBODY, _SHADOWY, 0
    geom.specular = geom.shininess = gloss
    scene.ngeom += 1
    return geom


def outer_radius(length: float, braid: Braid) -> float:
    """Outer radius [m] of the cylindrical part at an active length [m], by constant fibres.

    Raises:
        InputError: no braid of this fibre can have that length.
    """
    straight = braid.nominal_length / math.cos(braid.fibre_angle)
    if not 0.0 < length < straight:
        raise InputError(f"muscle length {length} m cannot be drawn: allowed (0, {straight:.4f}) m")
    sine = math.sqrt(1.0 - (length / straight) ** 2)
    inner = braid.diameter / 2 * sine / math.sin(braid.fibre_angle)
    return inner + braid.diameter / DRAWN_FOR * WALL


def add_muscle(
    scene: mujoco.MjvScene,
    anchor: FloatArray,
    frame: FloatArray,
    length: float,
    pressure: float,
    colour: Rgb,
    braid: Braid,
    *,
    fibres: bool = True,
) -> None:
    """Add one muscle with its two end fittings; a chain begins `MOVING_REACH` beyond its end.

    The active length [m] starts at an anchor (3,) [m], along the third axis of a frame (3, 3). The
    tube has the more of its colour the higher the gauge pressure [Pa], and is grey if that is NaN.

    Raises:
        InputError: the length cannot be drawn.
    """
    axis, scale = frame[:, 2], braid.diameter / DRAWN_FOR
    radius = outer_radius(length, braid)
    rubber, fibre = _UNKNOWN_RUBBER, _UNKNOWN_FIBRE
    if not math.isnan(pressure):
        rubber = _mixed(_VENTED, colour, min(max(pressure / FULL_PRESSURE, 0.0), 1.0))
        fibre = _mixed(rubber[:3], _WHITE, _FIBRE_LIGHT)
    shoulder, semi_axis = _shoulder(radius, scale * _NECK)
    tube = shoulder, length - shoulder
    first, last = (anchor + at * axis for at in tube)
    add_rod(scene, first, last, radius, rubber)
    for at in tube if shoulder > 0.0 else ():
        ends = anchor + (at - semi_axis) * axis, anchor + (at + semi_axis) * axis
        add_rod(scene, *ends, radius, rubber, kind=ELLIPSOID)
    if fibres:
        turns = braid.nominal_length * math.tan(braid.fibre_angle) / (math.pi * braid.diameter)
        along = np.linspace(0.0, length, _SEGMENTS + 1)
        inward = np.clip(shoulder - np.minimum(along, length - along), 0.0, None)
        skin = radius * np.sqrt(1.0 - (inward / max(semi_axis, 1e-9)) ** 2)
        for thread in _helices(skin, along, turns) @ frame.T + anchor:
            for start, end in pairwise(thread):
                # Square: nobody sees it, and a box is drawn many times faster than a cylinder. Its
                # shadow would fall on the rubber right below.
                width = scale * _THREAD
                add_rod(scene, start, end, width, fibre, kind=BOX, gloss=0.2, shadow=False)
    for start, end, size, metal in _FITTING:
        for foot, outward in ((anchor, -axis), (anchor + length * axis, axis)):
            ends = foot + start * outward, foot + end * outward
            add_rod(scene, *ends, scale * size, metal or (*colour, 1.0), gloss=0.7)


def _helices(radius: FloatArray, along: FloatArray, turns: float) -> FloatArray:
    """(fibres, n, 3) points of both families of fibres on a skin around the third axis."""
    starts = np.arange(_COUNT) * (2.0 * math.pi / _COUNT)
    twist = 2.0 * math.pi * turns * along / along[-1]
    angle = np.concatenate([starts[:, None] + sense * twist for sense in (1.0, -1.0)])
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle + along], axis=-1)


def _mixed(one: Rgb, other: Rgb, share: float) -> Rgba:
    """A share of the way from one colour to another."""
    red, green, blue = (a + share * (b - a) for a, b in zip(one, other, strict=True))
    return red, green, blue, 1.0


def _shoulder(radius: float, neck: float) -> tuple[float, float]:
    """Length of the shoulder and axial semi-axis of the ellipsoid that rounds it [m].

    The ellipsoid joins the cylinder without a kink and has the neck's radius at the fitting.
    """
    if radius <= neck:
        return 0.0, 0.0
    slope = math.sqrt(1.0 - (neck / radius) ** 2)
    length = 0.010 + 1.4 * (radius - neck)
    # Close to the nominal length the ellipsoid is slender: its tip must end inside the fitting.
    length = min(length, 0.020 * slope / (1.0 - slope))
    return length, length / slope


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

    def points(self, path: FloatArray) -> FloatArray:
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

    def upright(centre: FloatArray, radius: float, half: float, rgba: Rgba = _CHAIN_STEEL) -> None:
        add_rod(scene, centre - half * up, centre + half * up, radius, rgba, gloss=_GLOSS)

    def box(centre: FloatArray, along: FloatArray, halves: Sequence[float], rgba: Rgba) -> None:
        axes = np.column_stack([along, np.cross(up, along), up])
        add_box(scene, centre, axes, halves, rgba)

    upright(hub, sprocket - _ROLLER, 0.0024)
    for angle in beta + (np.arange(teeth) + 0.5) * 2.0 * math.pi / teeth:
        outward = strand_1.axes @ (math.cos(angle), math.sin(angle))
        tip = hub + (sprocket + 0.0006) * outward
        add_rod(scene, hub, tip, 0.0017, _CHAIN_STEEL, kind=CAPSULE, gloss=_GLOSS)

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
            box(end + forward * along + rise * up, along, halves, _CHAIN_STEEL)


def add_load(scene: mujoco.MjvScene, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Draw as many discs as the load weighs, the model's one-kilogram disc shrunk to their core."""
    disc = mujoco.mjtObj.mjOBJ_GEOM, object_id(model, mujoco.mjtObj.mjOBJ_GEOM, "load_disc")
    seat, frame = site_pose(model, data, "load_seat")
    radius, up = float(model.site("load_seat").size[0]), frame[:, 2]
    mass = float(model.body_mass[object_id(model, mujoco.mjtObj.mjOBJ_BODY, "load")])
    top = mass / (_IRON_DENSITY * math.pi * radius**2)
    # The gaps between the discs show the core. Without load it sinks into the tip of the arm.
    core, half, middle = 0.001, 0.0005, -0.001
    if mass > 0.0:
        core, half, middle = 0.96 * radius, max(top / 2 - 0.001, 0.0005), top / 2
    own = [geom for geom in scene.geoms[: scene.ngeom] if (geom.objtype, geom.objid) == disc]
    for geom in own:
        geom.size[:] = core, core, half
        geom.pos[:] = seat + middle * up
    if mass <= 0.0:
        return
    add_rod(scene, seat, seat + (top + 0.004) * up, 0.005, _CHAIN_STEEL, gloss=0.8)
    if not own:  # a viewer's scene for additions holds none of the model's geoms
        add_rod(scene, seat, seat + 2.0 * half * up, core, _IRON)
    edges = np.linspace(0.0, top, max(1, round(mass / 0.5)) + 1)
    for low, high in zip(edges[:-1] + 0.0006, edges[1:] - 0.0006, strict=True):
        add_rod(scene, seat + low * up, seat + high * up, radius, _IRON, gloss=0.8)
