"""Run a controller in an environment, record the episode, and score it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np

from pamsim.controllers.controller import Controller, JointObservation, Observation
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.envs.plant import OneRig
from pamsim.envs.rigs import Rigs
from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.muscle_valves import valve_opening

OPEN = 0.02
"""Opening from which a valve counts as open."""

SETTLED_SHARE, SETTLED_TRAVEL = 0.05, 0.01
"""A step has settled within this share of its height, the usual one, or this share of the joint's
travel, 0.2 deg on `mas20_arm`, the larger of both. A lower step counts as none."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EpisodeRun:
    """An episode under a controller, of j joints and m muscles, one row per step.

    Attributes:
        joints: names.
        travel: (j,) of the joints' `pamsim.envs.scales.Reach` [rad or m].
        period: between samples [s].
        start: (j,) true positions before the first step [rad or m].
        position: (n, j) true positions at the end of each step [rad or m].
        reference: (n, j) references there [rad or m].
        pressure: (n, m) true gauge pressures there [Pa].
        command: (n, m) that the environment took for the step: set points [Pa] or openings.
        opening: (n, m) of the valves at the end of the step, in [-1, 1], by the commands that reach
            them then.
        air: (n, m) let in during the step [kg]; flow in and out within one step is not counted.
        stiffness: (n, j) of the joints between shut muscles at the end of the step [N m/rad]; NaN
            for a rig whose tendons are not all fixed.
        wanted_stiffness: (n, j) [N m/rad]; 0 where it is free.
        reward: of the episode.
    """

    joints: tuple[str, ...]
    travel: FloatArray
    period: float
    start: FloatArray
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
    joints, names = len(rigs.rig.joints), JointObservation.__dataclass_fields__
    measured, pressure, wanted = np.split(rigs.signals.si(observation), [2 * joints, -4 * joints])
    motions: list[list[float]] = np.concatenate([measured, wanted]).reshape(6, -1).T.tolist()
    # A stiffness of 0 is a free one.
    each: list[Any] = [(*motion, stiffness or None) for *motion, stiffness in motions]
    return Observation(
        time=time,
        joints=tuple(JointObservation(**dict(zip(names, one, strict=True))) for one in each),
        pressure=tuple(pressure.tolist()),
    )


def run_episode(
    env: gymnasium.Env[Any, Any],
    controller: Controller,
    seed: int,
    options: dict[str, Any] | None = None,
) -> EpisodeRun:
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
    limited = any(isinstance(one, gymnasium.wrappers.TimeLimit) for one in _wrappers(env))
    if not isinstance(rigs, Rigs) or not isinstance(plant := rigs.plant, OneRig) or not limited:
        raise InputError(
            "give the environment as gymnasium.make makes it: not unwrapped, and with"
            " max_episode_steps of 1 or more"
        )
    if controller.command != rigs.kind.command:
        raise InputError(
            f"the controller commands {controller.command}, this environment takes"
            f" {rigs.kind.command}: wrap the controller in a Cascade, or make the environment with"
            " another action"
        )
    rig, air = rigs.rig, rigs.gauges.air
    observation, info = env.reset(seed=seed, options=options)
    memory = controller.start(controller_observation(rigs, observation, 0.0))
    rows: list[tuple[Any, ...]] = []
    start, total, over, states = info["position"], 0.0, False, [plant.act[0, air]]
    while not over:
        observed = controller_observation(rigs, observation, len(rows) * rigs.period)
        command, memory = controller.step(observed, memory)
        if len(command) != len(rig.muscles):
            raise InputError(
                f"the controller commands {len(command)} muscles, rig {rig.name!r} has"
                f" {len(rig.muscles)}"
            )
        action = rigs.kind.action(command, rigs.top_pressure)
        taken = rigs.kind.commands(action[np.newaxis], (1, len(command)), rigs.top_pressure)[0]
        observation, reward, broken, ended, info = env.step(action)
        over, total = broken or ended, total + float(reward)
        wanted = [(joint.reference, joint.stiffness or 0.0) for joint in observed.joints]
        arrived, stiffness = plant.data.ctrl.tolist(), rigs.stiffness()[0]
        rows.append((info["position"], wanted, info["pressure"], taken, arrived, stiffness))
        states.append(plant.act[0, air])
    columns = map(np.array, zip(*rows, strict=True))
    position, asked, pressure, commands, arrived, stiffness = columns
    muscles = rigs.muscles(0)
    opening = [
        [valve_opening(*one, 0.0) for one in zip(muscles, *now, strict=True)]
        for now in zip(arrived.tolist(), pressure.tolist(), strict=True)
    ]
    atmosphere, index, temperature = (
        np.array([getattr(muscle.chamber, name) for muscle in muscles])
        for name in ("atmosphere", "polytropic_index", "temperature")
    )
    # The chamber's own equation: dm = P^(1 - 1/n) dy / (R T).
    mass = np.maximum(pressure + atmosphere, 0.0) ** (1.0 - 1.0 / index)
    return EpisodeRun(
        joints=tuple(rig.joints),
        travel=np.array([reach.travel for reach in rigs.reaches]),
        period=rigs.period,
        start=start,
        position=position,
        reference=asked[..., 0],
        pressure=pressure,
        command=commands,
        opening=np.array(opening),
        air=np.maximum(np.diff(states, axis=0), 0.0) * (mass / (GAS_CONSTANT * temperature)),
        stiffness=stiffness,
        wanted_stiffness=asked[..., 1],
        reward=total,
    )


def _wrappers(env: gymnasium.Env[Any, Any]) -> Iterator[gymnasium.Env[Any, Any]]:
    while isinstance(env, gymnasium.Wrapper):
        yield env
        env = env.env


@dataclass(frozen=True, kw_only=True)
class Score:
    """Figures of one joint in an episode, or their means over several.

    Attributes:
        rmse: of the position [rad or m].
        worst: largest error of the position [rad or m].
        overshoot: largest travel beyond a new reference, as a share of the step; NaN without steps,
            and where the run broke down.
        settling: median time from a step to the end of what exceeds the band [s]; what has not
            settled when the next step comes counts with the time till then; NaN without steps.
        stiffness_error: RMS error relative to the stiffness wanted; NaN where none is.
        switching: changes of all muscles' valves between filling, shut and exhausting [1/s].
        air: let in by all muscles [kg/s].
        reward: of the episode.
    """

    rmse: float
    worst: float
    overshoot: float
    settling: float
    stiffness_error: float
    switching: float
    air: float
    reward: float


def score(run: EpisodeRun, joint: str | None = None) -> Score:
    """Figures of one joint in one episode; its name may be left out for a rig with one joint.

    Raises:
        InputError: if there is no such joint, or several to choose from.
    """
    if joint not in run.joints and (joint is not None or len(run.joints) > 1):
        raise InputError(f"score: name one joint of the rig; known: {', '.join(run.joints)}")
    column = run.joints.index(joint) if joint else 0
    position, reference = run.position[:, column], run.reference[:, column]
    error, seconds = position - reference, len(position) * run.period
    state = np.sign(run.opening) * (np.abs(run.opening) > OPEN)
    least, start = SETTLED_TRAVEL * float(run.travel[column]), float(run.start[column])
    found = _steps(position, reference, start, least, run.period)
    steps = np.array(found or [(math.nan, math.nan)])
    asked = run.wanted_stiffness[:, column]
    wanted = asked > 0.0
    relative = run.stiffness[wanted, column] / asked[wanted] - 1.0
    return Score(
        rmse=float(np.sqrt(np.mean(error**2))),
        worst=float(np.abs(error).max()),
        overshoot=float(steps[:, 0].max()),
        settling=float(np.median(steps[:, 1])),
        stiffness_error=float(np.sqrt(np.mean(relative**2))) if wanted.any() else math.nan,
        switching=float((np.diff(state, axis=0) != 0.0).sum() / seconds),
        air=float(run.air.sum() / seconds),
        reward=run.reward,
    )


def mean_score(scores: Sequence[Score]) -> Score:
    """Means over episodes; of the RMSE the root of the mean square, of the worst the largest.

    Episodes without steps, or without a wanted stiffness, do not count in the means of these.
    """
    columns = {name: np.array([getattr(one, name) for one in scores]) for name in vars(scores[0])}
    for name in ("overshoot", "settling", "stiffness_error"):
        there = columns[name][~np.isnan(columns[name])]
        columns[name] = there if there.size else np.array([math.nan])
    means = Score(**{name: float(values.mean()) for name, values in columns.items()})
    root, worst = np.sqrt(np.mean(columns["rmse"] ** 2)), columns["worst"].max()
    return replace(means, rmse=float(root), worst=float(worst))


def _steps(
    position: FloatArray, reference: FloatArray, start: float, least: float, period: float
) -> list[tuple[float, float]]:
    """Overshoot [-] and settling time [s] of every jump of a reference that is held after it.

    A jump by less than ``least`` [rad or m] is none, and it settles no nearer than that.
    """
    jumps = (np.flatnonzero(np.diff(reference) != 0.0) + 1).tolist()
    # A reference that moves all the time has no steps.
    if len(jumps) > 0.1 * len(reference):
        return []
    steps: list[tuple[float, float]] = []
    for begin, end in pairwise([0, *jumps, len(reference)]):
        wanted = float(reference[begin])
        height = wanted - (float(position[begin - 1]) if begin else start)
        if abs(height) < least:
            continue
        beyond = (position[begin:end] - wanted) * math.copysign(1.0, height)
        band = max(SETTLED_SHARE * abs(height), least)
        outside = np.flatnonzero(~(np.abs(beyond) <= band))  # so is NaN, where a run broke down
        settled = (int(outside[-1]) + 1) * period if len(outside) else 0.0
        steps.append((float(np.max(beyond, initial=0.0)) / abs(height), settled))
    return steps
