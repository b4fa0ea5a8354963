"""Reset and step of rigs in episodes, shared by single and vector environments.

Everything is kept in rows, one per rig, and computed element by element, so that a rig's results
do not depend on how many others go with it.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import EngineError, InputError
from pamsim.core.units import FloatArray
from pamsim.engine import checks
from pamsim.engine.gauges import Gauges
from pamsim.engine.joint_stiffness import stiffness_of_joints
from pamsim.engine.rig import Rig, load_rig
from pamsim.envs import EPISODE
from pamsim.envs.actions import KINDS
from pamsim.envs.episode import STIFFNESS, TORQUE, Episode, Episodes
from pamsim.envs.plant import ManyRigs, OneRig, fixed_tendons
from pamsim.envs.sample import BREAKDOWN, SUCCESS, new_sampling, take_sample
from pamsim.envs.scales import LIMIT, observed_signals, reaches_of
from pamsim.envs.settings import EnvSettings, check_supply
from pamsim.gpu.worlds import Worlds
from pamsim.physics.record import Parameters, view

_STATE = ("drawn", "_sampling", "_table", "_full", "_terms", "sample", "true", "observation")
"""What changes from step to step besides the plant."""


class Rigs:
    """Rigs that are stepped together; a copy or pickle continues the same episodes.

    Args:
        settings: of the environment.
        count: how many rigs.
        threads: to step them on, 0 for one per processor; None for a single rig without a pool.
        device: of Warp, which steps them in place of threads; None for MuJoCo itself.
        precision: of the muscles there.

    Attributes:
        period: between samples [s].
        top_pressure: set point of an action of 1; scales measured pressures too [Pa].
        reaches: of each joint: what tasks and observations are scaled by.
        signals: names and scales of observations.
        actions: names of actions.
        gauges: of the muscles, with their parameters in the running episodes.
        drawn: number of a rig -> its running episode, with its load and parameters.
        sample: (n,) steps of the running episodes.
        observation: (n, o) readings and the references of the next sample; not changed afterwards.
        true: (n, j + m) positions [rad or m] and pressures [Pa] behind it.
        closed: whether steps are refused.

    Raises:
        InputError: if the rig or an option does not fit.
    """

    def __init__(
        self,
        settings: EnvSettings,
        count: int,
        threads: int | None = None,
        device: str | None = None,
        precision: str = "float64",
    ) -> None:
        self._made = settings, count, threads, device, precision
        self.settings, self.kind = settings, KINDS[settings.action]
        self.rig = rig = settings.rig if isinstance(settings.rig, Rig) else load_rig(settings.rig)
        top = settings.top_pressure
        top = check_supply("top_pressure", rig.supply_pressure if top is None else top, rig)
        self.top_pressure = top
        self.reaches, arms = reaches_of(rig, top)
        if fixed_tendons(rig.model) is None:
            arms[:] = np.nan  # they change with the positions
        self._arms = np.tile(arms, (count, 1, 1))
        self.signals = observed_signals(rig, self.reaches, top)
        each = self.kind.quantities
        self.actions = tuple(f"{muscle}.{one}" for muscle in rig.muscles for one in each)
        self._joints, self._muscles = len(rig.joints), len(rig.muscles)
        self.observation = np.zeros((count, len(self.signals.names)))
        self.observation_space = gymnasium.spaces.Box(
            -LIMIT, LIMIT, self.observation.shape[1:], np.float64
        )
        self.action_space = self.kind.space(self._muscles)
        timestep, valves = rig.model.opt.timestep, [one.valve for one in rig.muscles.values()]
        if any(valve.closing_delay for valve in valves):
            raise InputError(
                f"rig {rig.name!r} has a valve.closing_delay, which acts in pamsim.simulate only;"
                " set it to 0 for an environment"
            )
        late = [round((valve.delay + settings.delay) / timestep) for valve in valves]
        self._stretches = _stretches(late, settings.frame_skip)
        span = 0.5 * top if settings.action == "pressure_set" else 1.0
        remembered = count, 2 + max(late) // settings.frame_skip
        self._sampling = new_sampling(settings, rig, self.signals, self.reaches, span, remembered)
        self.period = self._sampling.period
        self._episodes = Episodes(settings, rig, self.reaches, top, self.period)
        at_rest, state = self._episodes.rest(self._episodes.asked())
        self.plant: OneRig | ManyRigs | Worlds
        if device is not None:
            self.plant = Worlds(rig, at_rest.model, count, precision=precision, device=device)
        elif threads is None:
            self.plant = OneRig((at_rest.model, state))
        else:
            self.plant = ManyRigs(at_rest.model, count, threads)
        self.gauges, self.closed = Gauges(at_rest.model, count), False
        self._views: dict[int, list[Parameters]] = {}
        # A slice of columns that lie side by side is several times as quick as their numbers.
        places, self._dofs = rig.position_addresses, rig.velocity_addresses
        beside = slice(places[0], places[0] + len(places))
        self._positions = beside if (np.diff(places) == 1).all() else places
        self.drawn: dict[int, Episode] = {}
        self._full = False  # whether a table is at its last row but one
        # Rows of the episodes; more of them once one goes on.
        self._table = np.zeros((count, EPISODE + 1, self._episodes.columns))
        self.sample, self._all = np.zeros(count, dtype=np.int64), np.arange(count)
        self.true = np.zeros((count, self._joints + self._muscles))
        self._terms = np.zeros((count, 3))  # of the reward: position, effort, stiffness

    def reset(
        self,
        generators: Mapping[int, np.random.Generator],
        options: Mapping[str, Any] | None = None,
    ) -> None:
        """Begin new episodes in some rigs, each drawn from its own generator.

        Raises:
            InputError: for an unknown option.
            ParameterError: for a number out of range.
        """
        asked = self._episodes.asked(options)
        drawn = {at: self._episodes.draw(rng, asked) for at, rng in generators.items()}
        self._put(drawn, {})
        new, commands = np.array(list(drawn), dtype=np.int64), self._sampling.commands
        commands[new] = self.kind.rest(np.array(asked.start_pressure))
        self.sample[new] = 0
        self._take(new, True, commands[:, 0].copy())

    def _put(self, drawn: Mapping[int, Episode], states: Mapping[int, FloatArray]) -> None:
        """Give some rigs an episode, from rest or in a state."""
        rests = {at: self._episodes.rest(episode) for at, episode in drawn.items()}
        self.plant.put({at: (rig.model, states.get(at, rest)) for at, (rig, rest) in rests.items()})
        self.drawn.update(drawn)
        for at, (rig, _) in rests.items():
            self.gauges.set_parameters(at, rig.model)
            self._views.pop(at, None)
            own = fixed_tendons(rig.model)
            if own is not None:  # an episode may have pulleys of its own
                self._arms[at] = own[:, self._positions]
            self._sampling.set_errors(at, rig, rounded=self.settings.instruments)
            self._table[at] = self._episodes.table(drawn[at], self._table.shape[1])

    def step(self, action: Any) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Advance all rigs by one period under actions (n, ...) of the kind's space.

        Returns rewards (n,), and which rigs have broken down (n,).

        Raises:
            InputError: for an action that is none, or before the first reset.
            EngineError: if the environment is closed.
            InvariantError: while `pamsim.checks` is on, if a state cannot be.
        """
        if len(self.drawn) < len(self._all):
            raise InputError("step before reset: call reset() first, it begins an episode")
        shape = len(self._all), self._muscles
        command = self.kind.commands(action, shape, self.top_pressure)
        if self.closed:
            raise EngineError("this environment is closed; make a new one")
        rows = self._table.shape[1]
        if self._full and self.sample.max() + 1 >= rows:
            more = [self._episodes.table(self.drawn[at], 2 * rows) for at in range(len(self._all))]
            self._table = np.array(more)
        if self.settings.may_ask("disturbance"):
            self.plant.push(self._asked(TORQUE), self._dofs)
        before = self.plant.time.tolist() if checks.is_on() else []
        recent = self._sampling.commands
        recent[:, 0] = command
        for count, arriving in self._stretches:
            self.plant.step(recent[arriving], count)
        if before:
            checks.raise_found()
            for begin, end in zip(before, self.plant.time.tolist(), strict=True):
                checks.check_clock(begin, end, self.period)
        wanted = self._asked(STIFFNESS) if self.settings.may_ask("stiffness") else np.zeros(0)
        broken = self._take(self._all, False, command)
        if wanted.any():
            there = np.where(wanted > 0.0, wanted, np.inf)
            missed = np.where(wanted > 0.0, np.abs(self.stiffness() / there - 1.0), 0.0)
            self._terms[:, 2] = np.where(broken, 0.0, -missed.mean(axis=1))
        return self._rewards(broken), broken

    def _rewards(self, broken: NDArray[np.bool_]) -> FloatArray:
        """(n,) of the present step: the sum of its terms, or by a function of one's own."""
        own = self.settings.reward
        if own is None:
            return self._terms[:, 0] + self._terms[:, 1] + self._terms[:, 2]
        reward = np.array(own(self.information()), dtype=float)
        if reward.shape != broken.shape or not np.isfinite(reward[~broken]).all():
            raise InputError(
                f"the reward function returns shape {reward.shape} or a number that is not finite;"
                f" return shape {broken.shape}, a finite number for each rig"
            )
        reward[broken] = BREAKDOWN
        return reward

    def _take(self, rigs: NDArray[np.int64], first: bool, command: FloatArray) -> NDArray[np.bool_]:
        """Take the next sample of some rigs -> which of all have broken down."""
        plant, joints = self.plant, self._joints
        # New arrays: the caller may still hold those of the last step.
        self.true, self.observation = np.empty_like(self.true), self.observation.copy()
        self.true[:, :joints] = plant.position[:, self._positions]
        self.true[:, joints:] = self.gauges.pressures(plant.act, plant.length)
        self._terms, broken = self._terms.copy(), np.empty(len(command), dtype=np.bool_)
        now = self.true, command, self._table, self.sample, self.observation, self._terms, broken
        self._full = take_sample(self._sampling, rigs, first, *now)
        self._terms[rigs, 2] = 0.0
        if first:
            self._terms[rigs] = 0.0
        return broken

    def _asked(self, block: int) -> FloatArray:
        """(n, j) of a block of the episodes' columns for the present step."""
        columns = slice(block * self._joints, (block + 1) * self._joints)
        return self._table[self._all, self.sample, columns]

    def stiffness(self) -> FloatArray:
        """(n, j) present stiffness of the joints with shut valves [N m/rad or N/m].

        NaN for a rig whose tendons are not all fixed.
        """
        signals = zip(self.plant.length.tolist(), self.true[:, self._joints :], strict=True)
        return np.array(
            [
                stiffness_of_joints(self._arms[at], self.muscles(at), length, pressure.tolist())
                for at, (length, pressure) in enumerate(signals)
            ]
        )

    def muscles(self, number: int) -> list[Parameters]:
        """Parameters of the muscles of one rig in its running episode."""
        if number not in self._views:
            self._views[number] = [*map(view, self.gauges.rows[number])]
        return self._views[number]

    def information(self) -> dict[str, NDArray[Any]]:
        """What `RigEnv` gives beside an observation, a row (n, ...) for each of n rigs."""
        true, joints = self.true, self._joints
        # Row k of the table holds what was wanted at the end of step k.
        asked = self._table[self._all, np.maximum(self.sample - 1, 0), :joints]
        missed = np.abs(true[:, :joints] - asked) / self._sampling.unit
        success: NDArray[Any] = missed.max(axis=1) < SUCCESS
        return {
            "position": true[:, :joints],
            "pressure": true[:, joints:],
            "target": asked,
            "is_success": success,
            "reward_position": self._terms[:, 0],
            "reward_effort": self._terms[:, 1],
            "reward_stiffness": self._terms[:, 2],
        }

    def __getstate__(self) -> dict[str, Any]:
        """How they were made, and all that the next steps depend on."""
        kept = {name: getattr(self, name) for name in _STATE}
        states = {at: self.plant.state(at) for at in self.drawn}
        return {"made": self._made, "states": states, **kept}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the rigs again and continue their episodes."""
        Rigs.__init__(self, *state["made"])
        if state["drawn"]:
            self._put(state["drawn"], state["states"])
        vars(self).update({name: state[name] for name in _STATE})


def _stretches(late: list[int], steps: int) -> list[tuple[int, tuple[Any, ...]]]:
    """Stretches of a period of some steps, by each muscle's delay in steps.

    Of each its steps, and where the commands that reach the valves then lie among those of this and
    the last periods.
    """
    if not any(late):
        return [(steps, (slice(None), 0))]
    delay, muscles = np.array(late), np.arange(len(late))
    ends = sorted({0, steps, *(delay % steps).tolist()})
    return [
        (end - begin, (slice(None), delay // steps + (begin < delay % steps), muscles))
        for begin, end in pairwise(ends)
    ]
