"""The integrator compiled to machine code, kept on disk under a key that covers all its laws."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numba
from numba.extending import register_jitable

from pamsim.engine.jit import fingerprint, reached_functions
from tests.plant.integrate import sampled


@register_jitable
def _keyed_by(key: Any) -> None:
    """Make the compiled function close over its key and so enter it in numba's cache key."""


def _compile(key: str) -> Callable[..., None]:
    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def integrate(joint, muscles, plays, states, times, arrivals, by_pressure, start, step, rows):
        _keyed_by(key)
        sampled(joint[0], muscles, plays, states, times, arrivals, by_pressure, start, step, rows)

    return integrate


@functools.cache
def compiled_integrator() -> Callable[..., None]:
    """Compile `tests.plant.integrate.sampled`, or load it from numba's cache."""
    functions = reached_functions(sampled)
    for function in functions:
        register_jitable(function)
    return _compile(fingerprint(functions))
