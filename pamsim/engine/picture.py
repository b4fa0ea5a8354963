"""Pictures of the antagonistic arm without a screen.

Muscles, chain, gear teeth and load discs are no part of the model: they are added to the drawn
scene, follow the given lengths and pressures exactly, and add no degree of freedom to the dynamics.
All places are read from named sites (``muscle_1_anchor``, ``muscle_1_guide``, ``sprocket``,
``load_seat`` and so on; the rig's MJCF says what each means).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np
import numpy.typing as npt

from pamsim.core.errors import EngineError, InputError
from pamsim.engine.muscle_shape import (
    MOVING_REACH,
    Rgba,
    Solid,
    Vector,
    muscle_solids,
    rod,
)

_KINDS = {
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
}
_STEEL: Rgba = (0.50, 0.51, 0.53, 1.0)
_PLATE: Rgba = (0.40, 0.41, 0.43, 1.0)
_IRON: Rgba = (0.27, 0.27, 0.28, 1.0)
_IRON_DENSITY = 7300.0
"""Of the load discs, cast iron [kg/m^3]."""
_PITCH = 0.009525
"""Of a 3/8 in chain (ISO 606, 06B) [m]; drawn is the nearest that fits a whole number of teeth."""
_ROLLER, _PIN, _LINK = 0.0031, 0.0015, 0.0039
"""Radii of the chain's rollers, of its pins and of the ends of its side plates [m]."""
_INNER, _OUTER, _THIN = 0.0037, 0.0050, 0.0006
"""Heights of inner and outer side plates off the chain's plane and their half thickness [m]."""
_NO_GL = (
    "cannot draw without a screen: set MUJOCO_GL=egl before Python starts and install libegl1 and"
    " libgl1-mesa-dri (software OpenGL), or set MUJOCO_GL=osmesa"
)


def render_arm(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    *,
    pressures: Sequence[float],
    lengths: Sequence[float],
    width: int = 1600,
    height: int = 1000,
    camera: str = "overview",
    renderer: mujoco.Renderer | None = None,
) -> npt.NDArray[np.uint8]:
    """Draw the arm at the state in ``data``.

    Args:
        model: a compiled rig with the sites named above, best through its ``scene.xml``.
        data: state after ``mj_forward``.
        pressures: (2,) gauge pressures of muscles 1 and 2 [Pa]; they set the muscles' colour.
        lengths: (2,) active lengths of muscles 1 and 2 [m].
        width: picture width [px].
        height: picture height [px].
        camera: name of a camera in the model.
        renderer: one from ``open_renderer`` to use again, for videos; its own size then counts.

    Returns:
        (height, width, 3) picture, red, green, blue from 0 to 255.

    Raises:
        EngineError: OpenGL cannot start, or the model lacks a named site, tendon or camera.
        InputError: a length cannot be drawn, or not two muscles are given.
    """
    if renderer is None:
        renderer = open_renderer(model, width=width, height=height)
        try:
            return render_arm(
                model, data, pressures=pressures, lengths=lengths, camera=camera, renderer=renderer
            )
        finally:
            renderer.close()
    _id(model, mujoco.mjtObj.mjOBJ_CAMERA, camera)
    renderer.update_scene(data, camera=camera)
    decorate(renderer.scene, model, data, pressures=pressures, lengths=lengths)
    return renderer.render()


def open_renderer(model: mujoco.MjModel, *, width: int, height: int) -> mujoco.Renderer:
    """Start off-screen drawing; the caller closes it.

    Args:
        model: the model to draw.
        width: picture width [px].
        height: picture height [px].

    Returns:
        A renderer large enough for the picture, whatever buffer size the model asks for.

    Raises:
        EngineError: OpenGL cannot start.
    """
    view = model.vis.global_
    asked = view.offwidth, view.offheight
    view.offwidth, view.offheight = max(width, asked[0]), max(height, asked[1])
    try:
        return mujoco.Renderer(model, height=height, width=width)
    except (
        Exception
    ) as error:  # each OpenGL backend fails in its own way, from ImportError to FatalError
        raise EngineError(
            f"{_NO_GL} ({str(error).splitlines()[0] if str(error) else error!r})"
        ) from error
    finally:
        view.offwidth, view.offheight = asked


def decorate(
    scene: mujoco.MjvScene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    *,
    pressures: Sequence[float],
    lengths: Sequence[float],
) -> None:
    """Add muscles, chain, teeth and load discs to a scene, such as that of a renderer.

    Args:
        scene: the scene to add to, already updated from ``data``.
        model: a compiled rig with the named sites.
        data: state after ``mj_forward``.
        pressures: (2,) gauge pressures [Pa].
        lengths: (2,) active lengths [m].

    Raises:
        EngineError: the model lacks a named object, or the scene is full.
        InputError: a length cannot be drawn, or not two muscles are given.
    """
    if len(pressures) != 2 or len(lengths) != 2:
        raise InputError(
            f"two pressures and two lengths are needed, got {len(pressures)} and {len(lengths)}"
        )
    solids: list[Solid] = []
    for number in (1, 2):
        anchor, frame = _site(model, data, f"muscle_{number}_anchor")
        solids += muscle_solids(anchor, frame[:, 2], lengths[number - 1], pressures[number - 1])
    solids += _chain_solids(model, data, lengths)
    solids += _load_solids(scene, model, data)
    for solid in solids:
        _add(scene, solid)


@dataclass(frozen=True, kw_only=True)
class _Strand:
    """One half of the chain: from the wheel's far side over a guide roller to a muscle.

    The path is an arc on the wheel, the common outer tangent, an arc on the roller, then a straight
    line. Coordinates are (along the muscles towards the arm, outwards), origin on the shaft.
    """

    origin: Vector
    axes: Vector  # (3, 2) the plane's two unit vectors in the world
    wheel: float  # effective radius of the wheel [m]
    guide: tuple[float, float]  # centre of the roller [m]
    roller: float  # radius of the roller [m]
    end: float  # where the chain ends, first coordinate [m]

    @property
    def departure(self) -> float:
        """Angle at which the chain leaves the wheel, from the wheel's far side [rad]."""
        distance = math.hypot(*self.guide)
        return math.atan2(self.guide[1], self.guide[0]) - math.acos(
            (self.wheel - self.roller) / distance
        )

    @property
    def breaks(self) -> tuple[float, float, float, float]:
        """Path lengths at the ends of the four pieces [m]."""
        arc = self.wheel * self.departure
        tangent = math.sqrt(
            self.guide[0] ** 2 + self.guide[1] ** 2 - (self.wheel - self.roller) ** 2
        )
        bend = self.roller * (math.pi / 2 - self.departure)
        return (
            arc,
            arc + tangent,
            arc + tangent + bend,
            arc + tangent + bend + self.guide[0] - self.end,
        )

    def point(self, path: float) -> Vector:
        """Return the (3,) world point [m] at a path length [m] from the wheel's far side."""
        arc, tangent, bend, _ = self.breaks
        theta = min(path, arc) / self.wheel
        turn = theta
        centre = np.zeros(2)
        radius, straight = self.wheel, max(min(path, tangent) - arc, 0.0)
        if path > tangent:
            turn = theta + (min(path, bend) - tangent) / self.roller
            centre, radius, straight = np.array(self.guide), self.roller, max(path - bend, 0.0)
        normal = np.array([math.cos(turn), math.sin(turn)])
        along = np.array([-normal[1], normal[0]])
        return self.origin + self.axes @ (centre + radius * normal + straight * along)


def _chain_solids(
    model: mujoco.MjModel, data: mujoco.MjData, lengths: Sequence[float]
) -> list[Solid]:
    """Lay the chain along both strands, turned by the shaft's angle, with a tooth in every gap."""
    joint = _id(model, mujoco.mjtObj.mjOBJ_JOINT, "shaft")
    beta = float(data.qpos[model.jnt_qposadr[joint]])
    one, two = (_strand(model, data, number, lengths[number - 1]) for number in (1, 2))
    hub, frame = _site(model, data, "sprocket")
    up, wheel = frame[:, 2], one.wheel
    teeth = max(6, round(2.0 * math.pi * wheel / _PITCH))
    pitch = 2.0 * math.pi * wheel / teeth

    # Path lengths count from the wheel's far side, positive towards muscle 1, which pulls the chain
    # its way by r beta. Half a link remains at either end, out of sight in the clevis.
    first = math.ceil(-(two.breaks[3] + wheel * beta) / pitch)
    last = math.floor((one.breaks[3] - wheel * beta) / pitch)
    paths = [k * pitch + wheel * beta for k in range(first, last + 1)]
    pins = [one.point(path) if path >= 0.0 else two.point(-path) for path in paths]
    ends = two.point(two.breaks[3]), one.point(one.breaks[3])

    solids = [_upright(hub, up, wheel - _ROLLER, 0.0024, _STEEL)]
    for k in range(teeth):
        angle = beta + (k + 0.5) * 2.0 * math.pi / teeth
        tip = hub + (wheel + 0.0006) * one.axes @ np.array([math.cos(angle), math.sin(angle)])
        solids.append(rod(hub, tip, 0.0017, _STEEL, kind="capsule", gloss=0.8))
    for pin in (ends[0], *pins, ends[1]):
        solids.append(_upright(pin, up, _ROLLER, 0.0029, _STEEL))
        solids.append(_upright(pin, up, _PIN, 0.0062, _STEEL))
    for k, (a, b) in enumerate(pairwise((ends[0], *pins, ends[1])), start=first):
        solids += _link(a, b, up, _INNER if k % 2 else _OUTER)
    for end in ends:
        along = one.axes[:, 0]
        solids += [
            _box(end - 0.0045 * along + side * 0.0067 * up, along, up, (0.0085, 0.0045, 0.0010))
            for side in (-1.0, 1.0)
        ]
        solids.append(_box(end - 0.0100 * along, along, up, (0.0030, 0.0045, 0.0077)))
    return solids


def _link(a: Vector, b: Vector, up: Vector, height: float) -> list[Solid]:
    """Join two pins by a plate with round ends above the chain's plane and one below."""
    reach = float(np.linalg.norm(b - a))
    if reach < 1e-6:  # the last pin may coincide with the end of the chain
        return []
    solids = []
    for shift in (-height * up, height * up):
        size = (reach / 2.0, 0.77 * _LINK, _THIN)
        solids.append(_box((a + b) / 2.0 + shift, (b - a) / reach, up, size, _PLATE))
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
    rgba: Rgba = _STEEL,
) -> Solid:
    """Return a box with its first axis along the chain and its third along the shaft."""
    axes = np.column_stack([along, np.cross(up, along), up])
    return Solid(kind="box", size=size, position=centre, rotation=axes, rgba=rgba)


def _strand(model: mujoco.MjModel, data: mujoco.MjData, number: int, length: float) -> _Strand:
    """Read one strand's path from the model's sites and tendon."""
    tendon = _id(model, mujoco.mjtObj.mjOBJ_TENDON, f"chain_{number}")
    hub, hub_frame = _site(model, data, "sprocket")
    anchor, frame = _site(model, data, f"muscle_{number}_anchor")
    roller, _ = _site(model, data, f"muscle_{number}_guide")
    forward, side = frame[:, 2], np.cross(hub_frame[:, 2], frame[:, 2])
    axes = np.column_stack([forward, math.copysign(1.0, float(side @ (anchor - hub))) * side])
    along, outward = ((roller - hub) @ axes).tolist()
    wheel = abs(float(model.wrap_prm[model.tendon_adr[tendon]]))
    pulley = float(model.site(f"muscle_{number}_guide").size[0])
    if not 2.0 * _ROLLER < wheel < pulley + math.hypot(along, outward):
        raise EngineError(
            f"cannot draw a chain over a wheel of radius {wheel:g} m (chain_{number})"
        )
    return _Strand(
        origin=hub,
        axes=axes,
        wheel=wheel,
        guide=(along, outward),
        roller=pulley,
        end=float((anchor - hub) @ forward) + length + MOVING_REACH,
    )


def _load_solids(scene: mujoco.MjvScene, model: mujoco.MjModel, data: mujoco.MjData) -> list[Solid]:
    """Draw as many discs as the load weighs, the model's one-kilogram disc shrunk to their core."""
    disc = _id(model, mujoco.mjtObj.mjOBJ_GEOM, "load_disc")
    seat, frame = _site(model, data, "load_seat")
    radius, up = float(model.site("load_seat").size[0]), frame[:, 2]
    mass = float(model.body_mass[_id(model, mujoco.mjtObj.mjOBJ_BODY, "load")])
    top = mass / (_IRON_DENSITY * math.pi * radius**2)
    # The gaps between the discs show the core. Without load it sinks into the tip of the arm.
    core = (0.96 * radius, max(top / 2 - 0.001, 0.0005)) if mass > 0.0 else (0.001, 0.0005)
    for geom in scene.geoms[: scene.ngeom]:
        if geom.objtype == mujoco.mjtObj.mjOBJ_GEOM and geom.objid == disc:
            geom.size[:] = core[0], core[0], core[1]
            geom.pos[:] = seat + ((top / 2) if mass > 0.0 else -0.001) * up
    if mass <= 0.0:
        return []
    count = max(1, round(mass / 0.5))
    solids = [rod(seat, seat + (top + 0.004) * up, 0.005, _STEEL, gloss=0.8)]
    for k in range(count):
        low, high = k * top / count + 0.0006, (k + 1) * top / count - 0.0006
        solids.append(rod(seat + low * up, seat + high * up, radius, _IRON, gloss=0.8))
    return solids


def _site(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> tuple[Vector, Vector]:
    """Return position (3,) [m] and frame (3, 3) of a site in the world."""
    index = _id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    return data.site_xpos[index].copy(), data.site_xmat[index].reshape(3, 3).copy()


def _id(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    """Look a name up, or say which one a picture needs."""
    index = mujoco.mj_name2id(model, kind, name)
    if index < 0:
        what = kind.name.removeprefix("mjOBJ_").lower()
        raise EngineError(f"the picture needs a {what} named {name!r}, which this model lacks")
    return index


def _add(scene: mujoco.MjvScene, solid: Solid) -> None:
    """Append one solid to a scene."""
    if scene.ngeom >= scene.maxgeom:
        raise EngineError(
            f"the scene is full ({scene.maxgeom} geoms): open it with a larger maxgeom"
        )
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(
        geom,
        _KINDS[solid.kind],
        np.array(solid.size),
        solid.position,
        solid.rotation.flatten(),
        np.array(solid.rgba, dtype=np.float32),
    )
    # Decor casts no shadow; a muscle should.
    geom.category = mujoco.mjtCatBit.mjCAT_DYNAMIC
    geom.specular = solid.gloss
    geom.shininess = solid.gloss
    scene.ngeom += 1
