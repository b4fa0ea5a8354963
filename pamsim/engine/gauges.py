"""Gauge pressures and tensions of muscles, from their states and the lengths of their tendons."""

from __future__ import annotations

import functools
from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.engine.muscle_step import COUNT, memory_at, muscle_at, states_at
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.kernel import tension
from pamsim.physics.muscle_valves import sensed_pressure


class Gauges:
    """Reads the muscles of a model, or of copies of it that differ in parameter values only.

    Args:
        model: gives the muscles and the places of their states.
        copies: how many; None for the model alone, at any number of instants.
        backend: ``compiled`` or ``python``: how the kernel is run.

    Attributes:
        rows: (copies, m, SIZE) parameters of each copy's muscles.
        air: (m,) where the air states lie in ``act``.
    """

    def __init__(
        self, model: mujoco.MjModel, copies: int | None = None, backend: str = "compiled"
    ) -> None:
        self._ids = ids = muscle_ids(model)
        places = ("actuator_actadr", "actuator_actnum", "actuator_outadr")
        found = [[getattr(model, place)[i] for i in ids] for place in places]
        self._places = np.array(found, dtype=np.int64).reshape(3, len(ids))
        self.air = self._places[0] + self._places[1] - 1
        self.rows = np.empty((copies or 1, len(ids), model.nuser_actuator))
        for copy in range(copies or 1):
            self.set_parameters(copy, model)
        self._read: Callable[..., None] = compiled_read() if backend == "compiled" else read

    def set_parameters(self, copy: int, model: mujoco.MjModel) -> None:
        """Take the parameters of one copy from its model."""
        self.rows[copy] = model.actuator_user[self._ids]

    def pressures(self, act: FloatArray, length: FloatArray) -> FloatArray:
        """Gauge pressures as sensors at the valves see them.

        Args:
            act: (n, na) states, of each copy, or at n instants.
            length: (n, outputs) lengths of the actuators' tendons [m].

        Returns:
            (n, m) one column per muscle [Pa].
        """
        return self._of(act, length, length, 0)

    def tensions(self, act: FloatArray, length: FloatArray, speed: FloatArray) -> FloatArray:
        """Tensions [N]; arguments as `pressures`, and the rates of the lengths [m/s]."""
        return self._of(act, length, speed, 1)

    def _of(self, act: FloatArray, length: FloatArray, speed: FloatArray, what: int) -> FloatArray:
        out = np.empty((len(act), len(self._ids)))
        # Compiled code takes contiguous arrays that may be written; asking numpy takes longer.
        given = (one if one.flags.carray else one.copy("C") for one in (act, length, speed))
        self._read(self.rows, *given, self._places, what, out)
        return out


def read(
    rows: FloatArray,
    act: FloatArray,
    length: FloatArray,
    speed: FloatArray,
    places: NDArray[np.int64],
    what: int,
    out: FloatArray,
) -> None:
    """Read one signal of all muscles; compiled as it stands.

    Args:
        rows: (copies, m, SIZE) parameters.
        act: (n, na) states.
        length: (n, outputs) of the tendons [m].
        speed: (n, outputs) their rates [m/s].
        places: (3, m) each muscle's first state, number of states and output.
        what: 0 for gauge pressures at the valves, 1 for tensions.
        out: (n, m) written [Pa or N].
    """
    for k in range(out.shape[0]):
        copy = k if rows.shape[0] > 1 else 0
        for muscle in range(out.shape[1]):
            row = rows.ctypes.data + 8 * (copy * rows.shape[1] + muscle) * rows.shape[2]
            count, column = int(places[1, muscle]), int(places[2, muscle])
            states = act.ctypes.data + 8 * (k * act.shape[1] + int(places[0, muscle]))
            m, s = muscle_at(row), states_at(states + 8 * (count - COUNT))
            z = memory_at(states, count - COUNT)
            if what == 1:
                out[k, muscle] = tension(m, s, z, length[k, column], speed[k, column])
            else:
                out[k, muscle] = sensed_pressure(m, s, z, length[k, column])


@functools.cache
def compiled_read() -> Callable[..., None]:
    """`read` as machine code."""
    # Only the compiled backend imports numba.
    from pamsim.engine import by_address, compiled

    return by_address.loop(read, compiled.hand_over(read))
