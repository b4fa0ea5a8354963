"""The muscles' engine plugin: what makes MuJoCo evaluate them on every path, in every thread.

A plugin is registered once for the process and belongs to the model: its actuators are evaluated
wherever the engine steps or evaluates the model, in ``mj_step``, ``mj_forward``, ``mujoco.rollout``
or a viewer, from any thread, and no other library can take its place. The engine's callbacks
(``mjcb_act_dyn`` and others) are global to the process instead, and an actuator of type ``user``
without them runs silently as gain 1, bias 0. A model saved as MJCF names the plugin, so that a
process without pamsim refuses to load it.

The kernel is compiled, or loaded from its cache, when a model is first evaluated, not when it is
made: listing rigs or changing parameters need not wait for that.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import math
import re
import sys
import threading
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

import mujoco

from pamsim.core.errors import EngineError

NAME = "pamsim.muscle"
PYTHON = "pamsim.muscle.python"

_ADDRESS, _INT = ctypes.c_void_p, ctypes.c_int
_ACTUATOR = 1  # mjPLUGIN_ACTUATOR
_NUMBERS = ctypes.CFUNCTYPE(_INT, _ADDRESS, _INT)
_INIT = ctypes.CFUNCTYPE(_INT, _ADDRESS, _ADDRESS, _INT)
_RESET = ctypes.CFUNCTYPE(None, _ADDRESS, _ADDRESS, _ADDRESS, _INT)
_RATES = ctypes.CFUNCTYPE(None, _ADDRESS, _ADDRESS, _INT)
_FORCES = ctypes.CFUNCTYPE(None, _ADDRESS, _ADDRESS, _INT, _INT)

_DECLARED = """
name nattribute attributes capabilityflags needstage nstate nsensordata init destroy copy reset
compute advance visualize actuator_act_dot
sdf_distance sdf_gradient sdf_staticdistance sdf_attribute sdf_aabb
"""
FIELDS = _DECLARED.split()
"""Of ``mjpPlugin``, in order. All are addresses but a text and three integers."""
_PLAIN: dict[str, Any] = {"name": ctypes.c_char_p} | dict.fromkeys(
    ("nattribute", "capabilityflags", "needstage"), _INT
)


class _Plugin(ctypes.Structure):
    _fields_ = [(name, _PLAIN.get(name, _ADDRESS)) for name in FIELDS]


_lock = threading.RLock()
_numbers: dict[str, int] = {}
"""Plugin -> number under which the engine has it."""
_kept: list[Any] = []
"""Functions that the engine may call until the process ends."""
failures: list[BaseException] = []
"""What the muscles have raised in Python: the engine cannot pass an exception on."""

_making = ContextVar("making a model", default=False)

_T = TypeVar("_T")


def _once(function: Callable[[], _T]) -> Callable[[], _T]:
    """Have a function run once in the process, however many threads call it."""
    cached = functools.cache(function)

    @functools.wraps(function)
    def call() -> _T:
        with _lock:
            return cached()

    return call


@functools.cache
def engine_library() -> ctypes.CDLL:
    """MuJoCo's own library, as the Python package has loaded it, for what its bindings leave out.

    Raises:
        EngineError: if it is not beside the Python package.
    """
    folder = Path(mujoco.__file__).parent
    found = [p for p in folder.iterdir() if p.name.startswith(("libmujoco.", "mujoco.dll"))]
    if not found:
        raise EngineError(f"the library of MuJoCo is not in {folder}; install mujoco again")
    return ctypes.CDLL(str(found[0]))


@_once
def register() -> None:
    """Make the plugin known to the engine; once in the process.

    Raises:
        EngineError: if this version of the engine declares plugins differently.
    """
    check_declaration()
    _add(NAME, _loading(_RATES, "actuator_act_dot"), _loading(_FORCES, "compute"))


def slot() -> int:
    """Number under which the engine has the muscles' plugin."""
    register()
    return _numbers[NAME]


@_once
def python_slot() -> int:
    """Number of the plugin that runs the same functions in Python."""
    from pamsim.engine import checks, muscle_step, structs

    _verify_layout()
    model_record, data_record = structs.model_dtype(), structs.data_dtype()

    def viewing(step: Callable[..., None]) -> Callable[..., None]:
        def call(model: int, data: int, instance: int, *_: int) -> None:
            view = structs.struct_at
            try:
                step(view(model_record, model), view(data_record, data), instance)
            except BaseException as error:
                failures.append(error)

        return call

    _add(PYTHON, viewing(muscle_step.step_rates), viewing(muscle_step.step_forces))
    ends = [_RATES(viewing(end)) for end in (muscle_step.step_end, muscle_step.checked_step_end)]
    _kept.append(ends)
    usual, checking = (ctypes.cast(end, _ADDRESS).value for end in ends)
    checks.watch(engine_entry(_numbers[PYTHON]), usual, lambda: checking)
    return _numbers[PYTHON]


def slots() -> set[int]:
    """Numbers under which the engine has the muscles' plugins."""
    register()
    return set(_numbers.values())


def engine_entry(number: int) -> _Plugin:
    """The engine's own entry of a plugin by its number, whose functions may be exchanged."""
    library = engine_library()
    library.mjp_getPluginAtSlot.restype = ctypes.POINTER(_Plugin)
    return library.mjp_getPluginAtSlot(number).contents


@_once
def load_kernel() -> None:
    """Compile the kernel, or load it, and hand it to the engine; once in the process.

    Raises:
        EngineError: if the engine's structs are not laid out as declared.
    """
    # Importing numba takes half a second, which making a model does not need.
    from pamsim.engine import checks, compiled

    _verify_layout()
    (rates, forces, end), entry = compiled.step_functions(), engine_entry(slot())
    entry.actuator_act_dot, entry.compute = rates.address, forces.address
    checks.watch(entry, end.address, lambda: compiled.checked_end().address)


@contextlib.contextmanager
def not_evaluated() -> Iterator[None]:
    """Leave out muscles in the step that the engine makes to try a model which it compiles.

    It holds in this thread, until the kernel and its laws are loaded.
    """
    token = _making.set(True)
    try:
        yield
    finally:
        _making.reset(token)


def making_a_model() -> bool:
    """Whether this thread makes a model, see `not_evaluated`."""
    return _making.get()


def probe() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A model whose fields are not empty and not zero, or any would do in the place of another."""
    register()
    text = (
        f"<mujoco><extension><plugin plugin='{NAME}'><instance name='p'/></plugin>"
        "</extension><worldbody><body><joint name='j'/><geom size='1'/></body>"
        "<body><joint name='b' type='ball'/><geom size='1'/></body></worldbody>"
        "<actuator><motor joint='j' user='1 2 3'/><general joint='j' dyntype='integrator'/>"
        "<orientation joint='b'/></actuator></mujoco>"  # three controls of one actuator
    )
    with not_evaluated():
        model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.time = 0.125
    model.opt.integrator, model.opt.disableactuator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, 5
    model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_GRAVITY
    return model, data


@functools.cache
def _verify_layout() -> None:
    from pamsim.engine.structs import verify_offsets

    verify_offsets(*probe())


def raise_failure() -> None:
    """Raise the first of what the muscles have raised in Python since the last call."""
    found = list(failures)
    failures.clear()
    if found:
        raise found[0]


def _loading(kind: Any, field: str) -> Callable[..., None]:
    """What the engine calls until the kernel is loaded: it loads it and calls that instead."""

    def call(model: int, data: int, *more: int) -> None:
        if not making_a_model() and loaded(model, data):
            kind(getattr(engine_entry(slot()), field))(model, data, *more)

    return call


def loaded(model: int, data: int) -> bool:
    """Load the kernel; where that fails, the forces of all outputs are no number.

    The engine cannot pass an exception on. It is printed.
    """
    from pamsim.engine import structs

    try:
        load_kernel()
    except Exception as error:
        print(f"pamsim: the muscles cannot be evaluated: {error}", file=sys.stderr)
        at = structs.callback_offsets()
        count = ctypes.c_int64.from_address(model + at["nout"]).value
        forces = ctypes.c_void_p.from_address(data + at["actuator_force"]).value or 0
        (ctypes.c_double * count).from_address(forces)[:] = [math.nan] * count
        return False
    return True


def _add(name: str, rates: Callable[..., None], forces: Callable[..., None]) -> None:
    functions = {
        "nstate": _NUMBERS(lambda model, instance: 0),  # all memory is in act
        "init": _INIT(lambda model, data, instance: 0),
        "reset": _RESET(lambda model, state, data, instance: None),
        "actuator_act_dot": _RATES(rates),
        "compute": _FORCES(forces),
    }
    plugin = _Plugin(name=name.encode(), capabilityflags=_ACTUATOR)
    for field, function in functions.items():
        setattr(plugin, field, ctypes.cast(function, _ADDRESS))
    _kept.append((plugin, functions))
    _numbers[name] = engine_library().mjp_registerPlugin(ctypes.byref(plugin))


def check_declaration() -> None:
    """Compare the fields of ``mjpPlugin`` with the declaration that the engine ships.

    Raises:
        EngineError: if they differ.
    """
    header = Path(mujoco.__file__).parent / "include" / "mujoco" / "mjplugin.h"
    text = re.sub(r"//[^\n]*", "", header.read_text(encoding="utf-8"))
    found = re.search(r"typedef struct mjpPlugin_ \{(.*?)\} mjpPlugin;", text, re.DOTALL)
    declared = re.findall(r"\(\*(\w+)\)\(|(\w+);", found.group(1)) if found else []
    names = [function or plain for function, plain in declared]
    if names != FIELDS:
        raise EngineError(
            f"MuJoCo {mujoco.__version__} declares plugins in another way than pamsim knows;"
            " install a version in the range of pyproject.toml"
        )
