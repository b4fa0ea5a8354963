"""The kernel's functions over rows of numbers, as the engine keeps them, for tests.

``from tests.unit.physics.flat import tension`` gives the function of that name with a parameter row
in the place of ``m``, and one ``act`` in the place of ``s`` and ``z``; rates are written back.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import pkgutil
from types import ModuleType, SimpleNamespace

import pamsim.physics
from pamsim.physics import muscle_valves as _valves
from pamsim.physics import rest_state as _rest_state
from pamsim.physics.muscle import Muscle
from pamsim.physics.record import (
    COMMON,
    STATE_NAMES,
    joined_states,
    parameters,
    slot,
    split_states,
    view,
)

PLACES = {name.upper(): len(STATE_NAMES) - i for i, name in enumerate(STATE_NAMES)}
"""Places of the states in ``act``, counted from its end, such as ``AIR``."""

_SPLIT = {("s", "z"): "act", ("ds", "dz"): "rates", ("before", "memory_before"): "before"}


def record(given) -> SimpleNamespace:
    """Parameters from a row, a muscle, or themselves."""
    if isinstance(given, SimpleNamespace):
        return given
    return parameters(given) if isinstance(given, Muscle) else view(given)


def parameter_slot(muscle: Muscle, name: str) -> int:
    return slot(name, muscle)


def split(act):
    """States by name and memory; a short ``act`` has zeros before its numbers."""
    numbers = [float(one) for one in act]
    return split_states([*[0.0] * (COMMON - len(numbers)), *numbers])


def flat(function):
    """A function of records as one of rows."""
    names = list(inspect.signature(function).parameters)

    @functools.wraps(function)
    def call(*given, **named):
        arguments, written, taken = [], [], iter(given)
        at = 0
        while at < len(names):
            pair = tuple(names[at : at + 2])
            try:
                one = next(taken)
            except StopIteration:
                break
            if names[at] == "m":
                arguments.append(record(one))
            elif pair in _SPLIT:
                s, z = split(one)
                arguments += [s, z]
                if pair == ("ds", "dz"):
                    written.append((one, s, z))
                at += 1
            elif names[at] in ("s", "ds") or (names[at] == "before" and not isinstance(one, float)):
                arguments.append(split(one)[0])
            elif names[at] in ("z", "memory_before"):
                arguments.append(split(one)[1])
            elif names[at] == "dz":
                dz = [0.0] * (len(one) - len(STATE_NAMES))
                arguments.append(dz)
                written.append((one, None, dz))
            else:
                arguments.append(one)
            at += 1
        result = function(*arguments, **named)
        for one, s, z in written:
            if s is None:
                one[: len(z)] = z
            else:
                one[:] = joined_states(s, z)
        return result

    return call


def rest(row, act, tendon_length, pressure):
    """Write the states of `pamsim.physics.rest_state.rest`."""
    act[:] = _rest_state.rest(record(row), len(act), tendon_length, pressure)


def quieten(row, act, tendon_length, pressure):
    s, z = split(act)
    _rest_state.quieten(record(row), s, tendon_length, pressure)
    act[:] = joined_states(s, z)


def air_flow(row, pressure_abs, command, time):
    """Mass flow into a chamber right behind quick valves, less the leak [kg/s]."""
    m = record(row)
    opening = _valves.wanted_opening(m, command, pressure_abs - m.chamber.atmosphere, time)
    flow = _valves.flow_through_valves(m, pressure_abs, opening, 0.0)
    return flow - _valves.leak_flow(m, pressure_abs)


def __getattr__(name: str):
    if name in PLACES:
        return PLACES[name]
    modules = [m.name for m in pkgutil.iter_modules(pamsim.physics.__path__)]
    for module in modules:
        found = getattr(importlib.import_module(f"pamsim.physics.{module}"), name, None)
        if inspect.isfunction(found):
            return flat(found)
    if name in modules:
        return _Flat(importlib.import_module(f"pamsim.physics.{name}"))
    raise AttributeError(name)


class _Flat:
    """A module of the kernel, over rows."""

    def __init__(self, module: ModuleType) -> None:
        self._module = module

    def __getattr__(self, name: str):
        if name in ("rest", "quieten"):
            return globals()[name]
        found = getattr(self._module, name)
        return flat(found) if inspect.isfunction(found) else found
