"""Callbacks held over many calls, for an object such as an environment that is stepped by others.

`pamsim.live` brackets a run. An environment is stepped from outside, call by call, and in between
anything may happen, other scopes of `live` included. So it looks before each step whether the
callbacks are still there, which takes a tenth of a microsecond.
"""

from __future__ import annotations

import weakref
from typing import ClassVar

import mujoco

from pamsim.core.errors import EngineError
from pamsim.engine.callback import (
    Callbacks,
    check_steppable,
    guard,
    install,
    lift_guard,
    native_callbacks,
)


class HeldCallbacks:
    """Models that may be stepped from `keep` to `release`, if `check` is called before each step.

    They do nothing to models without pamsim muscles. The last one to release them takes them away.
    """

    _holders: ClassVar[weakref.WeakSet[HeldCallbacks]] = weakref.WeakSet()

    def __init__(self) -> None:
        self._callbacks: Callbacks | None = None
        self._models: list[mujoco.MjModel] = []

    def keep(self, *models: mujoco.MjModel) -> None:
        """Make models steppable, in place of those held before.

        Raises:
            InputError: if a model has no pamsim muscle.
            EngineError: if a model's integrator would break the muscles' memory.
        """
        self.release()
        for model in models:
            check_steppable(model)
        self._callbacks = native_callbacks()
        self._models = list(models)
        self._holders.add(self)
        for model in models:
            lift_guard(model)
        self.check()

    def check(self) -> None:
        """Put the callbacks back if another scope has taken them away.

        Raises:
            EngineError: if nothing is held.
        """
        if self._callbacks is None:
            raise EngineError("this environment is closed; make a new one")
        if mujoco.get_mjcb_act_dyn() is not self._callbacks[0]:
            install(self._callbacks)

    def release(self) -> None:
        """Guard the models again, and leave the process as it was. May be called twice."""
        for model in self._models:
            guard(model)
        self._holders.discard(self)
        callbacks, self._models, self._callbacks = self._callbacks, [], None
        if callbacks and not self._holders and mujoco.get_mjcb_act_dyn() is callbacks[0]:
            install((None, None, None, None))
