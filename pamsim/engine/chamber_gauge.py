"""Gauge pressures of many arms at one instant, each with parameters and states of its own."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.engine.stepping import muscle_ids
from pamsim.physics.layout import AIR
from pamsim.physics.muscle_valves import sensed_pressure

FloatArray = NDArray[np.float64]
_Read: TypeAlias = Callable[..., None]


class ChamberGauge:
    """Reads all chambers of arms that differ in parameter values only.

    Args:
        model: of one arm: gives the muscles and the places of their states.
        arms: how many.

    Attributes:
        rows: (arms, m, SIZE) parameters of each arm's muscles.
        air: (m,) where the air states lie in ``act``.
    """

    def __init__(self, model: mujoco.MjModel, arms: int) -> None:
        ids = muscle_ids(model)
        self._first = np.array([model.actuator_actadr[i] for i in ids], dtype=np.int64)
        self._count = np.array([model.actuator_actnum[i] for i in ids], dtype=np.int64)
        self._out = np.array([model.actuator_outadr[i] for i in ids], dtype=np.int64)
        self.air = self._first + self._count - AIR
        self._ids = ids
        self.rows = np.empty((arms, len(ids), model.nuser_actuator))
        self._read = _compiled()

    def set_parameters(self, arm: int, model: mujoco.MjModel) -> None:
        """Take the parameters of one arm from its model."""
        self.rows[arm] = model.actuator_user[self._ids]

    def read(self, act: FloatArray, length: FloatArray, out: FloatArray) -> None:
        """Read gauge pressures.

        Args:
            act: (n, na) states.
            length: (n, m) lengths of the actuators' tendons [m].
            out: (n, m) written, one column per muscle [Pa].
        """
        self._read(self.rows, act, length, self._first, self._count, self._out, out)


@functools.cache
def _compiled() -> _Read:
    import numba

    from pamsim.engine import compiled
    from pamsim.engine.laws import Laws

    compiled.compiled_kernel()  # with the laws from outside the package
    key = Laws((sensed_pressure,)).key
    mark: Any = compiled.keyed_by

    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def read(rows, act, length, first, count, out, pressure):
        mark(key)
        states = np.empty(count.max())  # in one piece, which those of a batch are not
        for arm in range(pressure.shape[0]):
            for muscle in range(pressure.shape[1]):
                begin, size = first[muscle], count[muscle]
                states[:size] = act[arm, begin : begin + size]
                pressure[arm, muscle] = sensed_pressure(
                    rows[arm, muscle], states[:size], length[arm, out[muscle]]
                )

    return read
