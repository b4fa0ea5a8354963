"""What the interactive window shows: a rig simulated in real time, or a recording in a loop."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence

import mujoco

from pamsim.core.errors import InputError
from pamsim.core.units import PA_PER_KPA
from pamsim.engine.rig import Rig
from pamsim.engine.state import pressures, reset, restore_state, save_state
from pamsim.engine.stepping import live
from pamsim.scene.live_plots import LivePlots
from pamsim.scene.pose import pose
from pamsim.scene.replay import Replay, require_pace
from pamsim.scene.viewer import ArmViewer, window_model

_LARGEST = 3.0  # end of an effect's slider, in units of its typical size
_NOTE = "Control: set points [kPa]; effects, 0 off, 1 typical"
_FRAME = 1.0 / 60.0  # between two frames [s]
_FALLEN_BEHIND = 0.25
"""Lag behind the clock from which on time is given up rather than caught up with [s]."""


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
