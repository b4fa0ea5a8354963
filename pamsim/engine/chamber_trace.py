"""Gauge pressures and tensions along a run, from the recorded states and tendon lengths."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import mujoco
import numpy as np

from pamsim.engine.stepping import muscle_ids
from pamsim.engine.trace import FloatArray
from pamsim.physics.kernel import tension
from pamsim.physics.muscle_valves import sensed_pressure

_Law: TypeAlias = Callable[..., float]
_Along: TypeAlias = Callable[..., None]


def gauge_pressures(
    model: mujoco.MjModel, act: FloatArray, length: FloatArray, *, backend: str
) -> FloatArray:
    """Gauge pressures of all muscles at every sample, as sensors at the valves see them.

    Args:
        model: a model with pamsim muscles.
        act: (n, na) states.
        length: (n, m) lengths of the actuators' tendons [m].
        backend: ``compiled`` or ``python``: which of the kernel's two forms is run.

    Returns:
        (n, m) [Pa], one column per muscle.
    """
    return _along(sensed_pressure, model, act, (length,), backend)


def tensions(
    model: mujoco.MjModel, act: FloatArray, length: FloatArray, speed: FloatArray, *, backend: str
) -> FloatArray:
    """Tensions of all muscles at every sample.

    Args:
        model: a model with pamsim muscles.
        act: (n, na) states.
        length: (n, m) lengths of the actuators' tendons [m].
        speed: (n, m) their rates [m/s].
        backend: ``compiled`` or ``python``: which of the kernel's two forms is run.

    Returns:
        (n, m) [N], one column per muscle.
    """
    return _along(tension, model, act, (length, speed), backend)


def _along(
    law: _Law,
    model: mujoco.MjModel,
    act: FloatArray,
    motion: tuple[FloatArray, ...],
    backend: str,
) -> FloatArray:
    along = _compiled(law) if backend == "compiled" else _interpreted(law)
    ids = muscle_ids(model)
    values = np.empty((len(ids), len(act)))
    for index, column in zip(ids, values, strict=True):
        first = model.actuator_actadr[index]
        states = act[:, first : first + model.actuator_actnum[index]]
        given = [signal[:, model.actuator_outadr[index]].copy() for signal in motion]
        along(model.actuator_user[index].copy(), np.ascontiguousarray(states), *given, column)
    return values.T


def _interpreted(law: _Law) -> _Along:
    def along(row: FloatArray, states: FloatArray, *given: FloatArray) -> None:
        par, (*motion, out) = row.tolist(), given
        columns = zip(states.tolist(), *(signal.tolist() for signal in motion), strict=True)
        out[:] = [law(par, *column) for column in columns]

    return along


def _compiled(law: _Law) -> _Along:
    # Only the compiled backend imports numba.
    from pamsim.engine import compiled

    natives = compiled.compiled_kernel()
    return natives.pulls if law is tension else natives.pressures
