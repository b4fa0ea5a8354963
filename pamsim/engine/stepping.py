"""Stepping models with muscles: which of them can be stepped, and what evaluates their muscles.

The engine evaluates them on every path by the plugin that they belong to, see
`pamsim.engine.plugin`; nothing has to be installed before a step.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator
from typing import TypeAlias

import mujoco

from pamsim.core.errors import EngineError, InputError, nearest
from pamsim.core.units import FloatArray
from pamsim.engine import checks, plugin
from pamsim.physics.record import is_muscle

BACKENDS = ("compiled", "python")
EachStep: TypeAlias = Callable[[mujoco.MjModel, mujoco.MjData], None]
"""Called with model and data before every time step: physics that the rig does not contain."""


def check_steppable(model: mujoco.MjModel) -> None:
    """Refuse a model whose muscles cannot be stepped.

    Raises:
        InputError: if it has no pamsim muscle.
        EngineError: if it asks for an integrator that would break the muscles' memory.
    """
    if not muscle_ids(model):
        raise InputError("this model has no pamsim muscle; add one with pamsim.attach")
    refuse_multistage(model.opt.integrator)


def muscle_ids(model: mujoco.MjModel) -> list[int]:
    """Actuator ids of the pamsim muscles of a model, in order.

    Raises:
        EngineError: if the model was written as MJCF and read again, which loses digits.
    """
    muscles = [i for i in range(model.nactuator) if is_muscle(model.actuator_user[i])]
    for index in set(range(model.nactuator)) - set(muscles):
        instance = int(model.actuator_plugin[index])
        if instance >= 0 and model.plugin[instance] in plugin.slots():
            raise EngineError(
                f"actuator {model.actuator(index).name!r} is a pamsim muscle whose parameters are"
                " no longer exact, as MJCF keeps six digits: load the rig with pamsim.load_rig, or"
                " delete the actuator and attach the muscle again with pamsim.attach"
            )
    return muscles


@contextlib.contextmanager
def live(*models: mujoco.MjModel, backend: str = "compiled") -> Iterator[None]:
    """Step some models with their laws compiled, or in Python, in a ``with`` block.

    Models step without it as well, with the same results; their laws are then compiled at the first
    step.

    Args:
        models: the models to be stepped inside the block.
        backend: ``compiled`` (no Python per step) or ``python`` (the same functions interpreted, of
            which laws may be anything that can be called).

    Raises:
        InputError: if the backend is unknown, a model has no pamsim muscle or a law cannot be
            compiled.
        EngineError: if a model asks for an integrator that would break the muscles' memory, a law
            is not known here, or the engine's structs are not laid out as declared.
        InvariantError: at the end, see `pamsim.checks`.
    """
    for model in models:
        check_steppable(model)
    if backend not in BACKENDS:
        raise InputError(f"no backend {backend!r}; {nearest(backend, BACKENDS)}")
    with checks.raised_at_end(models):
        if backend == "compiled":
            plugin.load_kernel()
            from pamsim.engine.compiled import prepare

            prepare(row for model in models for row in model.actuator_user[muscle_ids(model)])
            yield
        else:
            usual, python = plugin.slot(), plugin.python_slot()
            for model in models:
                model.plugin[model.plugin == usual] = python
            try:
                yield
            finally:
                for model in models:
                    model.plugin[model.plugin == python] = usual
                plugin.raise_failure()


def advance(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    command: FloatArray,
    count: int,
    each_step: EachStep | None,
) -> None:
    """Take a number of time steps under one command (m,), a hook acting before each.

    Without one, ``data.ctrl`` holds the command already.
    """
    if each_step is None:
        mujoco.mj_step(model, data, count)
        return
    for _ in range(count):
        data.ctrl[:] = command
        each_step(model, data)
        mujoco.mj_step(model, data)


def set_integrator(model: mujoco.MjModel, name: str) -> None:
    """Choose the integrator of a model by its MJCF name.

    Raises:
        InputError: if there is no such integrator.
        EngineError: for RK4.
    """
    members, lower = mujoco.mjtIntegrator.__members__, name.lower()
    known = {kind.removeprefix("mjINT_").lower(): one.value for kind, one in members.items()}
    if lower not in known:
        raise InputError(f"no integrator {name!r}; {nearest(lower, known)}")
    refuse_multistage(known[lower])
    model.opt.integrator = known[lower]


def refuse_multistage(integrator: int) -> None:
    """Refuse an integrator that evaluates the muscles between time points.

    An operator with memory, such as hysteresis or pulsed valves, would then follow a path that the
    muscle never took. A model that is given one later has forces that are not a number.

    Raises:
        EngineError: for RK4.
    """
    if integrator == mujoco.mjtIntegrator.mjINT_RK4:
        raise EngineError(
            "integrator RK4 evaluates the muscles between time points and corrupts their memory;"
            " set <option integrator='Euler'/>, 'implicit' or 'implicitfast'"
        )


_lock = threading.Lock()
_holders = 0


def _silent(_: str) -> None:
    """Do nothing with a warning of the engine."""


@contextlib.contextmanager
def engine_warnings_held() -> Iterator[None]:
    """Let the engine print no warnings, and write no ``MUJOCO_LOG.TXT``, in a ``with`` block.

    It counts them all the same, and a run that has one reports it as its outcome. A handler that
    somebody has set by ``mujoco.set_mju_user_warning`` is left alone. It holds for the process.
    """
    _hold(1)
    try:
        yield
    finally:
        _hold(-1)


def _hold(more: int) -> None:
    global _holders
    with _lock:
        _holders += more
        handler = mujoco.get_mju_user_warning()
        if handler in (None, _silent):
            mujoco.set_mju_user_warning(_silent if _holders else None)
