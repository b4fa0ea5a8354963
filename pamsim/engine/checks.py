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
from dataclasses import dataclass
from typing import Any

import mujoco

from pamsim.core.errors import InvariantError
from pamsim.engine.structs import callback_offsets
from pamsim.physics.invariants import ABOVE_SUPPLY, FINITE, MASS, PRESSURE, state_name

VARIABLE = "PAMSIM_CHECK"
"""Environment variable that has the switch on from the start, unless it is empty or 0."""


@dataclass(frozen=True)
class _Broken:
    """What has been found in one simulation first.

    Attributes:
        model: None outside of its blocks of `pamsim.live`.
        code: of the invariant.
        actuator: id, or -1.
        value: that cannot be.
        bound: of it.
        time: at the end of the step [s].
        timestep: [s].
    """

    model: mujoco.MjModel | None
    code: float
    actuator: int
    value: float
    bound: float
    time: float
    timestep: float

    def text(self) -> str:
        """One line for a user."""
        at = "a joint" if self.actuator < 0 else f"actuator {self.actuator}"
        if self.model is not None and self.actuator >= 0:
            at = f"muscle {self.model.actuator(self.actuator).name!r}"
        step = ""
        if self.timestep > 0.0 and math.isfinite(self.time):
            number = round(self.time / self.timestep)
            step = f" (step {number} of {self.timestep * 1e3:g} ms)"
        return f"{at}, t = {self.time:.9g} s{step}: {self._what()}"

    def _what(self) -> str:
        value, bound = self.value, self.bound
        if self.code == FINITE and self.actuator < 0:
            return "a position or speed is not finite"
        if self.code == FINITE:
            return f"its {state_name(round(bound))} is {value:g}, not finite"
        if self.code == PRESSURE and bound == 0.0:
            return f"the chamber's absolute pressure is {value:g} Pa, not above 0"
        if self.code == PRESSURE:
            return (
                f"the chamber's absolute pressure is {value / 1e3:.6g} kPa, at most"
                f" {bound / 1e3:.6g} kPa follow from its supply"
            )
        if self.code == ABOVE_SUPPLY:
            return (
                f"a set point of {value / 1e3:.4g} kPa is above its supply; the simulation has the"
                f" supply's {bound / 1e3:.4g} kPa at most"
            )
        if self.code == MASS:
            return (
                f"the air gained differs from what its valves and leaks passed by {value:.3g} kg/s,"
                f" rounding explains {bound:.3g}"
            )
        return f"its tension is {value:g} N, and it only pulls"


class _Switch:
    """Whether it is on, and what the engine's plugins then call."""

    def __init__(self) -> None:
        self.on = os.environ.get(VARIABLE, "0") not in ("", "0")
        self.plugins: list[tuple[Any, Any, Callable[[], Any]]] = []

    def turn(self, on: bool) -> None:
        self.on = on
        for entry, usual, checking in self.plugins:
            entry.advance = ctypes.cast(checking() if on else usual, ctypes.c_void_p)


_switch = _Switch()
_found: dict[tuple[int, int, bool], _Broken] = {}
"""By address of the data, id of the model in its block, and whether it is a warning."""
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
    """Have a plugin checked while the switch is on.

    Args:
        entry: the engine's own, see `pamsim.engine.plugin`.
        usual: what the engine calls after each step while it is off.
        checking: returns what it calls while it is on.
    """
    _switch.plugins.append((entry, usual, checking))
    _switch.turn(_switch.on)


def report(model: int, data: int, code: float, actuator: int, value: float, bound: float) -> None:
    """Note a broken invariant, unless one of the same simulation waits to be raised.

    Args:
        model: address of it.
        data: address of it.
        code: see `pamsim.physics.invariants`.
        actuator: id, or -1 for the joints.
        value: that cannot be.
        bound: of it.
    """
    at, number = callback_offsets(), ctypes.c_double.from_address
    known = next((block[model] for block in tuple(_blocks) if model in block), None)
    time, timestep = number(data + at["time"]).value, number(model + at["timestep"]).value
    broken = _Broken(known, code, actuator, value, bound, time, timestep)
    _found.setdefault((data, id(known), code == ABOVE_SUPPLY), broken)


_INT, _FLOAT = ctypes.c_int64, ctypes.c_double
reporter = ctypes.CFUNCTYPE(None, _INT, _INT, _FLOAT, _INT, _FLOAT, _FLOAT)(report)
"""For compiled code."""


@contextmanager
def raised_at_end(models: Sequence[mujoco.MjModel]) -> Iterator[None]:
    """Raise at the end of a ``with`` block what is found in some models meanwhile.

    Raises:
        InvariantError: naming the first.

    Warns:
        RuntimeWarning: of the first set point above its supply.
    """
    block = {int(model._address): model for model in models}
    _blocks.append(block)
    try:
        yield
    finally:
        _blocks.remove(block)
    raise_found(models)


def raise_found(models: Sequence[mujoco.MjModel] | None = None) -> None:
    """Raise what has been found since the last call.

    Args:
        models: only what was found in blocks of these; None for all of the process.

    Raises:
        InvariantError: naming the first.

    Warns:
        RuntimeWarning: of the first set point above its supply.
    """
    taken = [_found.pop(key) for key in _keys(models)]
    broken = [one for one in taken if one.code != ABOVE_SUPPLY]
    if broken:
        raise InvariantError(broken[0].text())
    if taken:
        warnings.warn(taken[0].text(), RuntimeWarning, stacklevel=2)


def forget(model: mujoco.MjModel, *, above_supply: bool = False) -> None:
    """Leave out what has been found in a model's block, as the user is told of it otherwise.

    Args:
        model: of the block.
        above_supply: True for set points above its supply, False for all else.
    """
    for key in _keys([model]):
        if key[-1] == above_supply:
            del _found[key]


def _keys(models: Sequence[mujoco.MjModel] | None) -> list[tuple[int, int, bool]]:
    found = list(_found.items())
    return [key for key, one in found if models is None or any(one.model is m for m in models)]


def check_clock(before: float, after: float, expected: float) -> None:
    """Refuse a time that has not advanced as it must.

    Args:
        before: [s].
        after: [s].
        expected: difference [s].

    Raises:
        InvariantError: if the difference is another, beyond rounding.
    """
    if not abs(after - before - expected) <= 1e-9 * (abs(before) + expected):
        raise InvariantError(
            f"time went from {before:.9g} s to {after:.9g} s, although the steps amount to"
            f" {expected:g} s"
        )


@atexit.register
def _print_left() -> None:
    for one in _found.values():
        print(f"pamsim: {VARIABLE}: {one.text()}", file=sys.stderr)
