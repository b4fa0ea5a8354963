"""The state in which an episode begins: the arm at rest."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.experiment import Experiment
from pamsim.engine.callback import live
from pamsim.engine.rig import Rig
from pamsim.engine.settle import settle
from pamsim.engine.state import save_state
from pamsim.engine.timestep_check import check_timestep
from pamsim.envs.actions import ActionKind

FloatArray = NDArray[np.float64]


class RestStates:
    """Brings models to rest; that of the rig's own numbers is kept for the next episode.

    Args:
        rig: the arm.
        kind: of its actions.
        pressure: in both muscles [Pa].
        period: between samples [s].
    """

    def __init__(self, rig: Rig, kind: ActionKind, pressure: float, period: float) -> None:
        self._rig, self._kind, self._pressure, self._period = rig, kind, pressure, period
        self._known: dict[float, tuple[Rig, mujoco.MjModel, FloatArray]] = {}

    def at(self, values: dict[str, float], load: float) -> tuple[Rig, mujoco.MjModel, FloatArray]:
        """Rig, model and state of an arm with some parameters [SI] and a load [kg].

        Raises:
            InputError: if the rig cannot be stepped at its time step.
        """
        if not values and load in self._known:
            return self._known[load]
        rig = self._rig.with_parameters(values) if values else self._rig
        command = np.full((1, 2), self._kind.rest(self._pressure))
        start = Experiment(
            drive=self._kind.command,
            command_time=np.zeros(1),
            command_value=command,
            start_pressure=np.full(2, self._pressure),
            duration=self._period,
            sample_rate=1.0 / self._period,
            load=load,
        )
        model = rig.model_for(load=load, command=self._kind.command)
        check_timestep(model, rig.muscles)
        data = mujoco.MjData(model)
        with live(model):
            settle(model, data, start)
        data.ctrl[:] = command[0]
        rest = rig, model, save_state(model, data)
        if not values:
            self._known = {load: rest}
        return rest
