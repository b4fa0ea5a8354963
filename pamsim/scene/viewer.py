"""MuJoCo's interactive window with muscles and plots drawn: pan, zoom, a slider for every control.

The window has a model and data of its own, into which `ArmViewer.show` copies what is to be seen:
no click in it can change a simulation. Its sliders are read from `ArmViewer.controls`.
"""

from __future__ import annotations

import copy
import sys
import threading
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
from numpy.typing import ArrayLike

from pamsim.core.errors import EngineError
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.physics.muscle import Muscle
from pamsim.scene.camera import fit_camera
from pamsim.scene.live_plots import COLUMN, placed
from pamsim.scene.picture import decorate
from pamsim.scene.pose import muscle_lengths

_HIDDEN_GROUP = 5  # of geoms, which a window hides by default
_CLOSING = 10.0  # longest wait for a window that closes [s]
_REMEDY = "to see an arm without one, write a film: `pamsim render`"


class ArmViewer:
    """A window on an arm; close it by `close` or a ``with`` block.

    Attributes:
        model: the window's own.
        data: the window's own.
    """

    def __init__(
        self, model: mujoco.MjModel, *, control_range: ArrayLike | None = None, note: str = ""
    ) -> None:
        """Open a window on a copy of a model, best through its ``scene.xml``, with a note over it.

        Control sliders range over (2,) or (nu, 2), in the controls' unit; as the model's if None.

        Raises:
            EngineError: without a display, in one line that names the fix.
        """
        self.model = copy.copy(model)
        # A window needs no force.
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
        if control_range is not None:
            self.model.actuator_ctrllimited[:] = 1
            self.model.actuator_ctrlrange[:] = control_range
        # The load is drawn by its weight, in discs that `decorate` adds.
        disc = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_GEOM, "load_disc")
        if disc >= 0:
            self.model.geom_group[disc] = _HIDDEN_GROUP
        self.data = mujoco.MjData(self.model)
        before = set(threading.enumerate())
        self._window = open_window(self.model, self.data)
        self._drawing = set(threading.enumerate()) - before
        self._fitted = False
        if note:
            self._window.set_texts((None, mujoco.mjtGridPos.mjGRID_TOPRIGHT, note, ""))

    def show(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        *,
        muscles: Mapping[str, Muscle],
        pressures: Sequence[float],
        lengths: Sequence[float] | None = None,
        controls: Sequence[float] | None = None,
        plots: Sequence[mujoco.MjvFigure] = (),
    ) -> None:
        """Show a state and read the sliders; nothing happens once the window is closed.

        Args:
            model: the one simulated; its bodies and joints are those of the window's.
            data: its state; not changed.
            muscles: of the rig, in actuator order.
            pressures: (m,) gauge [Pa], NaN where not known.
            lengths: (m,) active [m]; those at the state if None.
            controls: (nu,) where the sliders stand, in their unit; the data's if None.
            plots: drawn beside the arm, such as those of `LivePlots.figures`.

        Raises:
            EngineError: if the model has no site, tendon or geom that the drawing needs.
            InputError: if a length cannot be drawn.
        """
        if not self.is_running:
            return
        with self._window.lock():
            self.data.qpos[:], self.data.qvel[:] = data.qpos, data.qvel
            self.data.ctrl[:] = data.ctrl if controls is None else controls
            self.data.time = data.time
            self.model.body_mass[:], self.model.body_quat[:] = model.body_mass, model.body_quat
            mujoco.mj_forward(self.model, self.data)
            viewport, scene = self._window.viewport, self._window.user_scn
            if viewport.height and not self._fitted:
                column = COLUMN if plots else 0.0
                room = {"aspect": viewport.width / viewport.height, "column": column}
                fit_camera(self._window.cam, self.model, self.data, **room)
                self._fitted = True
            scene.ngeom = 0
            lengths = muscle_lengths(model, data) if lengths is None else lengths
            state = {"muscles": muscles, "pressures": pressures, "lengths": lengths}
            decorate(scene, self.model, self.data, **state)
        if plots:
            self._window.set_figures(placed(plots, viewport))
        self._window.sync()

    @property
    def controls(self) -> FloatArray:
        """(nu,) where the sliders stand, in the controls' unit: as last shown, or as moved."""
        return self.data.ctrl.copy()

    @property
    def is_running(self) -> bool:
        """Whether the window is open."""
        return bool(self._window.is_running())

    def close(self) -> None:
        """Close the window and wait until it is; closing twice is no error."""
        if self.is_running:
            self._window.close()
        for thread in self._drawing:  # at exit Python ends GLFW, and hangs if this still draws
            thread.join(_CLOSING)

    def __enter__(self) -> ArmViewer:
        return self

    def __exit__(self, *stopped: object) -> None:
        self.close()


def open_window(model: mujoco.MjModel, data: mujoco.MjData) -> Any:
    """Open MuJoCo's passive viewer, which keeps model and data; returns its handle.

    Raises:
        EngineError: without a display or its OpenGL; the text names the fix.
    """
    try:
        import glfw
    except ImportError as error:
        raise EngineError(f"the viewer needs the package glfw ({error}); {_REMEDY}") from error
    # Where MuJoCo cannot open its window it waits for it for ever, so that one of ours is tried.
    opened = None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the reason is said below, in our words
        if glfw.init():
            glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
            opened = glfw.create_window(64, 64, "pamsim", None, None)
            glfw.default_window_hints()
    if not opened:
        raise EngineError(
            "no window can be opened here: set DISPLAY, or run this on a desktop with OpenGL;"
            f" {_REMEDY}"
        )
    glfw.destroy_window(opened)
    try:
        from mujoco import viewer

        return viewer.launch_passive(model, data, show_left_ui=False)
    except RuntimeError as error:
        fix = "start it by mjpython in place of python" if sys.platform == "darwin" else _REMEDY
        raise EngineError(f"the viewer does not start ({error}); {fix}") from error


def window_model(rig: Rig, sliders: Mapping[str, tuple[float, float]]) -> mujoco.MjModel:
    """Model of a window on a rig loaded with its scene.

    It has sliders, name -> ends of its range, in any unit: none moves anything by itself.
    """
    spec = mujoco.MjSpec.from_file(str(rig.file.scene or rig.file.mjcf))
    for name, ends in sliders.items():
        slider = spec.add_actuator(name=name, ctrllimited=True, ctrlrange=ends)
        slider.trntype, slider.target = mujoco.mjtTrn.mjTRN_JOINT, next(iter(rig.joints))
    spec.visual.map.shadowclip = 4.0
    overview = spec.camera("overview")
    if overview is not None:
        spec.visual.global_.fovy = overview.fovy
    model = spec.compile()
    # The radius of a sprocket, by which its chain is drawn. The rig may have tendons of its own.
    model.wrap_prm[:] = rig.model.wrap_prm[: len(model.wrap_prm)]
    return model
