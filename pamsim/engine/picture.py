"""Pictures of the antagonistic arm without a screen.

The model holds only what moves with a joint. Muscles, chain, gear teeth and load discs are added to the drawn scene:
they follow the recorded lengths and pressures exactly and add no degree of freedom to the dynamics. All places are
read from named sites of the model (``muscle_1_anchor``, ``muscle_1_guide``, ``sprocket``, ``load_seat``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from pamsim.core.errors import EngineError, InputError
from pamsim.engine.muscle_shape import (
    MOVING_REACH,
    Rgba,
    Solid,
    Vector,
    frame_along,
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
_PITCH = 0.009525
"""Pitch of a 3/8 in chain (ISO 606, 06B) [m]; the drawn one is the nearest that gives a whole number of teeth."""
_IRON_DENSITY = 7300.0
_NO_GL = (
    "cannot start OpenGL without a screen: set MUJOCO_GL=egl before Python starts and install libegl1 and "
    "libgl1-mesa-dri (software rendering), or set MUJOCO_GL=osmesa"
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
    """Add muscles, chain, teeth and load discs to a drawn scene, for example a viewer's ``user_scn``.

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
    """One half of the chain in its plane: from the wheel's far side over a guide roller to a muscle.

    The path is an arc on the wheel, the common outer tangent, an arc on the roller, then a straight line. Coordinates
    are (along the muscles towards the arm, outwards), origin on the shaft.
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
    """Lay links along both strands and teeth between them, turned by the shaft's angle."""
    beta = float(data.qpos[model.jnt_qposadr[_id(model, mujoco.mjtObj.mjOBJ_JOINT, "shaft")]])
    one, two = (_strand(model, data, number, lengths[number - 1]) for number in (1, 2))
    wheel, (hub, frame) = one.wheel, _site(model, data, "sprocket")
    teeth = max(6, round(2 * math.pi * wheel / _PITCH))
    pitch, wound, up = 2 * math.pi * wheel / teeth, wheel * beta, frame[:, 2]

    first = math.ceil(-(two.breaks[3] + wound) / pitch)
    last = math.floor((one.breaks[3] - wound) / pitch)
    places = [k * pitch + wound for k in range(first, last + 1)]
    pins = [one.point(s) if s >= 0 else two.point(-s) for s in places]
    pins = [two.point(two.breaks[3]), *pins, one.point(one.breaks[3])]

    solids = [rod(hub - 0.0024 * up, hub + 0.0024 * up, wheel - 0.0031, _STEEL, gloss=0.8)]
    forward, side = one.axes.T
    for k in range(teeth):
        angle = beta + (k + 0.5) * 2 * math.pi / teeth
        out = math.cos(angle) * forward + math.sin(angle) * side
        solids.append(
            rod(hub, hub + (wheel + 0.0006) * out, 0.0017, _STEEL, kind="capsule", gloss=0.8)
        )
    for pin in pins:
        solids.append(rod(pin - 0.0029 * up, pin + 0.0029 * up, 0.0031, _STEEL, gloss=0.8))
        solids.append(rod(pin - 0.0062 * up, pin + 0.0062 * up, 0.0015, _STEEL, gloss=0.8))
    for k, (a, b) in enumerate(zip(pins[:-1], pins[1:], strict=True), start=first):
        span = b - a
        reach = float(np.linalg.norm(span))
        if reach < 1e-6:
            continue
        rotation = np.column_stack([span / reach, np.cross(up, span / reach), up])
        for height in (-1.0, 1.0):
            shift = height * (0.0037 if k % 2 else 0.0050) * up
            for end in (a, b):
                solids.append(
                    rod(end + shift - 0.0006 * up, end + shift + 0.0006 * up, 0.0039, _PLATE)
                )
            solids.append(
                Solid(
                    kind="box",
                    size=(reach / 2, 0.0030, 0.0006),
                    position=(a + b) / 2 + shift,
                    rotation=rotation,
                    rgba=_PLATE,
                )
            )
    for strand, pin in ((two, pins[0]), (one, pins[-1])):
        along = strand.axes[:, 0]
        for height in (-1.0, 1.0):
            solids.append(
                Solid(
                    kind="box",
                    size=(0.0085, 0.0045, 0.0010),
                    position=pin - 0.0045 * along + 0.0067 * height * up,
                    rotation=np.column_stack([along, np.cross(up, along), up]),
                    rgba=_STEEL,
                )
            )
        solids.append(
            Solid(
                kind="box",
                size=(0.0030, 0.0045, 0.0077),
                position=pin - 0.0100 * along,
                rotation=np.column_stack([along, np.cross(up, along), up]),
                rgba=_STEEL,
            )
        )
    return solids


def _strand(model: mujoco.MjModel, data: mujoco.MjData, number: int, length: float) -> _Strand:
    """Read one strand's path from the model's sites and tendon."""
    tendon = _id(model, mujoco.mjtObj.mjOBJ_TENDON, f"chain_{number}")
    hub, hub_frame = _site(model, data, "sprocket")
    anchor, frame = _site(model, data, f"muscle_{number}_anchor")
    roller, _ = _site(model, data, f"muscle_{number}_guide")
    forward, side = frame[:, 2], np.cross(hub_frame[:, 2], frame[:, 2])
    axes = np.column_stack([forward, math.copysign(1.0, float(side @ (anchor - hub))) * side])
    along, outward = ((roller - hub) @ axes).tolist()
    return _Strand(
        origin=hub,
        axes=axes,
        wheel=abs(float(model.wrap_prm[model.tendon_adr[tendon]])),
        guide=(along, outward),
        roller=float(model.site(f"muscle_{number}_guide").size[0]),
        end=float((anchor - hub) @ forward) + length + MOVING_REACH,
    )


def _load_solids(
    scene: mujoco.MjvScene, model: mujoco.MjModel, data: mujoco.MjData
) -> list[Solid]:
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
