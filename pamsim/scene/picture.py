"""Pictures of a rig without a screen.

Muscles, chain, gear teeth and load discs are not part of the model. They are added to the drawn
scene at the given lengths and pressures and do not change the dynamics. Their places are read from
named sites: ``muscle_1_anchor`` ... for the muscles in actuator order, ``sprocket`` with
``muscle_1_guide`` and ``muscle_2_guide`` for a chain, ``load_seat`` for the discs (the MJCF of
``mas20_arm`` says what each means). Parts without a site are not drawn.
"""

from __future__ import annotations

import copy
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from pamsim.core.errors import EngineError, InputError, nearest
from pamsim.engine.rig import load_rig
from pamsim.engine.simulate import simulate
from pamsim.physics.muscle import Muscle
from pamsim.recordings.experiment import pressure_step
from pamsim.recordings.pictures import write_picture
from pamsim.scene.parts import add_chain, add_load, add_muscle
from pamsim.scene.pose import fit_camera, has_site, muscle_lengths, pose, site_pose
from pamsim.scene.series_colours import series_rgb

_USUAL_LOAD, _USUAL_PRESSURES = 2.14, (487e3, 100e3)  # of the MAS-20 arm in its pictures [kg, Pa]
_COMPOSED_FOR = 1.6  # width over height of the pictures that the scenes' cameras are placed for
_OVERVIEW = "overview"  # camera that shows the whole rig
_QUICK_SLICES = 20  # sides of a cylinder in a quick picture
_NO_GL = (
    "cannot draw without a screen: set MUJOCO_GL=egl before Python starts and install libegl1 and"
    " libgl1-mesa-dri (software OpenGL)"
)


def picture_rest(
    path: Path,
    *,
    rig: str | os.PathLike[str] = "mas20_arm",
    pressures: Sequence[float] | None = None,
    load: float | None = None,
    camera: str = _OVERVIEW,
    size: tuple[int, int] = (1600, 1000),
) -> None:
    """Let a rig come to rest at gauge pressures (m,) [Pa] and write a picture of it, png or jpg.

    The rig, a shipped one or a folder, carries a load [kg]; if left out 2.14 kg, or nothing where
    none can be. Pressures left out are those of the MAS-20 arm in its pictures if the rig has such
    a pair of muscles, else half the supply's. The camera is one of its scene (without an
    ``overview``, one that shows the whole rig), the size is width and height [px].

    Raises:
        InputError: for an unknown rig, camera or picture format.
        EngineError: if OpenGL cannot start; the text names the fix.
    """
    loaded = load_rig(rig, scene=True)
    if load is None:
        load = _USUAL_LOAD if loaded.takes_load else 0.0
    if pressures is None:
        supplies = [muscle.valve.supply_pressure for muscle in loaded.muscles.values()]
        usual = len(supplies) == len(_USUAL_PRESSURES) and min(supplies) >= max(_USUAL_PRESSURES)
        pressures = _USUAL_PRESSURES if usual else [0.5 * supply for supply in supplies]
    experiment = pressure_step(pressures, pressures, duration=0.01, load=load)
    rest = simulate(loaded, experiment).completed()
    width, height = size
    model = loaded.model_for(load=load)
    show_whole(model, width=width, height=height)
    data = mujoco.MjData(model)
    pose(model, data, loaded.position_addresses, rest.positions[-1].tolist())
    filled = rest.pressure[-1].tolist()
    state = {"muscles": loaded.muscles, "pressures": filled}
    image = render_arm(model, data, **state, width=width, height=height, camera=camera)
    write_picture(path, image)


def chosen_camera(
    model: mujoco.MjModel, data: mujoco.MjData, camera: str, *, aspect: float
) -> str | mujoco.MjvCamera:
    """A scene's camera of that name; without an ``overview`` one that shows the whole rig.

    The picture has an aspect, width over height.

    Raises:
        InputError: for another camera that the scene does not have; the text lists those it has.
    """
    cameras = [model.camera(i).name for i in range(model.ncam)]
    if camera in cameras:
        return camera
    if camera != _OVERVIEW:
        raise InputError(f"no camera {camera!r} in this scene; {nearest(camera, cameras)}")
    free = mujoco.MjvCamera()
    fit_camera(free, model, data, aspect=aspect, column=0.0)
    return free


def render_arm(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    *,
    width: int = 1600,
    height: int = 1000,
    camera: str | mujoco.MjvCamera = _OVERVIEW,
    renderer: mujoco.Renderer | None = None,
    **state: Any,
) -> npt.NDArray[np.uint8]:
    """Draw the arm at the state in ``data``.

    Args:
        model: a compiled rig with the sites named above, best through its ``scene.xml``.
        data: state after ``mj_forward``.
        width: of the picture [px].
        height: of the picture [px].
        camera: one in the model by its name, or a free one; see `chosen_camera`.
        renderer: one from ``open_renderer`` to use again, for videos; its own size then counts.
        state: as `decorate` takes it: muscles, pressures, lengths, fine.

    Returns:
        (height, width, 3) picture, red, green, blue from 0 to 255.

    Raises:
        EngineError: OpenGL cannot start, or as `decorate`.
        InputError: the model has no such camera, or as `decorate`.
    """
    if isinstance(camera, str):
        camera = chosen_camera(model, data, camera, aspect=width / height)
    own = renderer or open_renderer(model, width=width, height=height)
    try:
        own.update_scene(data, camera=camera)
        decorate(own.scene, model, data, **state)
        return own.render()
    finally:
        if own is not renderer:
            own.close()


def show_whole(model: mujoco.MjModel, *, width: int, height: int) -> None:
    """Widen the cameras of a caller's own model so that no picture [px] is cut at its sides.

    A camera's angle is that of the picture's height; the scenes are composed for 16:10.

    Raises:
        InputError: for a picture without pixels.
    """
    _require_pixels(width, height)
    narrower = max(_COMPOSED_FOR * height / width, 1.0)
    half = np.radians(model.cam_fovy) / 2.0
    model.cam_fovy = np.degrees(2.0 * np.arctan(narrower * np.tan(half)))


def open_renderer(
    model: mujoco.MjModel, *, width: int, height: int, quick: bool = False
) -> mujoco.Renderer:
    """Start off-screen drawing of a width and a height [px]; the caller closes it.

    The renderer is large enough, whatever buffer size the model asks for. A quick one leaves out
    shadows and smoothing, which take most of the time of a frame where no graphics card draws it.

    Raises:
        InputError: for a picture without pixels, or with more than OpenGL can draw.
        EngineError: OpenGL cannot start.
    """
    _require_pixels(width, height)
    _draw_without_screen()
    model = copy.copy(model)
    view, quality = model.vis.global_, model.vis.quality
    view.offwidth, view.offheight = max(width, view.offwidth), max(height, view.offheight)
    if quick:
        quality.offsamples, quality.numslices = 0, min(_QUICK_SLICES, quality.numslices)
    try:
        renderer = mujoco.Renderer(model, height=height, width=width)
    except Exception as error:  # each OpenGL backend fails in its own way, from ImportError on
        reason = next(iter(str(error).splitlines()), repr(error))
        if "framebuffer" in reason:
            raise InputError(
                f"{width} x {height} pixels are more than OpenGL can draw here; choose fewer"
            ) from error
        raise EngineError(f"{_NO_GL} ({reason})") from error
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = not quick
    return renderer


def _require_pixels(width: int, height: int) -> None:
    if min(width, height) < 1:
        raise InputError(f"a picture of {width} x {height} pixels is none; give 1 or more of both")


def has_screen() -> bool:
    """Whether a window can be opened; taken for granted but on Linux."""
    return sys.platform != "linux" or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))


def _draw_without_screen() -> None:
    """Have MuJoCo draw by EGL where ``MUJOCO_GL`` asks for it, or nothing and there is no screen.

    MuJoCo chooses when it is imported: for a screen, whatever ``MUJOCO_GL`` is set to later. If EGL
    is not there, its error is shown.
    """
    chosen = os.environ.get("MUJOCO_GL", "")
    if chosen != "egl" and (chosen or has_screen()):
        return
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    try:
        from mujoco.egl import GLContext
    except (ImportError, AttributeError, OSError):
        return
    sys.modules[mujoco.Renderer.__module__].gl_context.GLContext = GLContext


def decorate(
    scene: mujoco.MjvScene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    *,
    muscles: Mapping[str, Muscle],
    pressures: Sequence[float],
    lengths: Sequence[float] | None = None,
    fine: bool = True,
) -> None:
    """Add muscles, chain, teeth and load discs to a scene, such as that of a renderer.

    Args:
        scene: the scene to add to, already updated from ``data``, or a viewer's ``user_scn``.
        model: a compiled rig with the named sites.
        data: state after ``mj_forward``.
        muscles: of the rig, in actuator order; those that push are not drawn.
        pressures: (m,) gauge [Pa]; the higher, the more a tube has of its muscle's colour; NaN
            where not known: grey.
        lengths: (m,) their active lengths [m]; those of the model's own muscles if None.
        fine: whether to draw the fibres of the muscles, and rollers and round plates of a chain.

    Raises:
        EngineError: the model has a chain's parts only in part, or the scene is full.
        InputError: a length cannot be drawn, or pressures or lengths are not one per muscle.
    """
    lengths = muscle_lengths(model, data) if lengths is None else lengths
    if not len(muscles) == len(pressures) == len(lengths):
        raise InputError(
            f"each of {len(muscles)} muscles needs a pressure and a length, got {len(pressures)}"
            f" and {len(lengths)}"
        )
    each = zip(muscles.values(), pressures, lengths, strict=True)
    for number, (muscle, pressure, length) in enumerate(each):
        site = f"muscle_{number + 1}_anchor"
        if muscle.braid is not None and has_site(model, site):
            anchor, frame = site_pose(model, data, site)
            look = pressure, series_rgb(number), muscle.braid
            add_muscle(scene, anchor, frame, length, *look, fibres=fine)
    if has_site(model, "sprocket"):
        add_chain(scene, model, data, lengths, fine=fine)
    if has_site(model, "load_seat"):
        add_load(scene, model, data)
