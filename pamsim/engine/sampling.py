"""Take the samples of a run: between two of them the engine makes the time steps of one sample.

One loop takes them, as Python or as machine code, with the same results to the bit. The compiled
one leaves Python, and its lock, for many samples at a time, so runs on several threads do not wait
for each other. It calls ``mj_step`` itself, where an error of the engine ends the process. In a
model without collisions there is none to come after the first step: a stack too small shows there.
Where geoms may collide, and with a hook or the interpreted kernel, the loop runs in Python.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.engine import structs
from pamsim.engine.command_plan import Plan
from pamsim.engine.external import External, act, effort
from pamsim.engine.plugin import engine_library
from pamsim.engine.stepping import EachStep, advance
from pamsim.recordings.recording import Outcome


class Trace(NamedTuple):
    """Signals of the engine at each of n samples, before the next step."""

    time: FloatArray  # (n,) [s]
    position: FloatArray  # (n, nq)
    velocity: FloatArray  # (n, nv)
    act: FloatArray  # (n, na) states of all actuators
    length: FloatArray  # (n, m) of the actuators [m]
    speed: FloatArray  # (n, m) [m/s]
    force: FloatArray  # (n, m) [N]
    effort: FloatArray  # (n, j) what acts on driven joints from outside [N m or N]
    warnings: NDArray[np.int32]  # (n, k) how often the engine has warned of each kind


def empty_trace(model: mujoco.MjModel, samples: int, driven: int) -> Trace:
    """A trace with room for a number of samples, of a number of driven joints."""
    muscles = model.nactuator
    widths = (model.nq, model.nv, model.na, muscles, muscles, muscles, driven)
    signals = (np.empty((samples, width)) for width in widths)
    warnings = np.empty((samples, int(mujoco.mjtWarning.mjNWARNING)), dtype=np.int32)
    return Trace._make((np.empty(samples), *signals, warnings))


class Memory(NamedTuple):
    """The engine's own arrays that a run reads and writes, by their names; numbers as arrays."""

    time: FloatArray
    timestep: FloatArray
    warnings: NDArray[np.int32]
    qpos: FloatArray
    qvel: FloatArray
    act: FloatArray
    ctrl: FloatArray
    qfrc_applied: FloatArray
    qacc: FloatArray
    actuator_length: FloatArray
    actuator_velocity: FloatArray
    actuator_force: FloatArray


def engine_memory(model: mujoco.MjModel, data: mujoco.MjData) -> Memory:
    """Views that hold while the model and its data exist."""
    at = structs.callback_offsets()
    places = int(data._address) + at["time"], int(model._address) + at["timestep"]
    numbers = [(ctypes.c_double * 1).from_address(place) for place in places]
    arrays = (getattr(data, name) for name in Memory._fields[3:])
    return Memory._make((*map(np.ctypeslib.as_array, numbers), data.warning.number, *arrays))


def take_samples(
    model: Any,
    data: Any,
    memory: Memory,
    plan: Plan,
    on: External,
    trace: Trace,
    begin: int,
    end: int,
    each_step: EachStep | None,
    gauge: Callable[[int], None] | None,
) -> None:
    """Take samples from one to before another; compiled as it stands, without hook and gauge.

    Compiled code is given the addresses of model and data. A gauge is called with the number of
    each sample once its tendons are measured.
    """
    for k in range(begin, end):
        note_state(memory, trace, k)
        first = plan.first[k]
        for stretch in range(first, plan.first[k + 1]):
            command, count = plan.command[stretch], plan.steps[stretch]
            memory.timestep[0] = plan.timestep[stretch]
            _copy(command, memory.ctrl)
            act(memory, on, plan.external[stretch], plan.timestep[stretch])
            if stretch == first:
                advance(model, data, command, 1, each_step)
                note_tendons(memory, on, trace, k)
                if gauge is not None:
                    gauge(k)
                count -= 1
            advance(model, data, command, count, each_step)


def note_state(memory: Memory, trace: Trace, sample: int) -> None:
    """Write the state that a sample starts from."""
    trace.time[sample] = memory.time[0]
    _copy(memory.qpos, trace.position[sample])
    _copy(memory.qvel, trace.velocity[sample])
    _copy(memory.act, trace.act[sample])
    _copy(memory.warnings, trace.warnings[sample])


def note_tendons(memory: Memory, on: External, trace: Trace, sample: int) -> None:
    """Write lengths, forces and efforts, which are of the instant that the last step began at."""
    _copy(memory.actuator_length, trace.length[sample])
    _copy(memory.actuator_velocity, trace.speed[sample])
    _copy(memory.actuator_force, trace.force[sample])
    for joint in range(on.dofs.size):
        trace.effort[sample, joint] = effort(memory, on, joint)


def _copy(values: NDArray[Any], into: NDArray[Any]) -> None:
    into[:] = values


@functools.cache
def compiled_loop() -> Callable[..., None]:
    """`take_samples` as machine code."""
    # Only the compiled backend imports numba.
    import llvmlite.binding

    from pamsim.engine import by_address, compiled
    from pamsim.engine.memory import compiled_as
    from pamsim.numba_cache import numba

    native = ctypes.cast(engine_library().mj_step, ctypes.c_void_p).value
    llvmlite.binding.add_symbol("pamsim_mj_step", native)
    address: Any = numba.types.int64
    step: Any = numba.types.ExternalFunction("pamsim_mj_step", numba.void(address, address))

    def steps(model: Any, data: Any, command: Any, count: Any, each_step: Any) -> None:
        for _ in range(count):
            step(model, data)

    # Numba compiles the assignment of a whole row for seconds.
    def each(values: Any, into: Any) -> None:
        for i in range(values.size):
            into[i] = values[i]

    compiled_as(advance)(steps)
    compiled_as(_copy)(each)
    return by_address.loop(take_samples, compiled.hand_over(take_samples))


def first_breakdown(
    trace: Trace, expected_time: FloatArray, slack: float, first: int, last: int
) -> tuple[int, Outcome, str] | None:
    """The first sample from one to before another at which the state is invalid, if there is one.

    The engine itself only prints a warning and goes on. Rounding explains a slack [s] between the
    time of a sample and the engine's.

    Returns:
        Its number, what it is called, and the reason as a phrase.
    """
    rows = slice(first, last)
    finite: Any = np.isfinite(np.hstack([trace.act[rows], trace.position[rows]]))
    warned: Any = trace.warnings[rows]
    late = ~(np.abs(trace.time[rows] - expected_time[rows]) <= slack)
    if finite.all() and not warned.any() and not late.any():
        return None
    finite, warned = finite.all(axis=1), warned.any(axis=1)
    at = int(np.argmax(~finite | warned | late))
    sample = first + at
    if not finite[at]:
        remedy = "check parameters and start pressures, or take a smaller time step"
        return sample, Outcome.NOT_FINITE, f"a state is not finite; {remedy}"
    if warned[at]:
        kind = mujoco.mjtWarning(int(np.argmax(trace.warnings[sample] > 0)))
        name = kind.name.removeprefix("mjWARN_")
        reason = f"MuJoCo warned of {name}; take a smaller time step"
        return sample, Outcome.ENGINE_WARNING, reason
    time, expected = trace.time[sample], expected_time[sample]
    return sample, Outcome.TIME_STALLED, f"time is {time:.6g} s, not {expected:.6g} s"
