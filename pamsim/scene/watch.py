"""What the interactive window shows: a rig simulated in real time, or a recording in a loop."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import PA_PER_KPA
from pamsim.engine.rig import Rig
from pamsim.engine.state import pressures, reset
from pamsim.engine.stepping import live
from pamsim.scene.pose import muscle_lengths, pose
from pamsim.scene.replay import Replay
from pamsim.scene.viewer import ArmViewer

OpenViewer = Callable[..., ArmViewer]

_FRAME = 1.0 / 60.0
"""Between two frames [s]."""
_FALLEN_BEHIND = 0.25
"""Lag behind the clock from which on time is given up rather than caught up with [s]."""


def watch_replay(
    replay: Replay,
    *,
    speed: float = 1.0,
    open_viewer: OpenViewer = ArmViewer,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Show a trial over and over until the window is closed.

    Args:
        replay: of `read_replay`.
        speed: 1 for real time.
        open_viewer: makes the window.
        clock: seconds that pass [s].
        sleep: waits for some of them [s].

    Raises:
        InputError: if the speed is not positive.
        EngineError: without a display.
    """
    if not 0.0 < speed < np.inf:
        raise InputError(f"`speed` {speed:g} must be above 0")
    model = replay.rig.model_for(load=replay.trial.load)
    data = mujoco.MjData(model)
    with open_viewer(model) as viewer:
        began = clock()
        while viewer.is_running:
            now = ((clock() - began) * speed) % replay.duration
            pose(model, data, replay.rig.position_addresses, replay.positions(now))
            data.time = now
            viewer.show(
                model, data, pressures=replay.pressures(now), lengths=muscle_lengths(model, data)
            )
            sleep(_FRAME)


def watch_live(
    rig: Rig,
    start: Sequence[float],
    *,
    load: float = 0.0,
    open_viewer: OpenViewer = ArmViewer,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Simulate a rig in real time, its set points moved by the window's sliders.

    A machine too slow for real time shows the arm slowed down, not jumping.

    Args:
        rig: loaded with its scene.
        start: (m,) gauge pressures to start from [Pa].
        load: [kg].
        open_viewer: makes the window.
        clock: seconds that pass [s].
        sleep: waits for some of them [s].

    Raises:
        InputError: if the pressures do not fit the rig.
        EngineError: without a display.
    """
    highest = [muscle.valve.supply_pressure for muscle in rig.muscles.values()]
    for name, wanted, most in zip(rig.muscles, start, highest, strict=False):
        if not 0.0 <= wanted <= most:
            raise InputError(
                f"{name}: {wanted / PA_PER_KPA:g} kPa is outside [0, {most / PA_PER_KPA:g}] kPa,"
                " what its supply can give"
            )
    model = rig.model_for(load=load)
    data = mujoco.MjData(model)
    reset(model, data, start)
    data.ctrl[:] = start
    ranges = [(0.0, most) for most in highest]
    with live(model), open_viewer(model, control_range=ranges) as viewer:
        ahead = clock() - data.time
        while viewer.is_running:
            behind = clock() - ahead - data.time
            if behind > _FALLEN_BEHIND:
                ahead, behind = ahead + behind - _FALLEN_BEHIND, _FALLEN_BEHIND
            mujoco.mj_step(model, data, max(0, round(behind / model.opt.timestep)))
            viewer.show(
                model,
                data,
                pressures=pressures(model, data).tolist(),
                lengths=muscle_lengths(model, data),
            )
            data.ctrl[:] = viewer.controls
            sleep(_FRAME)
