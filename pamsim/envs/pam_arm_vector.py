"""Many arms as one vector environment, stepped by the engine's batch."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.envs.arms import Arms
from pamsim.envs.settings import arm_settings

FloatArray = NDArray[np.float64]


class PamArmVectorEnv(VectorEnv[FloatArray, NDArray[Any], NDArray[Any]]):
    """Arms with episodes of their own, bit-identical to as many single environments.

    Arm i is seeded as ``SyncVectorEnv`` seeds its i-th environment. After an episode's end the next
    step begins a new one and ignores the action.

    Args:
        num_envs: how many arms.
        threads: to step them on; 0 for one per processor.
        **options: see `pamsim.envs.settings.ArmSettings`.

    Raises:
        InputError: for an unknown option, or one that does not fit the rig.
        ParameterError: for a number out of range.
    """

    # Gymnasium reads it from the class and from the object.
    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012
    kind: ClassVar[str]

    def __init__(self, num_envs: int = 1, *, threads: int = 0, **options: Any) -> None:
        if num_envs < 1:
            raise InputError(f"{num_envs} arms are none; give 1 or more")
        self.num_envs = num_envs
        self.arms = Arms(arm_settings(options), self.kind, num_envs, threads)
        self.single_observation_space = self.arms.observation_space
        self.single_action_space = self.arms.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators: list[np.random.Generator] = [
            seeding.np_random()[0] for _ in range(num_envs)
        ]
        self._over = np.zeros(num_envs, dtype=np.bool_)

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin new episodes in all arms, or in those of ``options["reset_mask"]``.

        Args:
            seed: of the first arm, the others following on it; or one per arm.
            options: ``reset_mask``: (n,) of bool.

        Raises:
            InputError: if there is not one seed or mask entry per arm.
        """
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed
        mask = np.ones(self.num_envs, dtype=np.bool_)
        if options and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"], dtype=np.bool_)
        for name, given in (("seeds", seeds), ("reset_mask", mask)):
            if given is not None and len(given) != self.num_envs:
                raise InputError(f"{len(given)} {name} for {self.num_envs} arms; give one each")
        for arm, own in enumerate(seeds or []):
            if own is not None and mask[arm]:
                self._generators[arm], _ = seeding.np_random(own)
        self._begin(mask)
        return self.arms.observation, self.information(mask)

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Hold an action per arm for one period; arms whose episode is over begin a new one."""
        over = self._over
        self.arms.rewind(over)  # their results of this step are replaced below
        reward, broken = self.arms.step(np.asarray(actions))
        ended = self.arms.ended()
        if over.any():
            reward[over], broken[over], ended[over] = 0.0, False, False
            self._begin(over)
        self._over = broken | ended
        return (
            self.arms.observation,
            reward,
            broken,
            ended,
            self.information(np.ones(self.num_envs, dtype=np.bool_)),
        )

    def information(self, mask: NDArray[np.bool_]) -> dict[str, Any]:
        """The same as for a single environment, a row per arm; a mask marks the new rows."""
        true = self.arms.true
        return {
            "angle": true[:, 0].copy(),
            "_angle": mask.copy(),
            "pressure": true[:, 1:].copy(),
            "_pressure": mask.copy(),
        }

    def close_extras(self, **kwargs: Any) -> None:
        """Close the simulations."""
        self.arms.close()

    def _begin(self, mask: NDArray[np.bool_]) -> None:
        self.arms.reset({int(arm): self._generators[arm] for arm in np.flatnonzero(mask)})
        self._over = self._over & ~mask


class PamArmPressureVectorEnv(PamArmVectorEnv):
    """Arms under pressure set points; see `pamsim.envs.pam_arm.PamArmPressureEnv`."""

    kind = "pressure"


class PamArmValveVectorEnv(PamArmVectorEnv):
    """Arms under continuous valves; see `pamsim.envs.pam_arm.PamArmValveEnv`."""

    kind = "valve"


class PamArmOnOffVectorEnv(PamArmVectorEnv):
    """Arms under on/off valves; see `pamsim.envs.pam_arm.PamArmOnOffEnv`."""

    kind = "on_off"
