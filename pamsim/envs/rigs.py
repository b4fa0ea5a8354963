"""Reset and step of rigs in episodes, shared by single and vector environments.

Everything is kept in rows, one per rig, and computed element by element, so that a rig's results
do not depend on how many others go with it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.engine import checks
from pamsim.engine.equilibrium import moment_arms, rest_positions
from pamsim.engine.gauges import Gauges
from pamsim.envs import EPISODE
from pamsim.envs.actions import KINDS
from pamsim.envs.episode import STIFFNESS, TORQUE, Episode, Episodes
from pamsim.envs.plant import ManyRigs, OneRig, Plant, WarpRigs
from pamsim.envs.sample import (
    ERROR_SHARE,
    Rules,
    first_sample,
    instruments,
    next_sample,
    set_errors,
)
from pamsim.envs.scales import LIMIT, JointStiffness, observed_signals, reaches_of
from pamsim.envs.settings import EnvSettings, ResetOptions, reset_options

FloatArray = NDArray[np.float64]

_STATE = ("_sample", "_history", "_command", "_measured", "true", "observation")
"""What changes from step to step besides the plant and the instruments' memory."""


class Rigs:
    """Rigs that are stepped together.

    Args:
        settings: of the environment.
        count: how many rigs.
        threads: to step them on, 0 for one per processor; None for a single rig without a pool.
        rows: of an episode that are made at first; more when it goes on.
        device: of Warp, which steps them in place of threads; None for MuJoCo itself.
        precision: of the muscles there.

    Attributes:
        rig: as loaded.
        usual: options of a `reset` that is given none.
        top_pressure: set point of an action of 1; scales measured pressures too [Pa].
        period: between samples [s].
        reaches: of each joint: what tasks and observations are scaled by.
        signals: names and scales of observations.
        actions: names of actions.
        observation: (n, o) readings and the references of the next sample; not changed afterwards.
        true: (n, j + m) positions [rad or m] and pressures [Pa] behind it.
        observation_space: of one rig.
        action_space: of one rig.

    Raises:
        InputError: if the rig or an option does not fit.
    """

    def __init__(
        self,
        settings: EnvSettings,
        count: int,
        threads: int | None = None,
        rows: int = EPISODE + 1,
        device: str | None = None,
        precision: str = "float64",
    ) -> None:
        self.settings = settings
        self.rig = rig = settings.loaded_rig()
        self.kind = KINDS[settings.action]
        top = settings.top_pressure
        self.top_pressure = rig.supply_pressure if top is None else top
        if self.top_pressure > rig.supply_pressure:
            raise InputError(
                f"top_pressure {self.top_pressure / 1e3:g} kPa is above the supply's"
                f" {rig.supply_pressure / 1e3:g} kPa"
            )
        given = settings.start_pressure
        self._start_pressure = 0.5 * self.top_pressure if given is None else given
        self.usual = self.options(None)
        timestep = float(rig.model.opt.timestep)
        self.period = settings.frame_skip * timestep
        muscles = len(rig.muscles)
        rest = rest_positions(
            rig, np.full(muscles, 0.5 * self.top_pressure), rig.model.qpos0.copy()
        )
        arms = moment_arms(rig, rest)
        self.reaches = reaches_of(rig, self.top_pressure, rest, arms)
        self.signals = observed_signals(rig.joints, rig.muscles, self.reaches, self.top_pressure)
        self.actions = self.kind.names(tuple(rig.muscles))
        self.observation_space = gymnasium.spaces.Box(
            -LIMIT, LIMIT, (len(self.signals.names),), np.float64
        )
        self.action_space = self.kind.space(muscles)
        self._episodes = Episodes(settings, rig, self.reaches, self.period)
        self._gauge = instruments(settings, rig, count)
        first = Episode(
            values={},
            load=settings.load_range[0],
            start_pressure=self.usual.start_pressure,
            target={},
            seeds=(),
        )
        resting, state = self._episodes.rest(first)
        model = resting.model
        self.plant: Plant
        if device is not None:
            self.plant = WarpRigs(rig, model, count, device, precision)
        elif threads is None:
            self.plant = OneRig(rig, model, state)
        else:
            self.plant = ManyRigs(rig, model, count, threads)
        self._chambers = Gauges(model, count)
        self._stiffness = JointStiffness(arms)
        self._stiff, self._pushed = settings.task == "stiffness", settings.task == "disturbance"
        delays = [muscle.valve.delay + settings.delay for muscle in rig.muscles.values()]
        self._stretches, depth = _stretches(
            [round(delay / timestep) for delay in delays], settings.frame_skip
        )
        self._each = np.arange(muscles)
        self._history = np.empty((count, depth, muscles))
        self._command = np.empty((count, muscles))
        self._rules = Rules(
            centre=self.signals.centre,
            scale=self.signals.scale,
            unit=np.array([ERROR_SHARE * reach.travel for reach in self.reaches]),
            span=self.kind.span(self.top_pressure),
            effort=float(settings.effort),
            period=self.period,
        )
        self._positions = _places(rig.position_addresses)
        self._joints, self._all = len(rig.joints), np.arange(count)
        self._drawn: dict[int, Episode] = {}
        self._table = np.zeros((count, rows, self._episodes.columns))
        self._sample = np.zeros(count, dtype=np.int64)
        self._most = 0  # no sample is beyond it
        self._measured = np.zeros((count, self._joints + muscles))
        self.true = np.zeros((count, self._joints + muscles))
        self.observation = np.zeros((count, len(self.signals.names)))

    def options(self, given: Mapping[str, Any] | None) -> ResetOptions:
        """Options of `reset`, checked, see `reset_options`."""
        return reset_options(given, self.rig, self._start_pressure)

    def reset(self, generators: Mapping[int, np.random.Generator], asked: ResetOptions) -> None:
        """Begin new episodes in some rigs, each drawn from its own generator."""
        drawn = {at: self._episodes.draw(rng, asked) for at, rng in generators.items()}
        self._put(drawn, {})
        new = np.zeros(len(self._all), dtype=np.bool_)
        new[list(drawn)] = True
        self._sample[new] = 0
        for at, episode in drawn.items():
            self._history[at] = self._command[at] = self.kind.rest(np.array(episode.start_pressure))
        # New arrays: the caller may still hold those of the last step.
        self.true, self.observation = self.true.copy(), self.observation.copy()
        self.true[new] = self._read()[new]
        seen = self._gauge, self._measured, self._table, self._rules, self.observation
        first_sample(new, self.true, *seen)

    def _put(self, drawn: Mapping[int, Episode], states: Mapping[int, FloatArray]) -> None:
        """Give some rigs an episode, from rest or in a state."""
        rests = {at: self._episodes.rest(episode) for at, episode in drawn.items()}
        self.plant.put({at: (rig.model, states.get(at, rest)) for at, (rig, rest) in rests.items()})
        self._drawn.update(drawn)
        for at, (rig, _) in rests.items():
            self._chambers.set_parameters(at, rig.model)
            self._table[at] = self._episodes.table(drawn[at], self._table.shape[1])
            set_errors(self._gauge, at, rig, self.period)

    def rewind(self, over: NDArray[np.bool_]) -> None:
        """Allow further steps of rigs whose episode is over (n,), until they are reset."""
        self._sample[over] = 0

    def step(self, action: Any) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Advance all rigs by one period.

        Args:
            action: (n, ...) of the kind's space.

        Returns:
            Rewards (n,), and which rigs have broken down (n,).

        Raises:
            InputError: for an action that is none, or before the first reset.
            EngineError: if the environment is closed.
            InvariantError: while `pamsim.checks` is on, if a state cannot be.
        """
        if len(self._drawn) < len(self._all):
            raise InputError("step before reset: call reset() first, it begins an episode")
        command = self.kind.commands(action, self._command.shape, self.top_pressure)
        self._most += 1
        if self._most >= self._table.shape[1]:
            self._make_room()
        if self._pushed:
            self.plant.push(self._table[self._all, self._sample, self._block(TORQUE)])
        self._advance(command)
        self.true = self._read()
        # New arrays: the caller may still hold those of the last step.
        self.observation = np.empty_like(self.observation)
        reward, broken = np.empty(len(command)), np.empty(len(command), dtype=np.bool_)
        next_sample(
            self.true,
            self._gauge,
            self._measured,
            self._table,
            self._sample,
            command,
            self._command,
            self._rules,
            self.observation,
            reward,
            broken,
        )
        if self._stiff:
            wanted = self._table[self._all, self._sample - 1, self._block(STIFFNESS)]
            missed = np.abs(self.stiffness() / wanted - 1.0).mean(axis=1)
            reward -= np.where(broken, 0.0, missed)
        return reward, broken

    def _block(self, number: int) -> slice:
        return slice(number * self._joints, (number + 1) * self._joints)

    def _advance(self, command: FloatArray) -> None:
        """Let the plant make the time steps of a period."""
        late = self._late(command)
        if not checks.is_on():
            self.plant.step(late)
            return
        before = self.plant.time()
        self.plant.step(late)
        checks.raise_found()
        for begin, end in zip(before.tolist(), self.plant.time().tolist(), strict=True):
            checks.check_clock(begin, end, self.period)

    def _make_room(self) -> None:
        """Continue the episodes' rows if one of them nears its end."""
        self._most = int(self._sample.max()) + 1
        count, rows, columns = self._table.shape
        if self._most < rows:
            return
        self._table = np.empty((count, 2 * rows, columns))
        for at, episode in self._drawn.items():
            self._table[at] = self._episodes.table(episode, 2 * rows)

    def _late(self, command: FloatArray) -> list[tuple[int, FloatArray]]:
        """Commands that reach the valves in a period: time steps and (n, m) of each stretch."""
        history = self._history
        if history.shape[1] == 1:
            return [(self.settings.frame_skip, command)]
        history[:, 1:] = history[:, :-1]
        history[:, 0] = command
        return [(count, history[:, old, self._each]) for count, old in self._stretches]

    @property
    def sample(self) -> NDArray[np.int64]:
        """(n,) steps of the running episodes."""
        return self._sample

    def stiffness(self) -> FloatArray:
        """(n, j) present stiffness of the joints with shut valves [N m/rad or N/m]."""
        each = self.rows, self.plant.length, self.true[:, self._joints :]
        return np.array(list(map(self._stiffness, *(values.tolist() for values in each))))

    def information(self) -> dict[str, FloatArray]:
        """(n, j) true ``position`` [rad or m] and (n, m) ``pressure`` [Pa], gauge."""
        true, joints = self.true, self._joints
        return {"position": true[:, :joints], "pressure": true[:, joints:]}

    def warnings(self) -> int:
        """Number of engine warnings in the running episodes."""
        return self.plant.warnings()

    def air(self) -> FloatArray:
        """(n, m) air states y of the chambers, see `pamsim.physics.chamber`."""
        return self.plant.act[:, self._chambers.air]

    @property
    def rows(self) -> FloatArray:
        """(n, m, SIZE) parameters of the muscles as they are in this episode."""
        return self._chambers.rows

    def state(self) -> dict[str, Any]:
        """All that the next steps depend on, for `restore`."""
        return {
            "drawn": dict(self._drawn),
            "plant": {at: self.plant.state(at) for at in self._drawn},
            "memory": (self._gauge.held.copy(), self._gauge.before.copy()),
            **{name: getattr(self, name).copy() for name in _STATE},
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from what `state` returned for rigs with the same settings."""
        if state["drawn"]:
            self._most = int(state["_sample"].max())
            rows = self._table.shape[1]
            while rows <= self._most:
                rows *= 2
            self._table = np.zeros((len(self._all), rows, self._episodes.columns))
            self._put(state["drawn"], state["plant"])
        for name in _STATE:
            setattr(self, name, state[name].copy())
        for own, kept in zip((self._gauge.held, self._gauge.before), state["memory"], strict=True):
            own[:] = kept

    def close(self) -> None:
        """Stop; the rigs cannot be stepped any more."""
        self.plant.close()

    def _read(self) -> FloatArray:
        readings = np.empty_like(self.true)
        readings[:, : self._joints] = self.plant.position[:, self._positions]
        readings[:, self._joints :] = self._chambers.pressures(self.plant.act, self.plant.length)
        return readings


def _places(addresses: list[int]) -> slice | NDArray[np.int64]:
    """Index of columns: a slice where they lie side by side, which is several times as quick."""
    first = addresses[0]
    if addresses == list(range(first, first + len(addresses))):
        return slice(first, first + len(addresses))
    return np.array(addresses)


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
