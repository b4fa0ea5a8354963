"""The antagonistic arm as Gymnasium environments, one per kind of action."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pamsim.envs.arms import Arms
from pamsim.envs.picture import ArmPicture
from pamsim.envs.settings import arm_settings

FloatArray = NDArray[np.float64]


class PamArmEnv(gymnasium.Env[FloatArray, NDArray[Any]]):
    """Base of the three environments of the arm.

    The arm starts at rest with equal pressures in both muscles. Pressure, hysteresis, valves and
    everything else the rig states is part of the state; `reset` sets all of it.

    | index | observed | unit | range | in the MJCF |
    |---|---|---|---|---|
    | 0 | measured angle | rad | +-2 pi | joint ``shaft`` |
    | 1 | its rate: difference of measured angles over the period | rad/s | +-1000 | |
    | 2 | measured pressure of muscle 1 | supply pressure | [-0.2, 2] | actuator ``muscle_1`` |
    | 3 | measured pressure of muscle 2 | supply pressure | [-0.2, 2] | actuator ``muscle_2`` |
    | 4 | wanted angle at the end of the coming step | rad | +-`Reach.angle` | |
    | 5 | its rate | rad/s | +-100 | |
    | 6 | its acceleration | rad/s^2 | +-1e4 | |
    | 7 | wanted stiffness of the joint, 0 if free | N m/rad | `Reach.stiffness` | |

    Reward of a step: minus the error of the true angle at its end in units of 5 deg, minus
    ``effort`` times the squared change of the commands, minus the relative error of the stiffness
    where one is wanted. Episodes are truncated after ``duration`` seconds; they terminate only if
    the simulation breaks down.

    Args:
        render_mode: ``rgb_array``, ``human`` or None.
        width: of pictures [px].
        height: of pictures [px].
        **options: see `pamsim.envs.settings.ArmSettings`: ``task``, ``rig``, ``load``,
            ``duration``, ``frame_skip``, ``delay``, ``angle_noise``, ``randomize`` and so on.

    Raises:
        InputError: for an unknown option, or one that does not fit the rig.
        ParameterError: for a number out of range.
    """

    # Gymnasium reads it from the class and from the object.
    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 50}  # noqa: RUF012
    kind: ClassVar[str]

    def __init__(
        self,
        *,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 400,
        **options: Any,
    ) -> None:
        self.arms = Arms(arm_settings(options), self.kind, 1)
        self.observation_space = self.arms.observation_space
        self.action_space = self.arms.action_space
        self.metadata = {**self.metadata, "render_fps": round(1.0 / self.arms.period)}
        self.render_mode = render_mode
        self._picture = ArmPicture(self.arms, render_mode, width, height)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin a new episode; there are no options.

        Returns:
            The observation, and `information`.
        """
        super().reset(seed=seed)
        self.arms.reset({0: self.np_random})
        if self.render_mode == "human":
            self.render()
        return self.arms.observation[0], self.information()

    def step(self, action: NDArray[Any]) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Hold an action for one period."""
        reward, broken = self.arms.step(np.asarray(action)[np.newaxis])
        if self.render_mode == "human":
            self.render()
        return (
            self.arms.observation[0],
            float(reward[0]),
            bool(broken[0]),
            bool(self.arms.ended()[0]),
            self.information(),
        )

    def information(self) -> dict[str, Any]:
        """True ``angle`` [rad] and ``pressure`` of both muscles [Pa], gauge."""
        true = self.arms.true[0]
        return {"angle": true[0], "pressure": true[1:].copy()}

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the arm.

        Returns:
            (height, width, 3) picture in mode ``rgb_array``, else None.

        Raises:
            EngineError: without OpenGL, or in mode ``human`` without a screen; it names the fix.
        """
        return self._picture.show()

    def close(self) -> None:
        """Close window and simulation."""
        self._picture.close()
        self.arms.close()


class PamArmPressureEnv(PamArmEnv):
    """The arm under pressure set points, which a regulator per muscle keeps.

    | index | action | unit | range | in the MJCF |
    |---|---|---|---|---|
    | 0 | set point of muscle 1 | -1: 0 kPa, 1: supply pressure | [-1, 1] | actuator ``muscle_1`` |
    | 1 | set point of muscle 2 | -1: 0 kPa, 1: supply pressure | [-1, 1] | actuator ``muscle_2`` |

    Observations, reward and options: see `PamArmEnv`.
    """

    kind = "pressure"


class PamArmValveEnv(PamArmEnv):
    """The arm under continuous valves.

    | index | action | unit | range | in the MJCF |
    |---|---|---|---|---|
    | 0 | valves of muscle 1 | 1: open to supply, -1: to exhaust | [-1, 1] | actuator ``muscle_1`` |
    | 1 | valves of muscle 2 | 1: open to supply, -1: to exhaust | [-1, 1] | actuator ``muscle_2`` |

    Observations, reward and options: see `PamArmEnv`.
    """

    kind = "valve"


class PamArmOnOffEnv(PamArmEnv):
    """The arm under its four on/off valves, each open or shut for a whole period.

    | index | action | unit | range | in the MJCF |
    |---|---|---|---|---|
    | 0 | muscle 1: supply valve | open or not | {0, 1} | actuator ``muscle_1`` |
    | 1 | muscle 1: exhaust valve | open or not | {0, 1} | actuator ``muscle_1`` |
    | 2 | muscle 2: supply valve | open or not | {0, 1} | actuator ``muscle_2`` |
    | 3 | muscle 2: exhaust valve | open or not | {0, 1} | actuator ``muscle_2`` |

    If both valves of a muscle are to open, both stay shut: an interlock.
    Observations, reward and options: see `PamArmEnv`.
    """

    kind = "on_off"
