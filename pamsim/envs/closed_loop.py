"""Run a controller in an environment and record the episode."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.actuator.kernel import valve_opening
from pamsim.actuator.layout import slot
from pamsim.controllers.controller import Command, Controller, Observation
from pamsim.core.errors import InputError
from pamsim.envs.actions import KINDS
from pamsim.envs.arms import Arms
from pamsim.envs.pam_arm import PamArmEnv
from pamsim.pneumatics.air import GAS_CONSTANT

FloatArray = NDArray[np.float64]

OPEN = 0.02
"""Opening from which a valve counts as open."""

ON = 0.33
"""Commanded opening from which an on/off valve is opened."""

_INDEX = slot("chamber.polytropic_index")
_TEMPERATURE = slot("chamber.temperature")
_ATMOSPHERE = slot("chamber.atmosphere")


@dataclass(frozen=True, kw_only=True, eq=False)
class Drive:
    """An episode under a controller, one row per step.

    Attributes:
        period: between samples [s].
        angle: (n,) true angle at the end of each step [rad].
        reference: (n,) reference there [rad].
        pressure: (n, 2) true gauge pressures there [Pa].
        command: (n, 2) during the step: set points [Pa] or openings.
        opening: (n, 2) of the valves at the end of the step, in [-1, 1].
        air: (n, 2) let in during the step [kg]; flow in and out within one step is not counted.
        stiffness: (n,) of the joint between shut muscles at the end of the step [N m/rad].
        wanted_stiffness: (n,) [N m/rad]; 0 where it is free.
        reward: of the episode.
    """

    period: float
    angle: FloatArray
    reference: FloatArray
    pressure: FloatArray
    command: FloatArray
    opening: FloatArray
    air: FloatArray
    stiffness: FloatArray
    wanted_stiffness: FloatArray
    reward: float


def controller_observation(arms: Arms, observation: FloatArray, time: float) -> Observation:
    """Observation of an environment as controllers take it."""
    angle, velocity, *pressures, reference, rate, acceleration, stiffness = observation.tolist()
    return Observation(
        time=time,
        angle=angle,
        velocity=velocity,
        pressure=(pressures[0] * arms.supply, pressures[1] * arms.supply),
        reference=reference,
        reference_rate=rate,
        reference_acceleration=acceleration,
        stiffness=stiffness or None,
    )


def action(env: PamArmEnv, command: Command) -> NDArray[np.generic]:
    """The action that gives the muscles of an environment a command.

    On/off valves open from a commanded opening of one third.
    """
    wanted = np.array(command)
    if env.kind == "pressure":
        return (wanted / (0.5 * env.arms.supply) - 1.0).astype(np.float32)
    if env.kind == "valve":
        return wanted.astype(np.float32)
    return np.column_stack([wanted > ON, wanted < -ON]).ravel().astype(np.int8)


def drive(env: PamArmEnv, controller: Controller, seed: int) -> Drive:
    """Run a controller in an environment for one episode.

    Args:
        env: the environment itself (``gymnasium.make(...).unwrapped``).
        controller: whose commands are of the kind that it takes.
        seed: of the episode.

    Raises:
        InputError: if pressures are commanded to an environment of valves, or the other way round.
    """
    takes = KINDS[env.kind].command
    if controller.command != takes:
        raise InputError(
            f"the controller commands {controller.command}, this environment takes {takes}:"
            " put it under a Cascade, or use another environment"
        )
    arms = env.arms
    observation, _ = env.reset(seed=seed)
    memory = controller.start(controller_observation(arms, observation, 0.0))
    rows: list[list[float]] = []
    total, over, before = 0.0, False, arms.air()[0]
    while not over:
        observed = controller_observation(arms, observation, len(rows) * arms.period)
        command, memory = controller.act(observed, memory)
        observation, reward, broken, ended, info = env.step(action(env, command))
        over, total = broken or ended, total + reward
        after, pressure = arms.air()[0], info["pressure"]
        rows.append(
            [
                info["angle"],
                observed.reference,
                *pressure,
                *command,
                *_openings(arms, command, pressure),
                *_let_in(arms, before, after, pressure),
                float(arms.stiffness()[0]),
                observed.stiffness or 0.0,
            ]
        )
        before = after
    table = np.array(rows)
    return Drive(
        period=arms.period,
        angle=table[:, 0],
        reference=table[:, 1],
        pressure=table[:, 2:4],
        command=table[:, 4:6],
        opening=table[:, 6:8],
        air=table[:, 8:10],
        stiffness=table[:, 10],
        wanted_stiffness=table[:, 11],
        reward=total,
    )


def _openings(arms: Arms, command: Command, pressure: FloatArray) -> list[float]:
    return [
        valve_opening(row, opening, at, 0.0)
        for row, opening, at in zip(arms.rows[0], command, pressure.tolist(), strict=True)
    ]


def _let_in(arms: Arms, before: FloatArray, after: FloatArray, pressure: FloatArray) -> FloatArray:
    """Air that came in [kg]: dm = P^(1 - 1/n) dy / (R T), the chamber's own equation."""
    rows = arms.rows[0]
    absolute = np.maximum(pressure + rows[:, _ATMOSPHERE], 0.0)
    mass = absolute ** (1.0 - 1.0 / rows[:, _INDEX]) / (GAS_CONSTANT * rows[:, _TEMPERATURE])
    return np.maximum(after - before, 0.0) * mass
