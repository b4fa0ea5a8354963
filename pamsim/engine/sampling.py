"""Take the samples of a run: between two of them the engine makes the time steps of one sample.

Two loops take the same samples, bit for bit. The compiled one leaves Python, and its lock, for many
samples at a time, so runs on several threads do not wait for each other. It calls ``mj_step``
itself, where an error of the engine ends the process. In a model without collisions there is none
to come after the first step: a stack too small shows there. Where geoms may collide, and with a
hook or the interpreted kernel, the loop in Python takes the samples.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.engine.delayed_command import Stretch
from pamsim.engine.external import External, act, effort
from pamsim.engine.library import engine_library
from pamsim.engine.settle import EachStep, advance
from pamsim.engine.trace import Trace

FloatArray: TypeAlias = NDArray[np.float64]
Pull: TypeAlias = Callable[[int], None]
"""Called with the number of each sample, once its tendons are measured."""

SYMBOL = "pamsim_mj_step"
"""Under which compiled code finds the engine's ``mj_step``."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What a run commands, in stretches of equal time steps under one command.

    Attributes:
        first: (n + 1,) the stretch that each sample begins with; the last one ends them.
        command: (s, m) of each stretch.
        timestep: (s,) [s].
        count: (s,) steps.
        external: (s, j) of each stretch, which is then a single step: what acts on the driven
            joints, see `pamsim.engine.external.act`.
    """

    first: NDArray[np.int64]
    command: FloatArray
    timestep: FloatArray
    count: NDArray[np.int64]
    external: FloatArray


def plan_of(samples: Sequence[Sequence[Stretch]]) -> Plan:
    """The plan of a run whose samples have several stretches each."""
    stretches = [stretch for sample in samples for stretch in sample]
    return Plan(
        first=np.cumsum([0, *map(len, samples)]),
        command=np.array([command for command, _, _ in stretches]),
        timestep=np.array([timestep for _, timestep, _ in stretches]),
        count=np.array([count for _, _, count in stretches], dtype=np.int64),
        external=np.empty((len(stretches), 0)),
    )


def held_commands(commands: FloatArray, timestep: float, steps: int) -> Plan:
    """The plan of a run with one command per sample.

    Args:
        commands: (n, m).
        timestep: [s].
        steps: time steps per sample.
    """
    count = len(commands)
    return Plan(
        first=np.arange(count + 1),
        command=np.ascontiguousarray(commands),
        timestep=np.full(count, timestep),
        count=np.full(count, steps, dtype=np.int64),
        external=np.empty((count, 0)),
    )


def each_step_command(commands: FloatArray, timestep: float, steps: int) -> Plan:
    """The plan of a run with a command for each time step.

    Args:
        commands: (n steps, m).
        timestep: [s].
        steps: time steps per sample.
    """
    count = len(commands)
    return Plan(
        first=np.arange(0, count + 1, steps),
        command=np.ascontiguousarray(commands),
        timestep=np.full(count, timestep),
        count=np.ones(count, dtype=np.int64),
        external=np.empty((count, 0)),
    )


def take_compiled(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    plan: Plan,
    on: External,
    trace: Trace,
    first: int,
    last: int,
) -> None:
    """Take samples of a model without collisions.

    Args: as `take_interpreted`, without a hook.
    """
    if first == 0 and last > 0:
        # A model that cannot be stepped raises an error here, in the engine's own binding.
        take_interpreted(model, data, plan, on, trace, 0, 1, None, None)
        first = 1
    _loop()(
        int(model._address),
        int(data._address),
        plan.first,
        plan.command,
        plan.timestep,
        plan.count,
        (data.qpos, data.qvel, data.act, data.ctrl),
        (data.actuator_length, data.actuator_velocity, data.actuator_force),
        (on.positions, on.dofs, on.inertia, plan.external),
        (data.qfrc_applied, data.qacc, trace.effort),
        data.warning.number,
        (trace.position, trace.velocity, trace.act),
        (trace.length, trace.speed, trace.force),
        (trace.time, trace.warnings),
        first,
        last,
    )


def take_interpreted(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    plan: Plan,
    on: External,
    trace: Trace,
    first: int,
    last: int,
    each_step: EachStep | None,
    pull: Pull | None,
) -> None:
    """Take samples of a model from Python.

    Args:
        model: of the run.
        data: of it; stepped in place.
        plan: of the run.
        on: joints that are driven from outside.
        trace: written.
        first: sample to begin at.
        last: sample to stop before.
        each_step: see `pamsim.simulate`.
        pull: see `Pull`; None for nothing to call.
    """
    ctrl = data.ctrl
    for k in range(first, last):
        note_state(data, trace, k)
        for stretch in range(plan.first[k], plan.first[k + 1]):
            row, count = plan.command[stretch], int(plan.count[stretch])
            model.opt.timestep = plan.timestep[stretch]
            ctrl[:] = row
            if on.joints:
                act(data, on, plan.external[stretch], plan.timestep[stretch])
            if stretch == plan.first[k]:
                advance(model, data, row, 1, each_step)
                note_tendons(data, trace, k)
                trace.effort[k] = effort(data, on)
                if pull is not None:
                    pull(k)
                count -= 1
            if count:
                advance(model, data, row, count, each_step)


def note_state(data: mujoco.MjData, trace: Trace, sample: int) -> None:
    """Write the state that a sample starts from."""
    trace.time[sample] = data.time
    trace.position[sample] = data.qpos
    trace.velocity[sample] = data.qvel
    trace.act[sample] = data.act
    trace.warnings[sample] = data.warning.number


def note_tendons(data: mujoco.MjData, trace: Trace, sample: int) -> None:
    """Write tendon lengths and forces, which are of the instant that the last step began at."""
    trace.length[sample] = data.actuator_length
    trace.speed[sample] = data.actuator_velocity
    trace.force[sample] = data.actuator_force


@functools.cache
def _loop() -> Any:
    # Only the compiled backend imports numba.
    import llvmlite.binding

    from pamsim.engine import structs

    address = ctypes.cast(engine_library().mj_step, ctypes.c_void_p).value
    llvmlite.binding.add_symbol(SYMBOL, address)
    from pamsim.engine.sampling_loop import compiled_loop

    at = structs.callback_offsets()
    return compiled_loop(at["time"] // 8, at["timestep"] // 8)
