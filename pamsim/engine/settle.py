"""Simulate a rig to rest before time 0."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.engine import checks
from pamsim.engine.external import NOTHING, External, place
from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import set_command
from pamsim.engine.state import charge, quieten
from pamsim.engine.stepping import EachStep, advance
from pamsim.physics.muscle import Muscle
from pamsim.physics.record import slot
from pamsim.recordings.experiment import Experiment

_REST_BLOCK = 0.1
"""Time between two checks whether a rig has come to rest [s]."""

_REST = 1e-10
"""Largest relative change of a state over that time in a rig that counts as at rest."""

_AWAY = ("creep.stiffness", "creep.stiffness_2", "valve.dead_zone", "valve.regulator_dead_band")
_AWAY_MEANWHILE = [slot(name) for name in _AWAY]


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
    pressures, timestep = experiment.start_pressure, model.opt.timestep
    first = experiment.command_value[0, len(experiment.drives.muscles) :]
    mujoco.mj_resetData(model, data)
    place(data, on, first)
    charge(model, data, pressures)
    kept = model.actuator_user[:, _AWAY_MEANWHILE].copy()
    model.actuator_user[:, _AWAY_MEANWHILE] = 0.0
    data.ctrl[:] = pressures
    data.time = -experiment.settle
    left, block = round(experiment.settle / timestep), max(1, round(_REST_BLOCK / timestep))
    before = _configuration(data)
    while left > 0:
        advance(model, data, pressures, min(block, left), each_step)
        left -= block
        place(data, on, first)
        now = _configuration(data)
        # Rounding keeps a joint at zero from ever being still relative to its own angle.
        still = np.abs(now - before) <= _REST * np.abs(now) + 1e-3 * _REST
        if still.all() and (np.abs(data.qvel) <= _REST).all():
            break
        before = now
    model.actuator_user[:, _AWAY_MEANWHILE] = kept
    set_command(model, experiment.drives.muscles)
    quieten(model, data, pressures)
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


def _configuration(data: mujoco.MjData) -> NDArray[np.float64]:
    return np.concatenate([data.qpos, data.act])
