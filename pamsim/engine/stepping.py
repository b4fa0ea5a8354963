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
from pamsim.physics.record import is_muscle

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
    """Actuator ids of the pamsim muscles of a model, in order.

    Raises:
        EngineError: if the model was written as MJCF and read again, which loses digits.
    """
    muscles = [i for i in range(model.nactuator) if is_muscle(model.actuator_user[i])]
    if len(muscles) < model.nactuator and model.nplugin:
        _check_rows(model, muscles)
    return muscles


def _check_rows(model: mujoco.MjModel, muscles: list[int]) -> None:
    """Refuse actuators that the plugin evaluates and whose numbers are not those of a muscle."""
    for index in range(model.nactuator):
        instance = int(model.actuator_plugin[index])
        if index in muscles or instance < 0 or model.plugin[instance] not in plugin.slots():
            continue
        raise EngineError(
            f"actuator {model.actuator(index).name!r} is a pamsim muscle whose parameters are no"
            " longer exact, as MJCF keeps six digits: load the rig with pamsim.load_rig, or attach"
            " the muscle again with pamsim.attach"
        )


def prepare(*models: mujoco.MjModel) -> None:
    """Compile the laws of the muscles of some models, or load them from numba's cache.

    Raises:
        InputError: if a law cannot be compiled.
        EngineError: if a law is not known here, or the engine's structs are not as declared.
    """
    plugin.load_kernel()
    from pamsim.engine import law_table

    for model in models:
        law_table.prepare(model.actuator_user[muscle_ids(model)])


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
        prepare(*models)
        yield
        checks.raise_found(models)
        return
    usual, python = plugin.slot(), plugin.python_slot()
    for model in models:
        model.plugin[model.plugin == usual] = python
    try:
        yield
    finally:
        for model in models:
            model.plugin[model.plugin == python] = usual
        plugin.raise_failure()
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
