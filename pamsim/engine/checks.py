"""A switch that checks the muscles after every step: states that cannot be end in an error.

While it is on, the engine calls a function of the muscles' plugin at the end of each step, on every
path and in every thread: `pamsim.simulate`, environments, ``mujoco.rollout`` or plain ``mj_step``.
What is checked stands in `pamsim.physics.invariants`; positions and speeds have to be finite too.
The function only reads, so results are the same to the bit. While the switch is off it is not
called.

The engine cannot pass an error on. It is raised when `pamsim.simulate`, a step of an environment, a
block of `pamsim.live` or one of `checks` ends, and what is left is printed when the process ends.
A set point above the supply's pressure breaks nothing, since the valves then stay open: it is a
warning, given at the same moments.

The plugin knows a model by its address alone, which may be another's before and after. So only a
model whose block of `pamsim.live` goes on, and which therefore exists, is taken for the one there.
"""

from __future__ import annotations

import atexit
import ctypes
import math
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import mujoco

from pamsim.core.errors import InvariantError
from pamsim.engine.plugin import making_a_model
from pamsim.engine.structs import callback_offsets
from pamsim.physics.invariants import ABOVE_SUPPLY, FINITE, MASS, PRESSURE, TENSION, state_name

VARIABLE = "PAMSIM_CHECK"
"""Environment variable that has the switch on from the start, unless it is empty or 0."""

_WHAT = {
    FINITE: "its {state} is {value:g}, not finite",
    PRESSURE: "the chamber's absolute pressure is {kilo:.6g} kPa, at most {most:.6g} kPa follow"
    " from its supply",
    TENSION: "its tension is {value:g} N, and it only pulls",
    MASS: "the air gained differs from what its valves and leaks passed by {value:.3g} kg/s,"
    " rounding explains {bound:.3g}",
    ABOVE_SUPPLY: "a set point of {kilo:.4g} kPa is above its supply; the simulation has the"
    " supply's {most:.4g} kPa at most",
}


class _Switch:
    def __init__(self) -> None:
        self.on = os.environ.get(VARIABLE, "0") not in ("", "0")
        self.plugins: list[tuple[Any, Any, Callable[[], Any]]] = []  # as `watch` is given them

    def turn(self, on: bool) -> None:
        self.on = on
        for entry, usual, checking in self.plugins:
            entry.advance = checking() if on else usual


_switch = _Switch()
_found: dict[tuple[int, int, bool], tuple[mujoco.MjModel | None, str]] = {}
"""First of each simulation, by address of its data, id of its model and whether it is a warning:
the model, None outside of its blocks of `pamsim.live`, and a line for a user."""

_blocks: list[dict[int, mujoco.MjModel]] = []
"""Models by their addresses, of each block of `pamsim.live` that goes on."""


def is_on() -> bool:
    """Whether steps are checked."""
    return _switch.on


@contextmanager
def checks(on: bool = True) -> Iterator[None]:
    """Check every step of every muscle in the process for the duration of a ``with`` block.

    Args:
        on: False to leave the checks out, where the environment variable ``PAMSIM_CHECK`` asks for
            them.

    Raises:
        InvariantError: at the end of the block or in it, if a state cannot be: a number that is not
            finite, a pressure or tension that is impossible, air from nowhere, time that stands
            still. It names the step, the muscle and the numbers.

    Warns:
        RuntimeWarning: then too, of a set point above the supply's pressure.
    """
    before = _switch.on
    _switch.turn(on)
    try:
        yield
    finally:
        _switch.turn(before)
    raise_found()


def watch(entry: Any, usual: Any, checking: Callable[[], Any]) -> None:
    """Have the engine call ``checking()`` at its entry while the switch is on, else the usual.

    Both are addresses of functions.
    """
    _switch.plugins.append((entry, usual, checking))
    _switch.turn(_switch.on)


def report(model: int, data: int, code: float, actuator: int, value: float, bound: float) -> None:
    """Note a broken invariant, unless one of the same simulation waits to be raised.

    The step with which the engine tries a model that it compiles does not count.
    Given are the addresses of model and data, what `pamsim.physics.invariants` says, and the id of
    the actuator, -1 for the joints.
    """
    if making_a_model():
        return
    known = next((block[model] for block in tuple(_blocks) if model in block), None)
    key = data, id(known), code == ABOVE_SUPPLY
    if key in _found:
        return
    at, number = callback_offsets(), ctypes.c_double.from_address
    time, timestep = number(data + at["time"]).value, number(model + at["timestep"]).value
    when, state = f"t = {time:.9g} s", ""
    if timestep > 0.0 and math.isfinite(time):
        when += f" (step {round(time / timestep)} of {timestep * 1e3:g} ms)"
    who, what = f"actuator {actuator}", _WHAT[code]
    if actuator < 0:
        who, what = "a joint", "a position or speed is not finite"
    elif known is not None:
        who = f"muscle {known.actuator(actuator).name!r}"
    if code == FINITE and actuator >= 0:
        state = state_name(round(bound))
    elif code == PRESSURE and bound == 0.0:
        what = "the chamber's absolute pressure is {value:g} Pa, not above 0"
    what = what.format(state=state, value=value, bound=bound, kilo=value / 1e3, most=bound / 1e3)
    _found[key] = known, f"{who}, {when}: {what}"


_INT, _FLOAT = ctypes.c_int64, ctypes.c_double
reporter = ctypes.CFUNCTYPE(None, _INT, _INT, _FLOAT, _INT, _FLOAT, _FLOAT)(report)
"""For compiled code."""


@contextmanager
def raised_at_end(models: Sequence[mujoco.MjModel]) -> Iterator[None]:
    """Raise at the end of a ``with`` block what is found in some models, see `raise_found`."""
    block = {int(model._address): model for model in models}
    _blocks.append(block)
    try:
        yield
    finally:
        _blocks.remove(block)
    raise_found(models)


def raise_found(models: Sequence[mujoco.MjModel] | None = None) -> None:
    """Raise what has been found since the last call, in blocks of some models, or at all.

    Raises:
        InvariantError: naming the first.

    Warns:
        RuntimeWarning: of the first set point above its supply.
    """
    ids = None if models is None else {id(model) for model in models}
    keys = [key for key in tuple(_found) if ids is None or key[1] in ids]
    taken = {key: _found.pop(key)[1] for key in keys}
    broken = [text for (*_, warning), text in taken.items() if not warning]
    if broken:
        raise InvariantError(broken[0])
    if taken:
        warnings.warn(next(iter(taken.values())), RuntimeWarning, stacklevel=2)


def forget(model: mujoco.MjModel, *, above_supply: bool = False) -> None:
    """Leave out what a model's block has found and a recording or warning says anyhow.

    These are either its set points above the supply, or all else.
    """
    for key in tuple(_found):
        if key[1:] == (id(model), above_supply):
            del _found[key]


def check_clock(before: float, after: float, expected: float) -> None:
    """Refuse a time that has not advanced as expected, beyond rounding; all in s.

    Raises:
        InvariantError: if so.
    """
    if not abs(after - before - expected) <= 1e-9 * (abs(before) + expected):
        raise InvariantError(
            f"time went from {before:.9g} s to {after:.9g} s, although the steps amount to"
            f" {expected:g} s"
        )


@atexit.register
def _print_left() -> None:
    for _, text in _found.values():
        print(f"pamsim: {VARIABLE}: {text}", file=sys.stderr)
