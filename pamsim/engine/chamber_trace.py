"""Gauge pressures along a run, from the recorded states and tendon lengths."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from pamsim.actuator.kernel import gauge_pressure
from pamsim.engine.callback import muscle_ids
from pamsim.engine.trace import FloatArray


def gauge_pressures(
    model: mujoco.MjModel, act: FloatArray, length: FloatArray, *, backend: str
) -> FloatArray:
    """Gauge pressures of all muscles at every sample.

    Args:
        model: a model with pamsim muscles.
        act: (n, na) states.
        length: (n, m) lengths of the actuators' tendons [m].
        backend: ``compiled`` or ``python``: which of the kernel's two forms is run.

    Returns:
        (n, m) [Pa], one column per muscle.
    """
    along = _compiled() if backend == "compiled" else _interpreted
    ids = muscle_ids(model)
    pressure = np.empty((len(ids), len(act)))
    for index, column in zip(ids, pressure, strict=True):
        first = model.actuator_actadr[index]
        states = act[:, first : first + model.actuator_actnum[index]]
        lengths = length[:, model.actuator_outadr[index]]
        along(
            model.actuator_user[index].copy(), np.ascontiguousarray(states), lengths.copy(), column
        )
    return pressure.T


def _interpreted(row: FloatArray, states: FloatArray, length: FloatArray, out: FloatArray) -> None:
    par = row.tolist()
    out[:] = [
        gauge_pressure(par, a, at) for a, at in zip(states.tolist(), length.tolist(), strict=True)
    ]


@functools.cache
def _compiled() -> Callable[[FloatArray, FloatArray, FloatArray, FloatArray], None]:
    # Numba is imported by choice of backend. Of the functions the callbacks are made of, the one
    # wanted here is among those they register with it.
    import numba

    from pamsim.engine import compiled

    compiled.compiled_callbacks()
    key = compiled.fingerprint(compiled.reached_functions(gauge_pressure))
    mark: Any = compiled._keyed_by

    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def along(row, states, length, out):
        mark(key)
        for k in range(length.size):
            out[k] = gauge_pressure(row, states[k], length[k])

    return along
