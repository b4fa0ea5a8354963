"""Reset and step of arms in episodes, shared by single and vector environments.

Everything is kept in rows, one per arm, and computed element by element, so that an arm's results
do not depend on how many others go with it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.engine.chamber_gauge import ChamberGauge
from pamsim.envs.actions import KINDS
from pamsim.envs.episode import COLUMNS, STIFFNESS, TORQUE, Episodes
from pamsim.envs.instruments import instruments, set_errors
from pamsim.envs.observation_and_reward import first_sample, next_sample
from pamsim.envs.plant import ManyArms, OneArm, Plant
from pamsim.envs.reach import JointStiffness, reach_of
from pamsim.envs.reset import RestStates
from pamsim.envs.settings import ArmSettings

FloatArray = NDArray[np.float64]

LOW = np.array([-2.0 * math.pi, -1e3, -0.2, -0.2, -math.pi, -1e2, -1e4, 0.0])
HIGH = np.array([2.0 * math.pi, 1e3, 2.0, 2.0, math.pi, 1e2, 1e4, 1e4])
"""Ends of the observation space, wider than any observation of an arm that has not broken down."""


class Arms:
    """Arms that are stepped together.

    Args:
        settings: of the environment.
        kind: of its actions, one of `pamsim.envs.actions.KINDS`.
        count: how many arms.
        threads: to step them on, 0 for one per processor; None for a single arm without a pool.

    Attributes:
        rig: as loaded.
        supply: pressure that measured and commanded ones are scaled by [Pa].
        period: between samples [s].
        reach: what tasks are scaled by.
        observation: (n, 8) readings and the reference of the next sample; not changed afterwards.
        true: (n, 3) angles [rad] and pressures [Pa] behind it.
        observation_space: of one arm.
        action_space: of one arm.

    Raises:
        InputError: if the rig or an option does not fit.
    """

    def __init__(
        self, settings: ArmSettings, kind: str, count: int, threads: int | None = None
    ) -> None:
        self.settings = settings
        self.rig = rig = settings.loaded_rig()
        self._kind = KINDS[kind]
        self.supply = rig.supply_pressure
        if settings.start_pressure > self.supply:
            raise InputError(
                f"start_pressure {settings.start_pressure / 1e3:g} kPa is above the supply's"
                f" {self.supply / 1e3:g} kPa"
            )
        timestep = float(rig.model.opt.timestep)
        self.period = settings.frame_skip * timestep
        self.reach = reach_of(rig)
        self.observation_space = gymnasium.spaces.Box(LOW, HIGH, dtype=np.float64)
        self.action_space = self._kind.space()
        self._episodes = Episodes(settings, rig, self.reach, self.period)
        self.samples = self._episodes.samples
        self._rest = RestStates(rig, self._kind, settings.start_pressure, self.period)
        self._instruments = instruments(settings, rig.sensor, count)
        _, model, _ = self._rest.at({}, settings.load_range[0])
        self._plant: Plant = (
            OneArm(rig) if threads is None else ManyArms(rig, model, count, threads)
        )
        self._gauge = ChamberGauge(model, count)
        self._stiffness = JointStiffness(rig)
        self._stiff, self._pushed = settings.task == "stiffness", settings.task == "disturbance"
        delays = [muscle.valve.delay + settings.delay for muscle in rig.muscles.values()]
        self._stretches, depth = _stretches(
            [round(delay / timestep) for delay in delays], settings.frame_skip
        )
        self._history = np.empty((count, depth, 2))
        self._command = np.empty((count, 2))
        self._span, self._effort = self._kind.span(self.supply), float(settings.effort)
        self._table = np.zeros((count, self.samples + 1, COLUMNS))
        self._rows = np.arange(count)
        self._sample = np.zeros(count, dtype=np.int64)
        self._measured, self.true = np.zeros((count, 3)), np.zeros((count, 3))
        self.observation = np.zeros((count, len(LOW)))

    def reset(self, generators: Mapping[int, np.random.Generator]) -> None:
        """Begin new episodes in some arms, each drawn from its own generator."""
        drawn = {arm: self._episodes.draw(generator) for arm, generator in generators.items()}
        rests = {arm: self._rest.at(episode.values, episode.load) for arm, episode in drawn.items()}
        self._plant.put({arm: (model, state) for arm, (_, model, state) in rests.items()})
        for arm, (_, model, _) in rests.items():
            self._gauge.set_parameters(arm, model)
            self._table[arm] = drawn[arm].table
        arms = list(drawn)
        self._sample[arms] = 0
        start = self._kind.rest(self.settings.start_pressure)
        self._history[arms] = self._command[arms] = start
        new = np.isin(self._rows, arms)
        self.true[new] = self._read()[new]
        for arm, (rig, _, _) in rests.items():
            set_errors(self._instruments, arm, rig.sensor, self.period)
        self.observation = self.observation.copy()
        first_sample(
            new,
            self.true,
            self._instruments,
            self._measured,
            self._table,
            self.supply,
            self.observation,
        )

    def rewind(self, over: NDArray[np.bool_]) -> None:
        """Allow further steps of arms whose episode is over (n,), until they are reset."""
        self._sample[over] = 0

    def step(self, action: NDArray[Any]) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Advance all arms by one period.

        Args:
            action: (n, ...) of the kind's space.

        Returns:
            Rewards (n,), and which arms have broken down (n,).
        """
        command = self._kind.commands(action, self.supply)
        if self._pushed:
            self._plant.push(self._table[self._rows, self._sample, TORQUE])
        self._plant.step(self._late(command))
        self.true = self._read()
        # New arrays: the caller may still hold those of the last step.
        self.observation = np.empty_like(self.observation)
        reward, broken = np.empty(len(command)), np.empty(len(command), dtype=np.bool_)
        next_sample(
            self.true,
            self._instruments,
            self._measured,
            self._table,
            self._sample,
            command,
            self._command,
            self._span,
            self._effort,
            self.period,
            self.supply,
            self.observation,
            reward,
            broken,
        )
        if self._stiff:
            wanted = self._table[self._rows, self._sample - 1, STIFFNESS]
            reward -= np.where(broken, 0.0, np.abs(self.stiffness() / wanted - 1.0))
        return reward, broken

    def _late(self, command: FloatArray) -> list[tuple[int, FloatArray]]:
        """Commands that reach the valves in a period: time steps and (n, 2) of each stretch."""
        history = self._history
        if history.shape[1] == 1:
            return [(self.settings.frame_skip, command)]
        history[:, 1:] = history[:, :-1]
        history[:, 0] = command
        return [(count, history[:, old, (0, 1)]) for count, old in self._stretches]

    def ended(self) -> NDArray[np.bool_]:
        """(n,) whether an episode's time is up."""
        return self._sample >= self.samples

    def stiffness(self) -> FloatArray:
        """(n,) present stiffness of the joints between shut muscles [N m/rad]."""
        length, pressure = self._plant.length.tolist(), self.true[:, 1:].tolist()
        rows = self.rows.tolist()
        return np.array(
            [
                self._stiffness(row, at, held)
                for row, at, held in zip(rows, length, pressure, strict=True)
            ]
        )

    def warnings(self) -> int:
        """Number of engine warnings in the running episodes."""
        return self._plant.warnings()

    def air(self) -> FloatArray:
        """(n, 2) air states y of the chambers, see `pamsim.pneumatics.chamber`."""
        return self._plant.act[:, self._gauge.air]

    @property
    def rows(self) -> FloatArray:
        """(n, 2, SIZE) parameters of the muscles as they are in this episode."""
        return self._gauge.rows

    def close(self) -> None:
        """Release the callbacks; the arms cannot be stepped any more."""
        self._plant.close()

    def _read(self) -> FloatArray:
        readings = np.empty((len(self._rows), 3))
        readings[:, 0] = self._plant.angle
        self._gauge.read(self._plant.act, self._plant.length, readings[:, 1:])
        return readings


def _stretches(delays: list[int], steps: int) -> tuple[list[tuple[int, tuple[int, ...]]], int]:
    """Which commands reach the valves during a period.

    Args:
        delays: of each muscle, in time steps.
        steps: time steps of a period.

    Returns:
        For each stretch of the period its time steps and how many periods old each muscle's command
        is then; and how many commands have to be remembered.
    """
    ends = sorted({delay % steps for delay in delays} - {0})
    stretches = []
    for begin, end in zip([0, *ends], [*ends, steps], strict=True):
        old = tuple(delay // steps + (begin < delay % steps) for delay in delays)
        stretches.append((end - begin, old))
    return stretches, 1 + max(max(old) for _, old in stretches)
