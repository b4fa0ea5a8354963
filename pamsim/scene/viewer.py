"""MuJoCo's interactive window with muscles and plots drawn: pan, zoom, a slider for every control.

It shows a rig simulated in real time, a recording in a loop, or any state: the window has a model
and data of its own, into which `ArmViewer.show` copies what is to be seen, so that no click in it
can change a simulation. Its sliders are read from `ArmViewer.controls`.
"""

from __future__ import annotations

import copy
import sys
import threading
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mujoco
from numpy.typing import ArrayLike

from pamsim.core.errors import EngineError, InputError
from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.engine.rig import Rig
from pamsim.engine.state import pressures, reset, restore_state, save_state
from pamsim.engine.stepping import live
from pamsim.physics.muscle import Muscle
from pamsim.scene.live_plots import COLUMN, LivePlots, placed
from pamsim.scene.picture import decorate
from pamsim.scene.pose import fit_camera, muscle_lengths, pose
from pamsim.scene.replay import Replay, require_pace

_HIDDEN_GROUP = 5  # of geoms, which a window hides by default
_CLOSING = 10.0  # longest wait for a window that closes [s]
_REMEDY = "to see an arm without one, write a film: `pamsim render`"
_LARGEST = 3.0  # end of an effect's slider, in units of its typical size
_NOTE = "Control: set points [kPa]; effects, 0 off, 1 typical"
_FRAME = 1.0 / 60.0  # between two frames [s]
_FALLEN_BEHIND = 0.25
"""Lag behind the clock from which on time is given up rather than caught up with [s]."""


class ArmViewer:
    """A window on an arm, with a model and data of its own; close it by `close` or ``with``."""

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


def watch_replay(replay: Replay, *, speed: float = 1.0) -> None:
    """Show a trial over and over until the window is closed; a speed of 1 is real time.

    Raises:
        InputError: if the speed is not positive.
        EngineError: without a display.
    """
    require_pace(speed=speed)
    rig = replay.rig
    model = rig.model_for(load=replay.trial.load)
    data = mujoco.MjData(model)
    curves = LivePlots(rig.names)
    with ArmViewer(window_model(rig, {})) as viewer:
        began = time.monotonic()
        while viewer.is_running:
            data.time = ((time.monotonic() - began) * speed) % replay.duration
            pose(model, data, rig.position_addresses, replay.positions(data.time))
            _show(viewer, rig, curves, model, data, replay.pressures(data.time))


def watch_live(
    rig: Rig,
    start: Sequence[float],
    *,
    load: float = 0.0,
    effects: Mapping[str, float] | None = None,
    with_effects: Callable[[Mapping[str, float]], Rig] | None = None,
) -> None:
    """Simulate a rig in real time, its set points and effects moved by the window's sliders.

    A machine too slow for real time shows the arm slowed down, not jumping.

    Args:
        rig: loaded with its scene.
        start: (m,) gauge pressures to start from [Pa].
        load: [kg].
        effects: name -> size at which its slider starts, in units of the effect's typical one.
        with_effects: the rig with its effects at other sizes; needed if there are effects.

    Raises:
        InputError: if the pressures do not fit the rig.
        EngineError: without a display.
    """
    highest = {name: muscle.valve.supply_pressure for name, muscle in rig.muscles.items()}
    for (name, most), wanted in zip(highest.items(), start, strict=False):
        if not 0.0 <= wanted <= most:
            raise InputError(
                f"{name}: {wanted / PA_PER_KPA:g} kPa is outside [0, {most / PA_PER_KPA:g}] kPa,"
                " what its supply can give"
            )
    model = rig.model_for(load=load)
    data = mujoco.MjData(model)
    reset(model, data, start)
    data.ctrl[:] = start
    sizes = dict(effects or {})
    sliders = {name: (0.0, most / PA_PER_KPA) for name, most in highest.items()}
    sliders |= dict.fromkeys(sizes, (0.0, _LARGEST))
    curves = LivePlots(rig.names)
    with live(model), ArmViewer(window_model(rig, sliders), note=_NOTE) as viewer:
        ahead = time.monotonic() - data.time
        while viewer.is_running:
            behind = time.monotonic() - ahead - data.time
            if behind > _FALLEN_BEHIND:
                ahead, behind = ahead + behind - _FALLEN_BEHIND, _FALLEN_BEHIND
            mujoco.mj_step(model, data, max(0, round(behind / model.opt.timestep)))
            controls = [*(data.ctrl / PA_PER_KPA), *sizes.values()]
            filled = pressures(model, data).tolist()
            _show(viewer, rig, curves, model, data, filled, controls)
            moved = viewer.controls
            data.ctrl[:] = moved[: len(highest)] * PA_PER_KPA
            wanted = dict(zip(sizes, moved[len(highest) :].tolist(), strict=True))
            if with_effects is not None and wanted != sizes:
                sizes, before = wanted, save_state(model, data)
                # Another model of the same rig has the same layout.
                model = with_effects(sizes).model_for(load=load)
                data = mujoco.MjData(model)
                restore_state(model, data, before)


def _show(
    viewer: ArmViewer,
    rig: Rig,
    curves: LivePlots,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    filled: Sequence[float],
    controls: Sequence[float] = (),
) -> None:
    """Show a state with its gauge pressures (m,) [Pa] until the next frame is due."""
    curves.add(data.time, data.qpos[rig.position_addresses].tolist(), filled)
    state = {"muscles": rig.muscles, "pressures": filled}
    viewer.show(model, data, **state, controls=controls, plots=curves.figures())
    time.sleep(_FRAME)
