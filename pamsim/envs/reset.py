"""The state in which an episode begins: the rig at rest."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import Rig
from pamsim.engine.settle import settle_quickly
from pamsim.engine.state import save_state
from pamsim.engine.stepping import live
from pamsim.envs.actions import ActionKind
from pamsim.recordings.experiment import Experiment

FloatArray = NDArray[np.float64]

_STEPS = 16
"""Time steps in one in which a rig whose parameters are drawn comes to rest: its angle is within
0.02 deg of that in single steps, far below what the draw changes."""


class RestStates:
    """Brings models to rest; that of the rig's own numbers is kept for the next episode.

    Args:
        rig: the rig.
        kind: of its actions.
        period: between samples [s].
    """

    def __init__(self, rig: Rig, kind: ActionKind, period: float) -> None:
        self._rig, self._kind, self._period = rig, kind, period
        self._data = mujoco.MjData(rig.model)
        self._known: dict[object, tuple[Rig, mujoco.MjModel, FloatArray]] = {}

    def at(
        self, values: dict[str, float], load: float, pressure: tuple[float, ...]
    ) -> tuple[Rig, mujoco.MjModel, FloatArray]:
        """Rig, model and state of a rig with some parameters [SI], a load [kg] and pressures [Pa].

        Raises:
            InputError: if the rig cannot be stepped at its time step.
        """
        key = load, pressure
        if not values and key in self._known:
            return self._known[key]
        data = self._data
        rig = self._rig.with_parameters(values, data=data) if values else self._rig
        start_pressure = np.array(pressure)
        command = self._kind.rest(start_pressure)[np.newaxis]
        start = Experiment(
            drive=self._kind.command,
            command_time=np.zeros(1),
            command_value=command,
            start_pressure=start_pressure,
            duration=self._period,
            sample_rate=1.0 / self._period,
            load=load,
        )
        model = rig.model_for(load=load, command=self._kind.command, data=data)
        check_timestep(model, rig.muscles)
        with live(model):
            settle_quickly(model, data, start, rig.muscles, _STEPS if values else 1)
        data.ctrl[:] = command[0]
        rest = rig, model, save_state(model, data)
        if not values:
            self._known = {key: rest}
        return rest
