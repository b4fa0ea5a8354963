"""How often identify's defaults find the structure of planted random systems.

    python scripts/identify_planted.py [--systems 200] [--inputs 1] [--workers 2] [--json FILE]

System number i is drawn with seed i, before anything is fitted: 1 to 5 poles (as many systems of
each), of which a third of the systems of two or more have one at 0; oscillating pairs (damping 0.1
to 0.8) and lags, time constants of neighbours apart by a factor of 2 to 4 between 5 samples and a
tenth of the record; up to one zero in half of the systems of two or more poles; a dead time of 2 to
15 samples in a third. Each record has 1,000 samples of a random telegraph whose shortest hold is a
third of the slowest time constant, is cut out of motion, and has an offset, an input bias where it
integrates, in a third of the systems a drift of 10 % of the output's spread over the record, and
white noise or noise of 5 samples' correlation, of 1 to 5 % of the output's spread. With
``--inputs 2`` a second telegraph acts through the same poles, with a gain, zero and dead time of
its own, drawn by the same rules.

The plant is scipy's exact zero-order hold of the state space. Counted: the chosen number of poles,
integrators included, against the planted one; whether a recommended model fails its own residual
test; and how many 95 % intervals hold the planted numbers: of a fit of the planted structure all,
of the one that was chosen those of gains and dead times.
Finished rows are kept in out/identify_planted_INPUTS.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from records import Task, fingerprint, kept_rows, noise, parser, share, write_rows
from scipy.signal import cont2discrete, tf2ss

from pamsim.core.computation import one_blas_thread, versions
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.model import IdentifiedModel
from pamsim.identification.models import ModelSet, fit_models
from pamsim.identification.records import SignalRecord
from pamsim.identification.starts import pole_coordinates

SAMPLES, BEFORE, INTERVAL = 1000, 1500, 0.01
DRIFT = 0.1


@dataclass(frozen=True)
class System:
    """One planted system: what identify should find."""

    constants: NDArray[Any]
    integrators: int
    above: tuple[FloatArray, ...]
    dead_times: tuple[float, ...]
    drift: bool
    noise: float
    correlation: float

    @property
    def below(self) -> FloatArray:
        """Denominator, highest power first."""
        result: NDArray[Any] = np.array([1.0])
        for constant in self.constants:
            result = np.convolve(result, [constant, 1.0])
        return np.append(np.real(result), np.zeros(self.integrators))


def drawn(number: int, inputs: int) -> System:
    """System of a number, with one or two inputs."""
    draw = np.random.default_rng([number, 19])
    poles = 1 + number % 5
    integrators = int(poles > 1 and draw.random() < 1.0 / 3.0)
    lags = poles - integrators
    slowest = draw.uniform(0.5, 1.0) * 0.1 * SAMPLES * INTERVAL
    sizes = slowest / np.cumprod(np.append(1.0, draw.uniform(2.0, 4.0, lags)))[:lags]
    sizes = np.maximum(sizes, 5.0 * INTERVAL * np.arange(lags, 0, -1) ** 0.5)
    constants: list[complex] = []
    while len(constants) < lags:
        size = sizes[len(constants)]
        if lags - len(constants) > 1 and draw.random() < 0.5:
            angle = np.arccos(draw.uniform(0.1, 0.8))
            constants += [size * np.exp(1j * angle), size * np.exp(-1j * angle)]
        else:
            constants.append(complex(size))
    numerators: list[FloatArray] = []
    dead_times: list[float] = []
    for i in range(inputs):
        own = draw if i == 0 else np.random.default_rng([number, 29])
        above, late, gain = numerator(own, poles, slowest)
        numerators.append(gain * above)
        dead_times.append(late)
    drift = bool(draw.random() < 1.0 / 3.0)
    noise, correlation = draw.uniform(0.01, 0.05), float(draw.choice([0.0, 5.0]))
    return System(
        constants=np.array(constants),
        integrators=integrators,
        above=tuple(numerators),
        dead_times=tuple(dead_times),
        drift=drift,
        noise=noise,
        correlation=correlation,
    )


def numerator(
    draw: np.random.Generator, poles: int, slowest: float
) -> tuple[FloatArray, float, float]:
    """Numerator of gain 1, dead time and gain of one input."""
    zero = poles > 1 and draw.random() < 0.5
    above = [draw.choice([-1.0, 1.0]) * draw.uniform(0.2, 2.0) * slowest, 1.0] if zero else [1.0]
    late = INTERVAL * draw.integers(2, 16) if draw.random() < 1.0 / 3.0 else 0.0
    return np.array(above), float(late), draw.uniform(0.5, 5.0)


def recorded(system: System, number: int) -> SignalRecord:
    """Its record, cut out of motion."""
    draw = np.random.default_rng([number, 23])
    slowest, balanced = float(np.max(np.abs(system.constants))), system.integrators > 0
    inputs = [
        telegraph(np.random.default_rng([number, 31, i]) if i else draw, slowest, balanced)
        for i in range(len(system.above))
    ]
    output = sum(
        through(system, above, late, given)
        for above, late, given in zip(system.above, system.dead_times, inputs, strict=True)
    )[BEFORE:]
    spread = float(np.std(output))
    errors = noise(draw, (SAMPLES,), system.correlation, 500)
    output = output + 0.3 * spread + system.noise * spread * errors
    if system.drift:
        output = output + DRIFT * spread * np.linspace(0.0, 1.0, SAMPLES)
    bias = 0.2 if system.integrators else 0.0
    time_s = INTERVAL * np.arange(SAMPLES)
    return SignalRecord(str(number), time_s, np.column_stack(inputs)[BEFORE:] + bias, output)


def telegraph(draw: np.random.Generator, slowest: float, balanced: bool) -> FloatArray:
    """-1 or 1, held for a third of a time constant at least."""
    hold = max(int(slowest / INTERVAL / 3.0), 5)
    levels = draw.choice([-1.0, 1.0], (SAMPLES + BEFORE) // hold + 1)
    given = np.repeat(levels, hold)[: SAMPLES + BEFORE]
    # Of what integrates as many up as down, so that the output stays in range.
    return given - np.mean(given) if balanced else given


def through(system: System, above: FloatArray, late: float, given: FloatArray) -> FloatArray:
    """Output of the plant from one input."""
    held = np.append(np.zeros(round(late / INTERVAL)), given)[: given.size]
    a, b, c, d, _ = cont2discrete(tf2ss(above, system.below), INTERVAL)
    x, output = np.zeros(a.shape[0]), np.empty(given.size)
    for k, u in enumerate(held):
        output[k] = (c @ x + d[:, 0] * u)[0]
        x = a @ x + b[:, 0] * u
    return output


@one_blas_thread()
def run_one(kind: str, name: str, seed: int) -> dict[str, Any]:
    """Identify one record by default, and fit its planted structure."""
    del kind
    system = drawn(seed, int(name))
    record = recorded(system, seed)
    began = time.perf_counter()
    fitted = fit_models([record], [], ModelSet(start="free"))
    chosen = fitted.recommended()
    seconds = time.perf_counter() - began
    best = next((c for c in fitted.candidates if c.name == chosen.best), None)
    row: dict[str, Any] = {
        "poles": system.constants.size + system.integrators,
        "integrators": system.integrators,
        "zeros": _alone([above.size - 1 for above in system.above]),
        "dead_time": _alone([bool(late) for late in system.dead_times]),
        "drift": system.drift,
        "best": chosen.best,
        "recommended": chosen.name,
        "missing": chosen.missing,
        "seconds": seconds,
        "intervals": intervals(system, record),
    }
    if best is not None:
        structure = best.fit.structure
        row["chosen"] = intervals_after_choice(system, best.fit)
        row["found"] = {
            "poles": structure.order + structure.integrators,
            "integrators": structure.integrators,
            "zeros": _alone(structure.numerator_zeros),
            "dead_time": _alone([i in structure.delayed for i in range(structure.inputs)]),
            "status": best.fit.status.value,
            "passes": best.adequate,
            "fit_percent": best.fit.fit_percent,
        }
    return row


def _alone(each: Sequence[Any]) -> Any:
    """What is stated of the only input, or a list of it for several."""
    return each[0] if len(each) == 1 else list(each)


def intervals(system: System, record: SignalRecord) -> dict[str, list[float]]:
    """Name -> planted value and 95 % interval of it, of a fit of the planted structure."""
    start = pole_coordinates(system.constants)
    late = [delay for delay in system.dead_times if delay]
    try:
        zeros = tuple(above.size - 1 for above in system.above)
        structure = ContinuousStructure(
            order=system.constants.size,
            zeros=max(zeros),
            zeros_each=zeros,
            inputs=len(zeros),
            dead_time=bool(late),
            undelayed=tuple(i for i, delay in enumerate(system.dead_times) if late and not delay),
            real_lags=False,
            start="free",
            integrators=system.integrators,
            drift=system.drift and not system.integrators,
        )
        fit = fit_model([record], structure, starts=[np.append(start, late)])
    except InputError:
        return {}
    values = planted_numbers(system)
    # The search begins at the planted poles: each pair is found in its place.
    count = int(np.sum(system.constants.imag > 0.0))
    places = {float(np.exp(x)): i for i, x in enumerate(fit.coordinates[: 2 * count])}
    values |= {
        e.name: float(np.exp(start[places[e.value]])) for e in fit.estimates if e.value in places
    }
    return held_by(values, fit)


def intervals_after_choice(system: System, fit: IdentifiedModel) -> dict[str, list[float]]:
    """Name -> planted value and 95 % interval of it, of the structure that was chosen.

    Gains and dead times mean the same whatever the number of poles, if not that of integrators.
    """
    if fit.structure.integrators != system.integrators:
        return {}
    return held_by(planted_numbers(system), fit)


def planted_numbers(system: System) -> dict[str, float]:
    """Name -> planted gain or dead time of every input."""
    found: dict[str, float] = {}
    for i, (above, late) in enumerate(zip(system.above, system.dead_times, strict=True), start=1):
        number = "" if len(system.above) == 1 else f"[{i}]"
        found |= {f"K{number}": float(above[-1]), f"L{number}": late}
    return found


def held_by(values: dict[str, float], fit: IdentifiedModel) -> dict[str, list[float]]:
    """Name -> planted value and 95 % interval of it, where a fit has one."""
    return {
        e.name: [values[e.name], *e.interval95]
        for e in fit.estimates
        if e.name in values and e.interval95 is not None
    }


def scores(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What was counted."""
    found = [row for row in rows if "found" in row]
    off = [row["found"]["poles"] - row["poles"] for row in found]
    recommended = [row for row in found if row["recommended"]]
    covered = [low <= value <= high for r in rows for value, low, high in r["intervals"].values()]
    plain = [row for row in found if not row["drift"]]
    return {
        "poles_within_one": share(sum(abs(n) <= 1 for n in off), len(rows)),
        "poles_exact": share(sum(n == 0 for n in off), len(rows)),
        "poles_within_one_without_drift": share(
            sum(abs(r["found"]["poles"] - r["poles"]) <= 1 for r in plain), len(plain)
        ),
        "integrator_right": share(
            sum(bool(r["found"]["integrators"]) == bool(r["integrators"]) for r in found), len(rows)
        ),
        "recommended": share(len(recommended), len(rows)),
        "recommended_failing_their_test": share(
            sum(not row["found"]["passes"] for row in recommended), len(recommended)
        ),
        "intervals_that_hold": share(sum(covered), len(covered)),
        **{f"{kind}_after_choice_that_hold": held(found, kind) for kind in ("K", "L")},
        "median_seconds": float(np.median([row["seconds"] for row in rows])),
    }


def held(rows: list[dict[str, Any]], kind: str) -> dict[str, Any]:
    """Share of intervals of a kind of number that hold, of structures that were chosen."""
    ends = [each for row in rows for name, each in row["chosen"].items() if name[0] == kind]
    return share(sum(low <= value <= high for value, low, high in ends), len(ends))


def main() -> None:
    """Run what is left, score, write."""
    arguments = parser(__doc__, systems=200, workers=2)
    arguments.add_argument("--inputs", type=int, default=1, choices=(1, 2))
    options = arguments.parse_args()
    tasks: list[Task] = [("planted", str(options.inputs), i) for i in range(options.systems)]
    mark = fingerprint("pamsim", __file__)
    kept = Path(f"out/identify_planted_{options.inputs}")
    rows = kept_rows(run_one, tasks, kept, mark, options.workers)
    two = " --inputs 2" if options.inputs == 2 else ""
    result = {
        "command": f"python scripts/identify_planted.py --systems {options.systems}{two}",
        "fingerprint": mark,
        "versions": versions("scipy"),
        "scores": scores(list(rows.values())),
        "rows": [{"number": number, **row} for (_, _, number), row in rows.items()],
    }
    write_rows(result, options.json)


if __name__ == "__main__":
    main()
