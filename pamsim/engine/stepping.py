"""What evaluates the muscles of a model, and which integrators may.

The engine evaluates them on every path by the plugin that they belong to, see
`pamsim.engine.plugin`; nothing has to be installed before a step.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import mujoco

from pamsim.core.errors import EngineError, InputError, nearest
from pamsim.engine import checks, plugin
from pamsim.physics.layout import is_muscle

BACKENDS = ("compiled", "python")


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
    """Actuator ids of the pamsim muscles of a model, in order."""
    return [i for i in range(model.nactuator) if is_muscle(model.actuator_user[i])]


@contextlib.contextmanager
def live(*models: mujoco.MjModel, backend: str = "compiled") -> Iterator[None]:
    """Step some models quickly, or with a debugger, for the duration of a ``with`` block.

    Models step without it as well, with the same results.

    Args:
        models: the models to be stepped inside the block.
        backend: ``compiled`` (no Python per step) or ``python`` (the same source interpreted, for
            debugging).

    Raises:
        InputError: if the backend is unknown or a model has no pamsim muscle.
        EngineError: if a model asks for an integrator that would break the muscles' memory, or the
            engine's structs are not laid out as declared.
        InvariantError: at the end, see `pamsim.checks`.
    """
    for model in models:
        check_steppable(model)
    if backend not in BACKENDS:
        raise InputError(f"no backend {backend!r}; {nearest(backend, BACKENDS)}")
    if backend == "compiled":
        plugin.load_kernel()
        yield
        checks.raise_found(models)
        return
    usual, interpreted = plugin.slot(), plugin.interpreted_slot()
    for model in models:
        model.plugin[model.plugin == usual] = interpreted
    try:
        yield
    finally:
        for model in models:
            model.plugin[model.plugin == interpreted] = usual
        if plugin.failures:
            raise plugin.failures.pop()
    checks.raise_found(models)


def set_integrator(model: mujoco.MjModel, name: str) -> None:
    """Choose the integrator of a model by its MJCF name.

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
    model.opt.integrator = known[name.lower()]


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
