"""Run a controller in an environment and record the episode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pamsim.controllers.controller import Command, Controller, JointObservation, Observation
from pamsim.core.errors import InputError
from pamsim.envs.rigs import Rigs
from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.muscle_valves import valve_opening
from pamsim.physics.record import slot, view

FloatArray = NDArray[np.float64]

_COLUMNS = (
    "position",
    "reference",
    "pressure",
    "command",
    "opening",
    "air",
    "stiffness",
    "wanted_stiffness",
)

OPEN = 0.02
"""Opening from which a valve counts as open."""

ON = 0.33
"""Commanded opening from which an on/off valve is opened."""

_INDEX = slot("chamber.polytropic_index")
_TEMPERATURE = slot("chamber.temperature")
_ATMOSPHERE = slot("chamber.atmosphere")


@dataclass(frozen=True, kw_only=True, eq=False)
class Drive:
    """An episode under a controller of j joints and m muscles, one row per step.

    Attributes:
        joints: names.
        period: between samples [s].
        position: (n, j) true positions at the end of each step [rad or m].
        reference: (n, j) references there [rad or m].
        pressure: (n, m) true gauge pressures there [Pa].
        command: (n, m) during the step: set points [Pa] or openings.
        opening: (n, m) of the valves at the end of the step, in [-1, 1].
        air: (n, m) let in during the step [kg]; flow in and out within one step is not counted.
        stiffness: (n, j) of the joints between shut muscles at the end of the step [N m/rad].
        wanted_stiffness: (n, j) [N m/rad]; 0 where it is free.
        reward: of the episode.
    """

    joints: tuple[str, ...]
    period: float
    position: FloatArray
    reference: FloatArray
    pressure: FloatArray
    command: FloatArray
    opening: FloatArray
    air: FloatArray
    stiffness: FloatArray
    wanted_stiffness: FloatArray
    reward: float


def controller_observation(rigs: Rigs, observation: FloatArray, time: float) -> Observation:
    """Observation of an environment as controllers take it."""
    signals, joints = rigs.signals.si(observation), len(rigs.rig.joints)
    pressures = signals[2 * joints : -4 * joints]
    moved = np.concatenate([signals[: 2 * joints], signals[-4 * joints :]])
    return Observation(
        time=time,
        joints=tuple(
            JointObservation(
                position=position,
                velocity=velocity,
                reference=reference,
                reference_rate=rate,
                reference_acceleration=acceleration,
                stiffness=stiffness or None,
            )
            for position, velocity, reference, rate, acceleration, stiffness in moved.reshape(
                6, joints
            ).T.tolist()
        ),
        pressure=tuple(pressures.tolist()),
    )


def action_of(rigs: Rigs, command: Command) -> NDArray[np.generic]:
    """The action that gives the muscles of an environment a command.

    On/off valves open from a commanded opening of one third.

    Raises:
        InputError: if there is not one command per muscle.
    """
    wanted = np.array(command)
    if len(wanted) != len(rigs.rig.muscles):
        raise InputError(
            f"the controller commands {len(wanted)} muscles, rig {rigs.rig.name!r} has"
            f" {len(rigs.rig.muscles)}"
        )
    if rigs.settings.action == "pressure_set":
        return (wanted / (0.5 * rigs.top_pressure) - 1.0).astype(np.float32)
    if rigs.settings.action == "valve":
        return wanted.astype(np.float32)
    return np.column_stack([wanted > ON, wanted < -ON]).ravel().astype(np.int8)


def drive(
    env: gymnasium.Env[Any, Any],
    controller: Controller,
    seed: int,
    options: dict[str, Any] | None = None,
) -> Drive:
    """Run a controller in an environment for one episode.

    Args:
        env: as `gymnasium.make` makes it, which ends the episode.
        controller: whose commands are of the kind that it takes.
        seed: of the episode.
        options: what is fixed of it, as the environment's ``reset`` takes them.

    Raises:
        InputError: if the environment is none of ours or sets no end; if pressures are commanded to
            an environment of valves, or the other way round; for another number of muscles.
    """
    rigs = getattr(env.unwrapped, "rigs", None)
    if not isinstance(rigs, Rigs) or env is env.unwrapped:
        raise InputError("give the environment as gymnasium.make makes it, not unwrapped")
    if controller.command != rigs.kind.command:
        raise InputError(
            f"the controller commands {controller.command}, this environment takes"
            f" {rigs.kind.command}: put it under a Cascade, or use another action"
        )
    observation, _ = env.reset(seed=seed, options=options)
    memory = controller.start(controller_observation(rigs, observation, 0.0))
    rows: dict[str, list[Any]] = {field: [] for field in _COLUMNS}
    total, over, before = 0.0, False, rigs.air()[0]
    while not over:
        observed = controller_observation(rigs, observation, len(rows["position"]) * rigs.period)
        command, memory = controller.act(observed, memory)
        observation, reward, broken, ended, info = env.step(action_of(rigs, command))
        over, total = broken or ended, total + float(reward)
        after, pressure = rigs.air()[0], info["pressure"]
        row = {
            "position": info["position"],
            "reference": [joint.reference for joint in observed.joints],
            "pressure": pressure,
            "command": command,
            "opening": _openings(rigs, command, pressure),
            "air": _let_in(rigs, before, after, pressure),
            "stiffness": rigs.stiffness()[0],
            "wanted_stiffness": [joint.stiffness or 0.0 for joint in observed.joints],
        }
        for field, values in row.items():
            rows[field].append(values)
        before = after
    return Drive(
        joints=tuple(rigs.rig.joints),
        period=rigs.period,
        reward=total,
        **{field: np.array(values) for field, values in rows.items()},
    )


def _openings(rigs: Rigs, command: Command, pressure: FloatArray) -> list[float]:
    return [
        valve_opening(view(row), opening, at, 0.0)
        for row, opening, at in zip(rigs.rows[0], command, pressure.tolist(), strict=True)
    ]


def _let_in(rigs: Rigs, before: FloatArray, after: FloatArray, pressure: FloatArray) -> FloatArray:
    """Air that came in [kg]: dm = P^(1 - 1/n) dy / (R T), the chamber's own equation."""
    rows = rigs.rows[0]
    absolute = np.maximum(pressure + rows[:, _ATMOSPHERE], 0.0)
    mass = absolute ** (1.0 - 1.0 / rows[:, _INDEX]) / (GAS_CONSTANT * rows[:, _TEMPERATURE])
    return np.maximum(after - before, 0.0) * mass
