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
"""

from __future__ import annotations

import atexit
import ctypes
import math
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import mujoco

from pamsim.core.errors import InvariantError
from pamsim.engine.structs import callback_offsets
from pamsim.physics.invariants import ABOVE_SUPPLY, FINITE, MASS, PRESSURE, state_name

VARIABLE = "PAMSIM_CHECK"
"""Environment variable that has the switch on from the start, unless it is empty or 0."""

_REPORT = ctypes.CFUNCTYPE(
    None,
    ctypes.c_int64,
    ctypes.c_int64,
    ctypes.c_double,
    ctypes.c_int64,
    ctypes.c_double,
    ctypes.c_double,
)


@dataclass(frozen=True, kw_only=True)
class _Broken:
    """What has been found in one simulation first.

    Attributes:
        model: address of it.
        code: of the invariant.
        actuator: id, or -1.
        value: that cannot be.
        bound: of it.
        time: at the end of the step [s].
        timestep: [s].
    """

    model: int
    code: float
    actuator: int
    value: float
    bound: float
    time: float
    timestep: float

    def text(self, model: mujoco.MjModel | None) -> str:
        """One line for a user."""
        at = "a joint" if self.actuator < 0 else f"actuator {self.actuator}"
        if model is not None and self.actuator >= 0:
            at = f"muscle {model.actuator(self.actuator).name!r}"
        value, bound = self.value, self.bound
        if self.code == FINITE and self.actuator < 0:
            what = "a position or speed is not finite"
        elif self.code == FINITE:
            name = state_name(round(bound))
            what = f"its {name} is {value:g}, not finite"
        elif self.code == PRESSURE and bound == 0.0:
            what = f"the chamber's absolute pressure is {value:g} Pa, not above 0"
        elif self.code == PRESSURE:
            what = (
                f"the chamber's absolute pressure is {value / 1e3:.6g} kPa, at most"
                f" {bound / 1e3:.6g} kPa follow from its supply"
            )
        elif self.code == ABOVE_SUPPLY:
            what = (
                f"a set point of {value / 1e3:.4g} kPa is above its supply; the simulation has the"
                f" supply's {bound / 1e3:.4g} kPa at most"
            )
        elif self.code == MASS:
            what = (
                f"the air gained differs from what its valves and leaks passed by {value:.3g} kg/s,"
                f" rounding explains {bound:.3g}"
            )
        else:
            what = f"its tension is {value:g} N, and it only pulls"
        step = ""
        if self.timestep > 0.0 and math.isfinite(self.time):
            number = round(self.time / self.timestep)
            step = f" (step {number} of {self.timestep * 1e3:g} ms)"
        return f"{at}, t = {self.time:.9g} s{step}: {what}"


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
_found: dict[int, _Broken] = {}
_above_supply: dict[int, _Broken] = {}


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
    at = callback_offsets()
    broken = _Broken(
        model=model,
        code=code,
        actuator=actuator,
        value=value,
        bound=bound,
        time=ctypes.c_double.from_address(data + at["time"]).value,
        timestep=ctypes.c_double.from_address(model + at["timestep"]).value,
    )
    found = _above_supply if code == ABOVE_SUPPLY else _found
    found.setdefault(data, broken)


reporter = _REPORT(report)
"""For compiled code."""


def raise_found(models: Iterable[mujoco.MjModel] | None = None) -> None:
    """Raise what has been found since the last call.

    Args:
        models: only of these, which gives muscles their names; None for all of the process.

    Raises:
        InvariantError: naming the first.

    Warns:
        RuntimeWarning: of the first set point above its supply.
    """
    if not _found and not _above_supply:
        return
    named = None if models is None else {int(model._address): model for model in models}

    def first(found: dict[int, _Broken]) -> str:
        mine = [at for at, one in found.items() if named is None or one.model in named]
        taken = [found.pop(at) for at in mine]
        if not taken:
            return ""
        return taken[0].text(None if named is None else named[taken[0].model])

    asked, broken = first(_above_supply), first(_found)
    if broken:
        raise InvariantError(broken)
    if asked:
        warnings.warn(asked, RuntimeWarning, stacklevel=2)


def forget(model: mujoco.MjModel) -> None:
    """Leave out what has been found in a model's runs, whose outcomes report it."""
    _leave_out(model, _found)


def allow_above_supply(model: mujoco.MjModel) -> None:
    """Leave out a model's set points above its supply, of which the user has been warned."""
    _leave_out(model, _above_supply)


def _leave_out(model: mujoco.MjModel, found: dict[int, _Broken]) -> None:
    for at in [at for at, one in found.items() if one.model == int(model._address)]:
        del found[at]


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
    for one in (*_above_supply.values(), *_found.values()):
        print(f"pamsim: {VARIABLE}: {one.text(None)}", file=sys.stderr)
