"""The compiled loop that takes samples of a run; see `pamsim.engine.sampling`."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numba import types

from pamsim.engine.memory import as_pointer
from pamsim.engine.sampling import SYMBOL

_step: Any = types.ExternalFunction(SYMBOL, types.void(types.voidptr, types.voidptr))


def compiled_loop(clock: int, option: int) -> Any:
    """The loop, compiled or loaded from numba's cache.

    It closes over nothing but numbers: numba makes its cache key from them, and functions among
    them would give a new key in every process, which then compiles for seconds.

    Args:
        clock: position of the time in ``mjData``, in units of eight bytes.
        option: position of the time step in ``mjModel``, in units of eight bytes.
    """

    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def loop(
        model_address,
        data_address,
        begins,
        commands,
        timesteps,
        counts,
        state,
        tendon,
        driven,
        acting,
        warned,
        states,
        tendons,
        others,
        first,
        last,
    ):
        model = as_pointer(model_address)  # pyright: ignore[reportCallIssue]
        data = as_pointer(data_address)  # pyright: ignore[reportCallIssue]
        timestep = numba.carray(model, (option + 1,), np.float64)
        now = numba.carray(data, (clock + 1,), np.float64)
        position, velocity, act, ctrl = state
        length, speed, force = tendon
        places, dofs, inertia, external = driven
        applied, acceleration, efforts = acting
        times, warnings = others
        for k in range(first, last):
            times[k] = now[clock]
            # Loops, since numba compiles the assignment of a whole row for seconds.
            for i in range(position.size):
                states[0][k, i] = position[i]
            for i in range(velocity.size):
                states[1][k, i] = velocity[i]
            for i in range(act.size):
                states[2][k, i] = act[i]
            for i in range(warned.size):
                warnings[k, i] = warned[i]
            begin = begins[k]
            for stretch in range(begin, begins[k + 1]):
                timestep[option] = timesteps[stretch]
                for i in range(ctrl.size):
                    ctrl[i] = commands[stretch, i]
                for j in range(dofs.size):  # as `pamsim.engine.external.act`
                    value, dof = external[stretch, j], dofs[j]
                    if inertia[j] > 0.0:
                        step_time = timesteps[stretch]
                        wanted = (value - position[places[j]]) / step_time
                        value = inertia[j] * ((wanted - velocity[dof]) / step_time)
                    applied[dof] = value
                for i in range(counts[stretch]):
                    _step(model, data)
                    if stretch == begin and i == 0:
                        for m in range(length.size):
                            tendons[0][k, m] = length[m]
                            tendons[1][k, m] = speed[m]
                            tendons[2][k, m] = force[m]
                        for j in range(dofs.size):
                            dof = dofs[j]
                            efforts[k, j] = applied[dof] - inertia[j] * acceleration[dof]

    return loop
