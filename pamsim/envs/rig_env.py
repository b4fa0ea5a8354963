"""Any rig as a Gymnasium environment."""

from __future__ import annotations

from typing import Any

import gymnasium
import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.envs.actions import as_array
from pamsim.envs.picture import RigPicture
from pamsim.envs.plant import OneRig
from pamsim.envs.reset_options import reset_options
from pamsim.envs.rigs import Rigs
from pamsim.envs.settings import env_settings

FloatArray = NDArray[np.float64]


class RigEnv(gymnasium.Env[FloatArray, NDArray[Any]]):
    """A rig whose joints are to follow references.

    ## Description

    Pneumatic muscles move the joints of a rig. The task asks for positions of the joints, or for
    positions and stiffness. Chamber pressures, hysteresis, valves and delay are part of the state.
    With j recorded joints and m muscles (`mas20_arm`: 1 and 2, `two_joint_arm`: 2 and 4):

    ## Action Space

    ``action="pressure"`` (default): set points that a regulator per muscle keeps, `Box(-1, 1, (m,))`.

    | index | action | -1 | 1 | name | in the MJCF |
    |---|---|---|---|---|---|
    | i = 0 .. m - 1 | set point of muscle i | 0 kPa | supply pressure | ``<muscle>.pressure_set`` | actuator ``<muscle>`` |

    ``action="valve"``: openings of continuous valves, `Box(-1, 1, (m,))`.

    | index | action | -1 | 1 | name | in the MJCF |
    |---|---|---|---|---|---|
    | i = 0 .. m - 1 | valves of muscle i, 0: shut | open to exhaust | open to supply | ``<muscle>.valve`` | actuator ``<muscle>`` |

    ``action="on_off"``: on/off valves, each open (1) or shut (0) for a whole period, `MultiBinary(2m)`.

    | index | action | name | in the MJCF |
    |---|---|---|---|
    | 2i | supply valve of muscle i | ``<muscle>.fill`` | actuator ``<muscle>`` |
    | 2i + 1 | exhaust valve of muscle i | ``<muscle>.vent`` | actuator ``<muscle>`` |

    If both valves of a muscle are to open, both stay shut. Numbers beyond -1 and 1 count as -1 and 1.
    NaN, infinity, another shape, and anything but 0 and 1 for an on/off valve are errors.

    ## Observation Space

    `Box(-10, 10, (6j + m,))`, every number (signal - centre) / scale, of the order of 1.
    `signals.names`, `.units`, `.centre` and `.scale` list them, `signals.named(observation)` gives
    the signals in SI. Centre c and travel r are those of each joint, see below; P is the supply
    pressure, w = 2 pi/s.

    | index | observed | centre | scale | name | in the MJCF |
    |---|---|---|---|---|---|
    | 0 .. j - 1 | measured position | c | r | ``<joint>.angle`` or ``.position`` | joint ``<joint>`` |
    | j .. 2j - 1 | its rate: difference over the period | 0 | w r | ``<joint>.velocity`` | |
    | 2j .. 2j + m - 1 | measured pressure | P/2 | P/2 | ``<muscle>.pressure`` | actuator ``<muscle>`` |
    | then j | wanted position at the end of the coming step | c | r | ``<joint>.angle_set`` | |
    | then j | its rate | 0 | w r | ``<joint>.velocity_set`` | |
    | then j | its acceleration | 0 | w^2 r | ``<joint>.acceleration_set`` | |
    | then j | wanted stiffness, 0 if free | 0 | the largest asked for | ``<joint>.stiffness_set`` | |

    c and r follow from the rig: the joint goes from c - 2r to c + 2r, without load, when the muscles
    that pull it one way have the supply pressure and those that pull it the other way none. Tasks
    ask for positions from c - r to c + r (`pamsim.envs.reach`).

    ## Rewards

    Minus the mean over the joints of the error of the true position at the end of the step, in units
    of r/4; minus ``effort`` times the mean over the muscles of the squared change of the command
    (half the supply pressure, or the full opening of a valve, counts as 1); in the task
    ``stiffness`` minus the mean relative error of the stiffness. -100 in a step in which the
    simulation breaks down.

    ## Starting State

    At rest with ``start_pressure`` in all muscles. References, load, parameters and noise are drawn
    from the environment's seed. `reset(options=...)` takes ``load`` [kg], ``start_pressure`` [Pa, or
    muscle -> Pa], ``target`` (joint -> position [rad or m], asked for all the time) and
    ``parameters`` (as `Rig.with_parameters` takes them [SI]) for this episode.

    ## Episode End

    Truncation after 400 steps, or ``max_episode_steps`` of `gymnasium.make`; the class itself sets
    no limit. Termination if the simulation breaks down: a joint beyond 100 rad or m, or a number
    that is not finite.

    ## Arguments

    ``rig`` (name, folder or loaded rig), ``action``, ``task``, ``frame_skip``, ``load``,
    ``start_pressure``, ``angle_noise``, ``pressure_noise``, ``instruments``, ``delay``,
    ``randomize``, ``effort``: see `pamsim.envs.settings.EnvSettings`. ``render_mode`` is
    ``rgb_array``, ``human`` or None, ``width`` and ``height`` are those of pictures [px].

    `model` and `data` are MuJoCo's, `dt` is the time between two actions [s]. The information of
    `reset` and `step` holds the true ``position`` (j,) [rad or m] and ``pressure`` (m,) [Pa, gauge].
    An environment can be copied and pickled; the copy continues the same episode.

    ## Version History

    * v0: first version.

    Raises:
        InputError: for an unknown option, or one that does not fit the rig.
        ParameterError: for a number out of range.
    """

    # Gymnasium reads it from the class and from the object.
    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 50}  # noqa: RUF012

    def __init__(
        self,
        *,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 400,
        **options: Any,
    ) -> None:
        self._arguments = {
            "render_mode": render_mode,
            "width": width,
            "height": height,
            **options,
        }
        self.rigs = Rigs(env_settings(options), 1)
        self.observation_space = self.rigs.observation_space
        self.action_space = self.rigs.action_space
        self.metadata = {**self.metadata, "render_fps": round(1.0 / self.rigs.period)}
        self.render_mode = render_mode
        self._picture = RigPicture(self.rigs, render_mode, width, height)

    @property
    def dt(self) -> float:
        """Time between two actions [s]."""
        return self.rigs.period

    @property
    def model(self) -> mujoco.MjModel:
        """Model of the running episode, with its load and parameters; the rig's before the first."""
        return getattr(self.rigs.plant, "model", self.rigs.rig.model)

    @property
    def data(self) -> mujoco.MjData:
        """State of the running episode.

        Raises:
            InputError: before the first reset.
        """
        plant = self.rigs.plant
        assert isinstance(plant, OneRig)
        return plant.data

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin a new episode.

        Args:
            seed: of the episodes from now on.
            options: what is fixed of this one, see the class.

        Returns:
            The observation, and the true ``position`` and ``pressure``.

        Raises:
            InputError: for an unknown option.
            ParameterError: for a number out of range.
        """
        super().reset(seed=seed)
        asked = reset_options(options, self.rigs.rig, self.rigs.settings.start_pressure)
        self.rigs.reset({0: self.np_random}, asked)
        if self.render_mode == "human":
            self.render()
        return self.rigs.observation[0], self._information()

    def step(self, action: NDArray[Any]) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Hold an action for one period.

        Raises:
            InputError: for an action that is none, or before the first reset.
        """
        reward, broken = self.rigs.step(as_array(action)[np.newaxis])
        if self.render_mode == "human":
            self.render()
        return (
            self.rigs.observation[0],
            float(reward[0]),
            bool(broken[0]),
            False,
            self._information(),
        )

    def _information(self) -> dict[str, Any]:
        return {name: values[0] for name, values in self.rigs.information().items()}

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the rig.

        Returns:
            (height, width, 3) picture in mode ``rgb_array``, else None.

        Raises:
            EngineError: without OpenGL, or in mode ``human`` without a screen; it names the fix.
        """
        return self._picture.show()

    def close(self) -> None:
        """Close window and simulation."""
        self._picture.close()
        self.rigs.close()

    def __getstate__(self) -> dict[str, Any]:
        """Arguments and state; a window or renderer stays behind."""
        return {
            "arguments": self._arguments,
            "spec": self.spec,
            "random": (self._np_random, self._np_random_seed),
            "rigs": self.rigs.state(),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the environment anew and continue its episode."""
        RigEnv.__init__(self, **state["arguments"])
        self.spec = state["spec"]
        self._np_random, self._np_random_seed = state["random"]
        self.rigs.restore(state["rigs"])
