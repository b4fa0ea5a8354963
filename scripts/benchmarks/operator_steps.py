"""Cost of one step of the operators with much memory, against the textbook way to compute them.

    python scripts/benchmarks/operator_steps.py [--json FILE]

- Preisach: its relays one by one.
- The fractional Maxwell element: the fractional derivative by its Gruenwald-Letnikov sum over the
  whole past, in steps of 1 ms. Its error, and that of the branches, is that of the complex
  stiffness at 1 Hz after 10 s.

Both sides are compiled scalar code, so the ratio is that of the methods and not of two languages.
Rounds alternate between them; the figures are medians.
"""

from __future__ import annotations

import functools
import math
from types import FunctionType

import numba
import numpy as np
from timing import finish, in_turn, parser, seconds

from pamsim.papers.nguyen2024.loop import complex_stiffness
from pamsim.papers.vandamme2008.loop import levels_of, printed_weight, relay_weights
from pamsim.physics.hysteresis import fractional_maxwell, preisach

ROUNDS = 9
LEVELS = (25, 100)
STEP, SECONDS, FREQUENCY = 1e-3, 10.0, 1.0
ORDER, TIME_CONSTANT, BRANCHES = 0.27, 49.82, 16
"""Of the element that Nguyen 2024 identified, and the branches it has by default."""


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
    def run(table, memory, inputs, outputs):
        for n in range(len(inputs)):
            outputs[n] = compiled(table, memory, inputs[n])

    return run


def compiled(function: FunctionType):
    """A law compiled together with every function that it calls."""
    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        if isinstance(names.get(name), FunctionType):
            names[name] = compiled(names[name])
    return numba.njit(FunctionType(function.__code__, names, function.__name__))


def engine_run(output_law: FunctionType, rates_law: FunctionType):
    """An operator of the engine over many inputs, output and update as in one of its steps."""
    output, rates = compiled(output_law), compiled(rates_law)

    @numba.njit
    def run(par, act, inputs, outputs):
        change = np.zeros_like(act)
        for n in range(len(inputs)):
            u = inputs[n]
            outputs[n] = output(par, act, u)
            following = inputs[min(n + 1, len(inputs) - 1)]
            rates(par, act, change, u, (following - u) / 1e-3, 1e-3)
            act += 1e-3 * change

    return run


def record_of(**fields: float) -> np.void:
    """An operator's parameters as compiled code has them: a record of its fields."""
    kind = np.dtype([(name, np.float64) for name in fields])
    return np.array([tuple(fields.values())], dtype=kind)[0]


def grunwald_letnikov():
    """Force of the element over K_e by F + s D F = s D x with s = beta^alpha, all of the past."""

    @numba.njit
    def run(par, memory, inputs, outputs):
        scale = (par[1] / 1e-3) ** par[0]
        memory[0] = 1.0
        for k in range(1, len(inputs)):
            memory[k] = memory[k - 1] * (1.0 - (par[0] + 1.0) / k)
        for n in range(len(inputs)):
            past = 0.0
            for k in range(1, n + 1):
                past += memory[k] * (inputs[n - k] - outputs[n - k])
            outputs[n] = scale * (inputs[n] + past) / (1.0 + scale)

    return run


def seconds_per_step(peers, inputs) -> tuple[list[float], list[np.ndarray]]:
    """Median time of a step of each peer, and its outputs.

    Args:
        peers: function, parameters and memory before the first input, of each.
        inputs: (n,).
    """
    outputs = [np.zeros(len(inputs)) for _ in peers]
    for run, par, memory in peers:
        run(par, memory.copy(), inputs[:2], np.zeros(2))

    def timed(run, par, memory, output) -> float:
        return seconds(functools.partial(run, par, memory.copy(), inputs, output)) / len(inputs)

    timers = [functools.partial(timed, *one, out) for one, out in zip(peers, outputs, strict=True)]
    return np.median(in_turn(timers, ROUNDS), axis=1).tolist(), outputs


def timed_row(operator: str, size: str, peer: str, seconds: list[float]) -> dict[str, object]:
    """Of the table: an operator against its peer, from the times of a step of peer and engine."""
    plain, ours = (1e6 * each for each in seconds)
    return {
        "operator": operator,
        "size": size,
        "peer": peer,
        "peer_us": plain,
        "engine_us": ours,
        "ratio": plain / ours,
    }


def preisach_row(n: int) -> dict[str, object]:
    """Both ways with ``n`` levels."""
    # A path as a simulation gives it: small steps, with reversals of every size.
    t = np.linspace(0.0, 60.0, 4000)
    path = np.sin(t) * np.sin(0.61 * t) * np.sin(0.13 * t + 0.5)
    order = np.arange(n)
    relays = -np.sign(order[:, None] + order[None, :] - (n - 1.0))
    table = np.vstack([relay_weights(n, printed_weight), levels_of(n)])
    par = record_of(levels=n, low_contraction=-1.0, high_contraction=1.0, c=-0.1, d=-1.0)
    engine = engine_run(preisach.preisach_output, preisach.preisach_rates)
    peers = [(repeated(relay_step), table, relays), (engine, par, np.zeros(n))]
    times, _ = seconds_per_step(peers, path)
    return timed_row("preisach", f"{n} levels", "relays one by one", times)


def fractional_row() -> dict[str, object]:
    """Both ways over ``SECONDS`` of a sine."""
    t = np.arange(round(SECONDS / STEP)) * STEP
    omega = 2.0 * math.pi * FREQUENCY
    path = np.sin(omega * t)
    engine = engine_run(
        fractional_maxwell.fractional_maxwell_output, fractional_maxwell.fractional_maxwell_rates
    )
    par = record_of(
        branches=BRANCHES,
        order=ORDER,
        time_constant=TIME_CONSTANT,
        span=1.0,
        slowest_rate=3e-3,
        fastest_rate=3e4,
    )
    peers = [
        (grunwald_letnikov(), np.array([ORDER, TIME_CONSTANT]), np.zeros(len(t))),
        (engine, par, np.zeros(BRANCHES)),
    ]
    times, outputs = seconds_per_step(peers, path)
    exact = complex_stiffness(omega, ORDER, TIME_CONSTANT, 1.0)
    last = slice(-round(1.0 / FREQUENCY / STEP), None)
    errors = [
        abs(2.0 * np.mean(w[last] * 1j * np.exp(-1j * omega * t[last])) / exact - 1.0)
        for w in outputs
    ]
    size = f"{BRANCHES} branches, {SECONDS:g} s"
    row = timed_row("fractional_maxwell", size, "Gruenwald-Letnikov sum", times)
    return row | {"peer_error": float(errors[0]), "engine_error": float(errors[1])}


def main() -> None:
    """Time the peers, print microseconds per step and ratios, write."""
    target = parser(__doc__).parse_args().json
    rows = [*map(preisach_row, LEVELS), fractional_row()]
    finish("operator_steps.py", {"rounds": ROUNDS, "rows": rows}, target, "numba")


if __name__ == "__main__":
    main()
