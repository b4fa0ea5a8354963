"""Cost of one step of the Preisach operator: its relays one by one against the engine's operator.

    python scripts/benchmarks/preisach_step.py [--levels N]

Both are compiled scalar code, so the ratio is that of the methods and not of two languages. Rounds
alternate between the two; the figures are medians.
"""

from __future__ import annotations

import argparse
import statistics
import time
from types import FunctionType

import numba
import numpy as np

from pamsim.hysteresis import preisach
from pamsim.papers.vandamme2008.relays import levels_of, printed_weight, relay_weights

ROUNDS = 9


def relay_step(table, relays, u):
    """Switch every relay of the triangle and add them up; returns W.

    The table holds the levels in its last row, below the weights.
    """
    n = len(relays)
    total = 0.0
    for i in range(n):
        risen = u >= table[n, i]
        for j in range(i + 1):
            if risen:
                relays[i, j] = 1.0
            elif u < table[n, j]:
                relays[i, j] = -1.0
            total += table[i, j] * relays[i, j]
    return total


def repeated(step):
    """A loop over inputs around a step, compiled with it."""
    compiled = numba.njit(step)

    @numba.njit
    def run(table, memory, inputs):
        total = 0.0
        for u in inputs:
            total += compiled(table, memory, u)
        return total

    return run


def compiled(function: FunctionType):
    """A law compiled together with every function that it calls."""
    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        if isinstance(names.get(name), FunctionType):
            names[name] = compiled(names[name])
    return numba.njit(FunctionType(function.__code__, names, function.__name__))


def engine_run():
    """The engine's operator over many inputs, output and update as in one step of the engine."""
    output, rates = compiled(preisach.preisach_output), compiled(preisach.preisach_rates)

    @numba.njit
    def run(par, act, inputs):
        change = np.zeros_like(act)
        total = 0.0
        for u in inputs:
            total += output(par, 0, act, u)
            rates(par, 0, act, change, u, 0.0, 1e-3)
            act += 1e-3 * change
        return total

    return run


def seconds_per_step(run, table, memory, inputs) -> float:
    """Mean time of a step over the inputs."""
    began = time.perf_counter()
    run(table, memory, inputs)
    return (time.perf_counter() - began) / len(inputs)


def main() -> None:
    """Time the peers and print microseconds per step and ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--levels", type=int, default=100)
    n = parser.parse_args().levels
    weights = relay_weights(n, printed_weight)
    relay_table = np.vstack([weights, levels_of(n)])
    # A path as a simulation gives it: small steps, with reversals of every size.
    time_axis = np.linspace(0.0, 60.0, 4000)
    path = np.sin(time_axis) * np.sin(0.61 * time_axis) * np.sin(0.13 * time_axis + 0.5)
    order = np.arange(n)
    relays = -np.sign(order[:, None] + order[None, :] - (n - 1.0))
    par = np.array([n, -1.0, 1.0, -0.1, -1.0])

    peers = {
        "relays": (repeated(relay_step), relay_table, relays, path),
        "engine's operator": (engine_run(), par, np.zeros(n), path),
    }
    times: dict[str, list[float]] = {name: [] for name in peers}
    for run, first, memory, inputs in peers.values():
        run(first, memory, inputs[:2])
    for _ in range(ROUNDS):
        for name, (run, first, memory, inputs) in peers.items():
            times[name].append(seconds_per_step(run, first, memory, inputs))
    middle = {name: statistics.median(values) for name, values in times.items()}
    for name, value in middle.items():
        print(f"{name:28s} {1e6 * value:10.3f} us/step at {n} levels")
    relays_time, engine_time = middle.values()
    print(f"relays / engine's operator {relays_time / engine_time:10.1f}")


if __name__ == "__main__":
    main()
