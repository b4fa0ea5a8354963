"""Simulate a rig to rest before time 0."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.engine import checks
from pamsim.engine.external import NOTHING, External, place
from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import set_command
from pamsim.engine.state import charge, settled
from pamsim.physics.muscle import Muscle
from pamsim.physics.record import slot
from pamsim.recordings.experiment import Experiment

EachStep: TypeAlias = Callable[[mujoco.MjModel, mujoco.MjData], None]
"""Called with model and data before every time step: physics that the rig does not contain."""

_REST_BLOCK = 0.1
"""Time between two checks whether a rig has come to rest [s]."""

_REST = 1e-10
"""Largest relative change of a state over that time in a rig that counts as at rest."""

_AWAY_MEANWHILE = [
    slot(name)
    for name in (
        "creep.stiffness",
        "creep.stiffness_2",
        "valve.dead_zone",
        "valve.regulator_dead_band",
    )
]


def settle(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    experiment: Experiment,
    on: External = NOTHING,
    *,
    each_step: EachStep | None = None,
) -> None:
    """Bring a model to rest at the start pressures of an experiment and set time to 0.

    It ends early once nothing moves. Creep, which would delay that, is switched off meanwhile: a
    relaxed creep element carries no force at rest. So is what keeps the valves shut near the set
    point: the muscles come to rest at the start pressures themselves, however they were reached.
    Where hysteresis leaves them depends on the way there, which is the same for every command.
    Joints that are driven from outside are under the first torque or force, or held where their
    motion begins.

    Args:
        model: its command is that of the experiment afterwards.
        data: of it, overwritten.
        experiment: its start pressures [Pa] and the time [s] that it allows.
        on: joints that it drives from outside.
        each_step: acts before every step, or None.
    """
    set_command(model, "pressure_set")
    first = experiment.command_value[0, len(experiment.drives.muscles) :]
    mujoco.mj_resetData(model, data)
    place(data, on, first)
    charge(model, data, experiment.start_pressure.tolist())
    kept = model.actuator_user[:, _AWAY_MEANWHILE].copy()
    model.actuator_user[:, _AWAY_MEANWHILE] = 0.0
    data.ctrl[:] = experiment.start_pressure
    data.time = -experiment.settle
    left = round(experiment.settle / model.opt.timestep)
    block = max(1, round(_REST_BLOCK / model.opt.timestep))
    before = _configuration(data)
    while left > 0:
        advance(model, data, experiment.start_pressure, min(block, left), each_step)
        left -= block
        place(data, on, first)
        now = _configuration(data)
        if _at_rest(before, now, data.qvel):
            break
        before = now
    model.actuator_user[:, _AWAY_MEANWHILE] = kept
    set_command(model, experiment.drives.muscles)
    settled(model, data, experiment.start_pressure.tolist())
    data.time = 0.0


def settle_quickly(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    experiment: Experiment,
    muscles: Mapping[str, Muscle],
    steps: int,
    on: External = NOTHING,
) -> None:
    """`settle` in longer time steps, which leaves rest where it is, but memory a little off.

    It settles in the model's own time step where a muscle does not allow a longer one, or the rig
    breaks down in it.

    Args:
        model: see `settle`.
        data: of it, overwritten.
        experiment: see `settle`.
        muscles: of the rig.
        steps: length of a step, in those of the model.
        on: see `settle`.
    """
    timestep = float(model.opt.timestep)
    if steps > 1:
        model.opt.timestep = steps * timestep
        try:
            check_timestep(model, muscles)
            settle(model, data, experiment, on)
            if not data.warning.number.any() and np.isfinite(_configuration(data)).all():
                return
            checks.forget(model)
        except InputError:
            pass
        finally:
            model.opt.timestep = timestep
    settle(model, data, experiment, on)


def advance(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    command: NDArray[np.float64],
    count: int,
    each_step: EachStep | None,
) -> None:
    """Take some time steps under one command.

    Args:
        model: of the run.
        data: of it; stepped in place.
        command: (m,) of the muscles; without a hook, ``data.ctrl`` holds it already.
        count: of steps.
        each_step: acts before each of them, or None.
    """
    if each_step is None:
        mujoco.mj_step(model, data, count)
        return
    for _ in range(count):
        data.ctrl[:] = command
        each_step(model, data)
        mujoco.mj_step(model, data)


def _configuration(data: mujoco.MjData) -> NDArray[np.float64]:
    return np.concatenate([data.qpos, data.act])


def _at_rest(
    before: NDArray[np.float64], now: NDArray[np.float64], velocity: NDArray[np.float64]
) -> bool:
    # Rounding keeps a joint that rests at zero from ever being still relative to its own angle.
    still = np.abs(now - before) <= _REST * np.abs(now) + 1e-3 * _REST
    return bool(still.all() and (np.abs(velocity) <= _REST).all())
