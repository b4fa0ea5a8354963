"""Installation of the muscle callbacks for a block, and the guard against stepping without them.

MuJoCo's callbacks are global to the process, and an actuator of type ``user`` without one silently
runs as gain 1, bias 0. So a model made by pamsim is kept *guarded*: its integrator code is one the
engine refuses, and ``mj_step`` raises. Inside `live` the callbacks are in place and the guard is
lifted; on leaving, both are as they were before.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any, TypeAlias

import mujoco

from pamsim.actuator.layout import is_muscle
from pamsim.core.errors import EngineError, InputError, nearest

BACKENDS = ("compiled", "python")

_GUARD = 1000

Callbacks: TypeAlias = tuple[Any, Any, Any, Any]
"""``mjcb_act_dyn``, ``mjcb_act_gain``, ``mjcb_act_bias``, ``mjcb_time``: pointers, functions or
None."""


def guard(model: mujoco.MjModel) -> None:
    """Make ``mj_step`` on a model raise unless it runs inside `live`."""
    if model.opt.integrator < _GUARD:
        model.opt.integrator += _GUARD


def lift_guard(model: mujoco.MjModel) -> None:
    """Let ``mj_step`` run on a model again; only while the callbacks are in place."""
    model.opt.integrator %= _GUARD


def check_steppable(model: mujoco.MjModel) -> None:
    """Refuse a model that the muscle callbacks cannot step.

    Raises:
        InputError: if it has no pamsim muscle.
        EngineError: if it asks for an integrator that would break the muscles' memory.
    """
    if not muscle_ids(model):
        raise InputError("this model has no pamsim muscle; add one with pamsim.attach")
    refuse_multistage(model.opt.integrator % _GUARD)


def muscle_ids(model: mujoco.MjModel) -> list[int]:
    """Actuator ids of the pamsim muscles of a model, in order."""
    return [i for i in range(model.nactuator) if is_muscle(model.actuator_user[i])]


@contextlib.contextmanager
def live(*models: mujoco.MjModel, backend: str = "compiled") -> Iterator[None]:
    """Install the muscle callbacks for the duration of a ``with`` block.

    Actuators that are not pamsim muscles keep the engine's default behaviour. Scopes may be nested.
    The engine's own timers (``data.timer``) stand still meanwhile, unless somebody has set
    ``mjcb_time``: they would take a seventh of each step.

    Args:
        models: the models to be stepped inside the block; each loses its guard meanwhile.
        backend: ``compiled`` (native pointers, no Python per step) or ``python`` (the same source
            interpreted, for debugging; batches and model compilation do not work under it).

    Raises:
        InputError: if the backend is unknown or a model has no pamsim muscle.
        EngineError: if a model asks for an integrator that would break the muscles' memory, or the
            engine's structs are not laid out as declared.
    """
    for model in models:
        check_steppable(model)
    callbacks = native_callbacks() if backend == "compiled" else _interpreted(backend)
    before = (
        mujoco.get_mjcb_act_dyn(),
        mujoco.get_mjcb_act_gain(),
        mujoco.get_mjcb_act_bias(),
        mujoco.get_mjcb_time(),
    )
    integrators = [model.opt.integrator for model in models]
    try:
        install((*callbacks[:3], before[3] or callbacks[3]))
        for model in models:
            lift_guard(model)
        yield
    finally:
        install(before)
        for model, integrator in zip(models, integrators, strict=True):
            model.opt.integrator = integrator


def set_integrator(model: mujoco.MjModel, name: str) -> None:
    """Choose the integrator of a model by its MJCF name, keeping its guard.

    Raises:
        InputError: if there is no such integrator.
        EngineError: for RK4.
    """
    known = {
        kind.name.removeprefix("mjINT_").lower(): kind.value
        for kind in mujoco.mjtIntegrator.__members__.values()
    }
    if name.lower() not in known:
        raise InputError(f"no integrator {name!r}; {nearest(name.lower(), known)}")
    refuse_multistage(known[name.lower()])
    guarded = model.opt.integrator >= _GUARD
    model.opt.integrator = known[name.lower()]
    if guarded:
        guard(model)


def refuse_multistage(integrator: int) -> None:
    """Refuse an integrator that evaluates the callback between time points.

    An operator with memory, such as hysteresis or pulsed valves, would then follow a path that the
    muscle never took.

    Raises:
        EngineError: for RK4.
    """
    if integrator == mujoco.mjtIntegrator.mjINT_RK4:
        raise EngineError(
            "integrator RK4 evaluates the muscles between time points and corrupts their memory;"
            " set <option integrator='Euler'/>, 'implicit' or 'implicitfast'"
        )


def native_callbacks() -> Callbacks:
    """The compiled callbacks, for `install`.

    Raises:
        EngineError: if the engine's structs are not laid out as declared.
    """
    # Importing numba takes half a second, which the Python backend does not need.
    from pamsim.engine import compiled, structs

    natives = compiled.compiled_callbacks()
    structs.verified_layout()
    return natives.dyn, natives.gain, natives.bias, natives.clock


def install(callbacks: Callbacks) -> None:
    """Put callbacks in place for the whole process; `live` does it for a while."""
    mujoco.set_mjcb_act_dyn(callbacks[0])
    mujoco.set_mjcb_act_gain(callbacks[1])
    mujoco.set_mjcb_act_bias(callbacks[2])
    mujoco.set_mjcb_time(callbacks[3])


def _interpreted(backend: str) -> Callbacks:
    if backend != "python":
        raise InputError(f"no backend {backend!r}; {nearest(backend, BACKENDS)}")
    from pamsim.engine import interpreted

    return interpreted.dyn, interpreted.gain, interpreted.bias, mujoco.get_mjcb_time()
