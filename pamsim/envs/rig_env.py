"""Any rig as a Gymnasium environment."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import gymnasium
import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.rig import load_rig
from pamsim.envs.actions import as_array
from pamsim.envs.plant import OneRig
from pamsim.envs.rigs import Rigs
from pamsim.envs.settings import check_names, env_settings
from pamsim.scene.picture import has_screen, open_renderer, render_arm, show_whole
from pamsim.scene.pose import muscle_lengths, pose


class RigEnv(gymnasium.Env[FloatArray, NDArray[Any]]):
    """A rig whose joints are to follow references.

    ## Description

    Pneumatic muscles move the joints of a rig. The task asks for positions of the joints, or for
    positions and stiffness. Chamber pressures, hysteresis, valves and delay are part of the state.
    Below, a rig has j recorded joints and m muscles: `mas20_arm` 1 and 2, `two_joint_arm` 2 and 4.

    ## Action Space

    By the argument ``action``: `Box(-1, 1, (m,))` of set points, kept by a regulator per muscle, or
    of openings of continuous valves; `MultiBinary(2 m)` of on/off valves, open or shut for a whole
    period. Muscles are counted from i = 0.

    | ``action`` | index | meaning | lowest | highest | name |
    |---|---|---|---|---|---|
    | ``pressure_set`` | i | set point | 0 kPa | ``top_pressure`` | ``<muscle>.pressure_set`` |
    | ``valve`` | i | opening of the valves | to exhaust | to supply | ``<muscle>.valve`` |
    | ``on_off`` | 2 i | supply valve | shut | open | ``<muscle>.fill`` |
    | ``on_off`` | 2 i + 1 | exhaust valve | shut | open | ``<muscle>.vent`` |

    Numbers beyond -1 and 1 count as -1 and 1. NaN, infinity, another shape, and anything but 0 and
    1 for an on/off valve are errors. If both valves of a muscle are to open, both stay shut.

    ## Observation Space

    `Box(-10, 10, (6 j + m,))`. Each number is (signal - centre) / scale, which is of the order of
    1. `rigs.signals` has names, units, centres and scales; `named` gives the signals in SI. P is
    ``top_pressure``, w is pi/s; c and r are of each joint, see below.

    | count | signal | centre | scale | name | in the MJCF |
    |---|---|---|---|---|---|
    | j | measured position | c | r | ``<joint>.angle``, ``.position`` | joint |
    | j | its difference over the period, per time | 0 | w r | ``<joint>.velocity`` | |
    | m | measured pressure | P/2 | P/2 | ``<muscle>.pressure`` | actuator |
    | j | wanted position at the end of the coming step | c | r | ``<joint>.angle_set`` | |
    | j | its rate | 0 | w r | ``<joint>.velocity_set`` | |
    | j | its acceleration | 0 | w^2 r | ``<joint>.acceleration_set`` | |
    | j | wanted stiffness, 0 if free | 0 | largest wanted | ``<joint>.stiffness_set`` | |

    Without load a joint goes from c - 2 r to c + 2 r, when the muscles that move it one way have
    the pressure P, those that move it the other way none, and all others P/2. Tasks ask for
    positions from c - r to c + r (`pamsim.envs.scales`).

    ## Rewards

    - minus the mean over the joints of the error of the true position at the end of the step, in
      units of r/4;
    - minus ``effort`` times the mean over the muscles of the squared change of the command; half
      of P, or the full opening of a valve, counts as 1;
    - in the task ``stiffness``, minus the mean relative error of the stiffness.

    A step in which the simulation breaks down is rewarded by -100.

    ## Starting State

    At rest with ``start_pressure`` in all muscles. References, load, parameters and noise are drawn
    from the environment's seed. For one episode, ``options`` of `reset` fix ``load`` [kg],
    ``start_pressure`` [Pa, or muscle -> Pa], ``target`` (joint -> position [rad or m] asked for all
    the time) and ``parameters`` (as `Rig.with_parameters` takes them [SI]; no delays of valves).

    ## Episode End

    Truncation after 400 steps, or ``max_episode_steps`` of `gymnasium.make`; the class itself sets
    no limit. Termination if the simulation breaks down: a joint beyond 100 rad or m, or a number
    that is not finite.

    ## Arguments

    Those of `pamsim.envs.settings.EnvSettings`; ``render_mode``, which is ``rgb_array``, ``human``
    or None; ``width`` and ``height`` of pictures [px].

    `model` and `data` are MuJoCo's, `dt` is the time between two actions [s]. An environment can be
    copied and pickled; the copy continues the same episode.

    The information of `reset` and `step` holds the true ``position`` (j,) [rad or m] and
    ``pressure`` (m,) [Pa], gauge; ``target`` (j,), the position wanted at that time;
    ``is_success``, whether each joint is within r/40 of it; and the terms of the reward above,
    ``reward_position``, ``reward_effort`` and ``reward_stiffness``.

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
        if render_mode not in (None, "rgb_array", "human"):
            raise InputError(f"no render mode {render_mode!r}; known: rgb_array, human")
        self.rigs = Rigs(env_settings(options), 1)
        self.dt = self.rigs.period
        self.observation_space = self.rigs.observation_space
        self.action_space = self.rigs.action_space
        self.metadata = {
            "render_modes": ["human", "rgb_array"] if has_screen() else ["rgb_array"],
            "render_fps": round(1.0 / self.dt),
        }
        self.render_mode = render_mode
        self._size = {"width": width, "height": height}
        self._picture: tuple[mujoco.MjModel, mujoco.MjData, Any] | None = None

    @property
    def model(self) -> mujoco.MjModel:
        """Model of the running episode, with its load and parameters."""
        return self._plant.model

    @property
    def data(self) -> mujoco.MjData:
        """State of the running episode."""
        return self._plant.data

    @property
    def _plant(self) -> OneRig:
        assert isinstance(self.rigs.plant, OneRig)
        return self.rigs.plant

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin a new episode.

        The seed is that of the episodes from now on; the options fix something of this one, see
        the class.

        Raises:
            InputError: for an unknown option.
            ParameterError: for a number out of range.
        """
        super().reset(seed=seed)
        self.rigs.reset({0: self.np_random}, options)
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
        seen = self.rigs.observation[0]
        return seen, float(reward[0]), bool(broken[0]), False, self._information()

    def named(self, observation: FloatArray | None = None) -> dict[str, float]:
        """Signals of an observation by name [SI]; of the last one if left out."""
        return self.rigs.signals.named(
            self.rigs.observation[0] if observation is None else observation
        )

    def action_of(self, command: Mapping[str, float]) -> NDArray[np.generic]:
        """The action that gives the muscles a command.

        Args:
            command: muscle -> gauge pressure [Pa] in the action ``pressure_set``; else opening of
                its valves, from -1 for the exhaust to 1 for the supply. On/off valves open beyond
                `pamsim.envs.actions.ON`.

        Raises:
            InputError: for an unknown muscle, or one that is missing.
        """
        muscles = self.rigs.rig.muscles
        check_names("no muscle", command, muscles)
        missing = [name for name in muscles if name not in command]
        if missing:
            raise InputError(f"no command for {', '.join(missing)}")
        wanted = [float(command[name]) for name in muscles]
        return self.rigs.kind.action(wanted, self.rigs.top_pressure)

    def _information(self) -> dict[str, Any]:
        shown = {name: rows[0] for name, rows in self.rigs.information().items()}
        return {name: one if np.ndim(one) else one.item() for name, one in shown.items()}

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the rig, quickly: without shadows and fine parts.

        Returns a picture (height, width, 3) in mode ``rgb_array``, else None.

        Raises:
            EngineError: without OpenGL, or in mode ``human`` without a screen; it names the fix.
        """
        if self.render_mode is None:
            raise InputError(
                "the environment was made without a render mode; make it with"
                " render_mode='rgb_array' or 'human'"
            )
        rig, seen = self.rigs.rig, self._information()
        if self._picture is None:
            model = load_rig(rig.file.folder, scene=True).model
            if self.render_mode == "human":
                from pamsim.scene.viewer import ArmViewer

                shown = ArmViewer(model)
            else:
                show_whole(model, **self._size)
                shown = open_renderer(model, **self._size, quick=True)  # OpenGL starts here
            self._picture = model, mujoco.MjData(model), shown
        model, data, shown = self._picture
        pose(model, data, rig.position_addresses, seen["position"].tolist())
        drawn: dict[str, Any] = {
            "muscles": rig.muscles,
            "pressures": seen["pressure"].tolist(),
            "lengths": muscle_lengths(model, data),
        }
        if self.render_mode == "rgb_array":
            return render_arm(model, data, **drawn, renderer=shown, fine=False)
        shown.show(model, data, **drawn)
        return None

    def close(self) -> None:
        """Close window and simulation."""
        if self._picture is not None:
            self._picture[2].close()
            self._picture = None
        self.rigs.closed = True

    def __getstate__(self) -> dict[str, Any]:
        """All but a window or renderer, which stays behind."""
        return {**vars(self), "_picture": None}

    __copy__ = copy.deepcopy
