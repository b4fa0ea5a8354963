"""Many rigs as one vector environment, stepped by the engine's batch."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.envs import EPISODE
from pamsim.envs.rigs import Rigs
from pamsim.envs.settings import env_settings


class RigVectorEnv(VectorEnv[FloatArray, NDArray[Any], NDArray[Any]]):
    """Rigs with episodes of their own, bit-identical to as many single environments.

    Actions, observations, rewards and arguments are those of `pamsim.envs.rig_env.RigEnv`. Rig i is
    seeded as ``SyncVectorEnv`` seeds its i-th environment. After an episode's end the next step
    begins a new one and ignores the action. A copy or pickle continues the same episodes. `dt` is
    the time between two actions [s].

    With ``device`` the rigs are stepped by Warp, see `pamsim.gpu.worlds.Worlds`, and agree with
    single environments to the rounding of single precision; resets stay on the CPU.

    Args:
        num_envs: how many rigs.
        threads: to step them on; 0 for one per processor.
        max_episode_steps: after which an episode is truncated.
        device: name of Warp's, such as ``cuda:0`` or ``cpu``; None for MuJoCo itself.
        precision: of the muscles on that device: ``float64`` or ``float32``.
        **options: see `pamsim.envs.settings.EnvSettings`.

    Raises:
        InputError: for an unknown option, or one that does not fit the rig; if a device is given
            and Warp is not installed, or the rig has what does not run on it.
        ParameterError: for a number out of range.
    """

    # Gymnasium reads it from the class and from the object.
    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        *,
        threads: int = 0,
        max_episode_steps: int = EPISODE,
        device: str | None = None,
        precision: str = "float64",
        **options: Any,
    ) -> None:
        self.closed = True  # gymnasium 1.1 closes what is refused here, too
        for name, given in (("num_envs", num_envs), ("max_episode_steps", max_episode_steps)):
            if given < 1:
                raise InputError(f"{name} = {given}; give 1 or more")
        self.num_envs, self._steps = num_envs, max_episode_steps
        self.rigs = Rigs(env_settings(options), num_envs, threads, device, precision)
        self.closed, self.dt = False, self.rigs.period
        self.single_observation_space = self.rigs.observation_space
        self.single_action_space = self.rigs.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators = [seeding.np_random()[0] for _ in range(num_envs)]
        self._over, self._every = np.zeros(num_envs, dtype=np.bool_), np.ones(num_envs, np.bool_)

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin new episodes in all rigs, or in those of ``options["reset_mask"]``.

        Args:
            seed: of the first rig, the others following on it; or one per rig.
            options: ``reset_mask``: (n,) of bool; and those of `RigEnv.reset`, for all of them.

        Raises:
            InputError: if there is not one seed or mask entry per rig; for an unknown option.
            ParameterError: for a number out of range.
        """
        asked = dict(options or {})
        given = asked.pop("reset_mask", None)
        mask = self._every if given is None else np.asarray(given, dtype=np.bool_)
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed
        for name, each in (("seeds", seeds), ("reset_mask", mask)):
            if each is not None and len(each) != self.num_envs:
                raise InputError(f"{len(each)} {name} for {self.num_envs} rigs; give one each")
        for number, own in enumerate(seeds or []):
            if own is not None and mask[number]:
                self._generators[number], _ = seeding.np_random(own)
        self._begin(mask, asked)
        self._over = self._over & ~mask
        return self.rigs.observation, self._information(mask)

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Hold an action per rig for one period; rigs whose episode is over begin a new one.

        Raises:
            InputError: for an action that is none, or before the first reset.
        """
        over = self._over
        self.rigs.sample[over] = 0  # their results of this step are replaced below
        reward, broken = self.rigs.step(actions)
        ended = self.rigs.sample >= self._steps
        if over.any():
            reward[over], broken[over], ended[over] = 0.0, False, False
            self._begin(over, {})
        self._over = broken | ended
        return self.rigs.observation, reward, broken, ended, self._information(self._every)

    def _begin(self, mask: NDArray[np.bool_], options: dict[str, Any]) -> None:
        self.rigs.reset({int(at): self._generators[at] for at in np.flatnonzero(mask)}, options)

    def _information(self, mask: NDArray[np.bool_]) -> dict[str, Any]:
        """The same as for a single environment, a row per rig; a mask marks the new rows."""
        shown = self.rigs.information()
        return {**shown, **{f"_{name}": mask.copy() for name in shown}}

    def close_extras(self, **kwargs: Any) -> None:
        """Close the simulations."""
        self.rigs.closed = True

    __copy__ = copy.deepcopy
