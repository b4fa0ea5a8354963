"""Whether the p-values on which a diagnosis rests hold where there is nothing to find.

    python scripts/null_calibration.py [--json scripts/results/null_calibration.json]

Every test that decides a verdict gets 500 data sets of its own null hypothesis. Its p-values should
then be uniform: one in twenty below 0.05. Shares come with exact 95 % intervals (Clopper and
Pearson, Biometrika 26, 1934), the whole distribution with the Kolmogorov-Smirnov test. A test is
too eager if p-values below one of the levels are more frequent than the level, conservative if they
are rarer, below 0.05 or anywhere; either is only said if it stays significant (5 %) after
Bonferroni's correction for all cases here. It takes three minutes.

Recordings are those of an arm that is linear in its parameters: of each input some trials to fit
and as many of another input to judge by, with a gain that is fitted. Its noise is white, drifts
(correlation time 0.3 s), has heavy tails (Student's t, 3 degrees of freedom), or is white while the
gain differs by 0.2 % from trial to trial.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import scipy
from scipy.signal import lfilter
from scipy.stats import binomtest, kstest

import pamsim
from pamsim.comparison.noise_floor import NoiseFloor, noise_floor
from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.evidence import (
    compare_models,
    compare_rows,
    compare_trials,
    losses,
    mean_over_trials,
    perfect_losses,
)
from pamsim.diagnosis.method.held_out_remainder import has_remainder
from pamsim.diagnosis.method.lack_of_fit import lack_of_fit
from pamsim.diagnosis.method.loop_effects import LOOP_EFFECTS, LoopEffect
from pamsim.diagnosis.method.loop_fit import Loop, LoopFitter
from pamsim.diagnosis.method.trial_variation import TrialVariation, held_out_excess
from pamsim.diagnosis.method.verdict_thresholds import (
    GAP_LOSS,
    GAP_P_VALUE,
    LEAST_GAIN,
    REMAINDER_LOSS,
    RIVAL_REJECTED,
    SIGNIFICANCE,
)
from pamsim.diagnosis.method.where import cells, row_maps, systematic, trial_maps
from pamsim.inference.permutation import best_of_many_p_values
from pamsim.inference.residual_block import ResidualBlock, layout

Found = tuple[dict[str, float], dict[str, bool]]
"""Of one data set: test -> its p-value, and rule of the verdict -> whether it found something."""

RESULT = Path("scripts/results/null_calibration.json")
COMMAND = "python scripts/null_calibration.py --json scripts/results/null_calibration.json"
RUNS = 500
LEVELS = (0.001, 0.01, 0.05)

RATE, COUNT = 25.0, 100
TIME = np.arange(COUNT) / RATE
NOISE = {"angle": 0.02, "pressure_1": 0.05}
PACES = {"slow": 0.3, "fast": 1.5, "high": 0.8, "low": 0.6, "late": 1.1}  # Hz
HEIGHTS = {"slow": 1.0, "fast": 1.0, "high": 2.0, "low": 0.4, "late": 1.5}
VARIATION = 0.002
EQUALLY_WRONG = "a model against another that is as wrong"
WRONG_IN_ONE = "the same, wrong in one input only"
BEST_EFFECT = "best of three effects that are not there"
EXCESS = "excess over a perfect model"
LACK = "lack of fit"
CELL = "one channel in one input"
LARGEST_CELL = "all channels in all inputs, corrected"
MAP = "one residual map"
MAPS = "all residual maps, corrected"
ROWS = "a model against another that is as wrong, by rows"
BEST_ROW_EFFECT = "best of four effects that are not there, by rows"
ROW_MAPS = "all residual maps of rows, corrected"
DIRECTION = "direction in a loop"
BEST_LOOP_EFFECT = "best of all effects on a reversible curve"
LOOP_REMAINDER = "remainder in a loop beside the true effect"
PLANTED = 0.3  # what two equally wrong models miss, in standard deviations of the noise
TRUE_FORM = next(effect for effect in LOOP_EFFECTS if effect.form == "maxwell_slip")


@dataclass(frozen=True)
class Case:
    """One kind of data under the null hypothesis.

    Attributes:
        data: in words.
        draw: random generator -> what the tests find in one data set.
    """

    data: str
    draw: Callable[[np.random.Generator], Found]


class Arm:
    """Repeated trials of an arm that is linear in its parameters.

    Args:
        repeats: trials of each input, which is fitted in one form and judged in another.
        colour: of the noise.
    """

    def __init__(self, repeats: Sequence[int], colour: str) -> None:
        self.colour = colour
        self.kinds = [
            (name, check, repeat)
            for name, many in zip(PACES, repeats, strict=False)
            for check in (False, True)
            for repeat in range(many)
        ]
        blocks = [
            ResidualBlock(
                trial=f"{name}_{check}_{repeat}",
                protocol=f"{name}_{check}",
                channel=channel,
                residual=np.zeros(COUNT),
                sample_interval=1.0 / RATE,
            )
            for name, check, repeat in self.kinds
            for channel in NOISE
        ]
        held_out = frozenset(f"{n}_{c}_{r}" for n, c, r in self.kinds if c)
        self.layout = TrialLayout(places=layout(blocks), held_out=held_out)
        self.fitted = self.layout.rows(self.layout.trials(held_out=False))
        parts = [_columns(name, check) for name, check, _ in self.kinds]
        self.gain = np.concatenate([part["gain"] for part in parts])
        self.effects = {
            name: np.concatenate([part[name] for part in parts])
            for name in parts[0]
            if name != "gain"
        }
        self.regressors = {
            f"{n}_{c}_{r}": {
                "elapsed": TIME,
                "pressure": _drive(n, c),
            }
            for n, c, r in self.kinds
        }

    def residual(self, rng: np.random.Generator) -> FloatArray:
        """What a perfect model leaves of all trials, (n,)."""
        shape = (len(self.kinds), COUNT)
        parts = [sd * _noise(rng, shape, self.colour) for sd in NOISE.values()]
        found = np.stack(parts, axis=1).ravel()
        if self.colour == "gain varies":
            own = VARIATION * rng.standard_normal(len(self.kinds))
            found += np.repeat(own, COUNT * len(NOISE)) * self.gain
        return found

    def fit(
        self, residual: FloatArray, columns: Sequence[FloatArray], floor: NoiseFloor
    ) -> SimpleNamespace:
        """Least squares over the fitted trials, as a `Refit`."""
        weights = self.layout.weights(floor.sd)[self.fitted]
        weights /= np.sqrt(len(self.layout.trials(held_out=False)) * len(NOISE))
        slope = np.stack(columns, axis=1)
        jacobian = slope[self.fitted] * weights[:, np.newaxis]
        sizes = np.linalg.lstsq(jacobian, residual[self.fitted] * weights, rcond=None)[0]
        return SimpleNamespace(
            residual=residual - slope @ sizes, jacobian=jacobian, weights=weights
        )

    def only_in(self, name: str, column: FloatArray) -> FloatArray:
        """A column without what it does to other inputs."""
        own = np.repeat([kind == name for kind, _, _ in self.kinds], COUNT * len(NOISE))
        return np.where(own, column, 0.0)


def _drive(name: str, check: bool) -> FloatArray:
    pace = PACES[name] * (1.3 if check else 1.0)
    return HEIGHTS[name] * (1.0 + 0.8 * np.sin(2.0 * np.pi * pace * TIME))


def _columns(name: str, check: bool) -> dict[str, FloatArray]:
    """What the arm's gain and some effects do to a trial, angle first."""
    drive = _drive(name, check)
    keep = np.exp(-1.0 / (RATE * 0.4))
    angle = lfilter([1.0 - keep], [1.0, -keep], drive)
    speed = np.gradient(angle, TIME)
    still = np.zeros(COUNT)
    shapes = {
        "gain": (angle, still),
        "friction": (np.tanh(speed / 0.2), still),
        "damping": (speed, still),
        "bias": (np.ones(COUNT), still),
        "drift": (TIME, still),
        "hardening": (angle**3, still),
        "leak": (angle, drive),
        "pressure_bias": (still, np.ones(COUNT)),
        "delay": (still, np.gradient(drive, TIME)),
    }
    return {effect: np.concatenate(parts) for effect, parts in shapes.items()}


def _noise(rng: np.random.Generator, shape: tuple[int, int], colour: str) -> FloatArray:
    """Noise of standard deviation 1."""
    if colour == "heavy tails":
        return rng.standard_t(3, shape) / np.sqrt(3.0)
    white = rng.standard_normal(shape)
    if colour != "drifting":
        return white
    keep = np.exp(-1.0 / (RATE * 0.3))
    white[:, 1:] *= np.sqrt(1.0 - keep**2)  # stationary from the first sample on
    return lfilter([1.0], [1.0, -keep], white, axis=1)


def trial_tests(arm: Arm, rng: np.random.Generator) -> Found:
    """Tests on recordings of an arm whose model is perfect but for its gain, or equally wrong."""
    places, protocol_of = arm.layout, arm.layout.protocol_of
    residual = arm.residual(rng)
    floor = noise_floor(places, residual)
    base = arm.fit(residual, [arm.gain], floor)

    def loss(found: FloatArray) -> dict[str, float]:
        return losses(places, found, floor, held_out=True)

    base_loss = loss(base.residual)
    friction = arm.effects["friction"] * PLANTED * NOISE["angle"]
    fast = arm.only_in("fast", friction)
    more = [
        arm.fit(residual, [arm.gain, arm.effects[e]], floor) for e in ("friction", "bias", "leak")
    ]
    seen = [compare_models(base_loss, loss(fit.residual), places) for fit in more]
    every = [*places.trials(held_out=False), *places.trials(held_out=True)]
    table = cells(places, base.residual, floor, every)
    maps = trial_maps(places, base.residual, floor, arm.regressors, seed=int(rng.integers(2**31)))
    fitter = SimpleNamespace(
        simulator=SimpleNamespace(layout=places),
        weighted=lambda found: found[arm.fitted] * base.weights,
    )
    traces = [
        SimpleNamespace(signature=SimpleNamespace(projected=column[arm.fitted] * base.weights))
        for column in arm.effects.values()
    ]
    lack = lack_of_fit(
        fitter, base, [SimpleNamespace(traces=traces)], seed=int(rng.integers(2**31))
    )
    excess = compare_trials(base_loss, perfect_losses(places, floor), protocol_of)
    variation = TrialVariation(
        changes=np.stack([arm.gain, *arm.effects.values()], axis=1), nuisance=1
    )
    left = held_out_excess(places, base.residual, floor, variation)
    named = {(cell.channel, cell.protocol): cell for cell in table}
    mapped = {(m.channel, m.quantity): m for m in maps}
    certain = table[0].p_value < GAP_P_VALUE and table[0].excess > GAP_LOSS
    return (
        {
            EQUALLY_WRONG: compare_models(
                loss(residual + friction), loss(residual - friction), places
            ).p_value,
            WRONG_IN_ONE: compare_models(
                loss(residual + fast), loss(residual - fast), places
            ).p_value,
            BEST_EFFECT: min(1.0, len(seen) * min(one.p_value for one in seen)),
            EXCESS: excess.p_value,
            LACK: lack.p_value,
            CELL: named["angle", "slow_False"].p_value,
            LARGEST_CELL: min(1.0, len(table) * min(cell.p_value for cell in table)),
            MAP: mapped["pressure_1", "pressure"].p_value,
            MAPS: min(1.0, len(maps) * maps[0].p_value),
        },
        {
            "effect claimed in recordings": any(
                one.p_value * len(seen) < SIGNIFICANCE and one.gain > LEAST_GAIN for one in seen
            ),
            "gap by held-out losses": excess.p_value < GAP_P_VALUE and excess.gain > GAP_LOSS,
            "gap by what repeats share": lack.significant and lack.size > GAP_LOSS,
            "gap by a cell and a map": certain and systematic(maps),
            "remainder by held-out losses": has_remainder(
                mean_over_trials(left, protocol_of),
                lack,
                places,
                base.residual,
                floor,
                variation,
                least=REMAINDER_LOSS,
            ),
            "remainder by lack of fit": lack.significant,
            "rival rejected": lack.p_value < RIVAL_REJECTED,
        },
    )


class Table:
    """Rows of angles at rest whose model is linear in its parameters.

    Args:
        rows: number of them.
        colour: of the errors.
    """

    def __init__(self, rows: int, colour: str) -> None:
        rng = np.random.default_rng(3)
        self.colour = colour
        self.low = np.where(np.arange(rows) % 2, rng.uniform(0.0, 4.0, rows), 0.0)
        self.step = rng.uniform(0.4, 4.5, rows)
        self.load = rng.choice([0.0, 1.2, 2.1], rows)
        self.names = tuple(map(str, range(rows)))
        self.gain = self.step
        self.effects = (self.step**3, self.step * self.low, self.load, np.ones(rows))


def row_tests(table: Table, rng: np.random.Generator) -> Found:
    """Tests on a table whose model is perfect but for its gain, or equally wrong."""
    seed = int(rng.integers(2**31))
    residual = _noise(rng, (1, table.step.size), table.colour)[0]
    columns = [np.stack([table.gain, *more], axis=1) for more in [(), *zip(table.effects)]]
    fits = [_left_out(residual, jacobian) for jacobian in columns]
    (base, base_unseen), *extended = fits
    p_values = best_of_many_p_values(
        base,
        columns[0],
        [(own, jacobian) for (own, _), jacobian in zip(extended, columns[1:], strict=True)],
        seed=seed,
    )
    unseen = [compare_rows(base_unseen, left, seed=seed).p_value for _, left in extended]
    wrong = PLANTED * np.sign(table.effects[0] - np.median(table.effects[0]))
    quantities = {"low": table.low, "step": table.step, "load": table.load}
    maps = row_maps(base, quantities, table.names, channel="angle", seed=seed)
    return (
        {
            ROWS: compare_rows(residual + wrong, residual - wrong, seed=seed).p_value,
            BEST_ROW_EFFECT: min(p_values),
            ROW_MAPS: min(1.0, len(maps) * maps[0].p_value),
        },
        {
            "effect claimed in a table": any(
                max(pair) < SIGNIFICANCE for pair in zip(p_values, unseen, strict=True)
            ),
            "gap in a table": systematic(maps),
        },
    )


def _left_out(residual: FloatArray, jacobian: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What a linear fit leaves of all rows, and of each row by the fit without it."""
    span = np.linalg.qr(jacobian)[0]
    left = residual - span @ (span.T @ residual)
    return left, left / (1.0 - np.sum(span**2, axis=1))


class Readings:
    """One loop, read at the same levels up and down.

    Args:
        levels: number of them.
        colour: of the readings' errors.
    """

    def __init__(self, levels: int, colour: str) -> None:
        self.colour = colour
        up = np.linspace(0.0, 4.0, levels)
        self.input = np.concatenate([up, up[::-1]])
        self.rising = np.repeat([True, False], levels)
        self.error = 0.05 + 0.02 * self.input
        self.opened = TRUE_FORM.signal(self.input / self.input.max(), 0.3)


def loop_tests(readings: Readings, rng: np.random.Generator) -> Found:
    """Tests on a reversible curve, and of a remainder on a loop that one effect opens."""
    noise = readings.error * _noise(rng, (1, readings.input.size), readings.colour)[0]
    curve = np.sqrt(1.0 + readings.input)
    seed = int(rng.integers(2**31))

    def fitter(output: FloatArray, effects: Sequence[LoopEffect]) -> LoopFitter:
        loop = Loop(
            input=readings.input, output=output, rising=readings.rising, error=readings.error
        )
        return LoopFitter(loop, effects, seed)

    shut = fitter(curve + noise, LOOP_EFFECTS)
    models = shut.models(shut.base())
    opened = fitter(curve + noise + readings.opened, [TRUE_FORM])
    (true,) = opened.models(opened.base())
    left = shut.remainder(true, [m for m in models if m.effect is not TRUE_FORM])
    direction = shut.direction()
    return (
        {
            DIRECTION: direction,
            BEST_LOOP_EFFECT: min(m.p_value for m in models),
            LOOP_REMAINDER: left,
        },
        {
            "effect claimed in a loop": any(m.accepted for m in models),
            "gap in a loop": direction < SIGNIFICANCE,
            "remainder in a loop": left < SIGNIFICANCE,
        },
    )


def cases() -> Iterator[Case]:
    """All kinds of data, tests on them in the order of the verdict's thresholds."""
    recorded = [((many,) * 3, c) for many in (2, 3, 4) for c in ("white", "drifting")]
    recorded += [((many,) * 3, "gain varies") for many in (2, 4)]
    recorded += [((3,) * 3, "heavy tails"), ((4,) * 5, "drifting"), ((3, 3, 1), "white")]
    for repeats, colour in recorded:
        many = " and ".join(map(str, dict.fromkeys(repeats)))
        data = f"{len(repeats)} inputs, {many} repeats, {colour}"
        yield Case(data, partial(trial_tests, Arm(repeats, colour)))
    for rows, colour in ((10, "white"), (24, "white"), (24, "heavy tails")):
        data = f"{rows} rows, {colour}"
        yield Case(data, partial(row_tests, Table(rows, colour)))
    for levels, colour in ((6, "white"), (10, "white"), (10, "drifting")):
        yield Case(f"{levels} levels, {colour}", partial(loop_tests, Readings(levels, colour)))


def drawn(case: Case, runs: int) -> tuple[dict[str, FloatArray], dict[str, int]]:
    """Test -> its p-values over some data sets, and rule -> how often it found something."""
    p_values: dict[str, list[float]] = {}
    alarms: dict[str, int] = {}
    for run in range(runs):
        found, rules = case.draw(np.random.default_rng([*case.data.encode(), run]))
        for test, p_value in found.items():
            p_values.setdefault(test, []).append(p_value)
        for rule, alarm in rules.items():
            alarms[rule] = alarms.get(rule, 0) + int(alarm)
    return {test: np.array(values) for test, values in p_values.items()}, alarms


def share(hits: int, runs: int) -> dict[str, Any]:
    """A share with its exact interval."""
    low, high = binomtest(hits, runs).proportion_ci(0.95, method="exact")
    return {"hits": hits, "share": hits / runs, "interval95": [low, high]}


def measured(p_values: FloatArray) -> dict[str, Any]:
    """How p-values of a null hypothesis are distributed."""
    below = {level: int(np.sum(p_values <= level)) for level in LEVELS}
    runs = p_values.size
    eager = [binomtest(hits, runs, level, "greater").pvalue for level, hits in below.items()]
    rare = [binomtest(below[0.05], runs, 0.05, "less").pvalue]
    rare.append(kstest(p_values, "uniform", alternative="less").pvalue)
    return {
        "runs": runs,
        "kolmogorov_smirnov_p": float(kstest(p_values, "uniform").pvalue),
        "smallest": float(p_values.min()),
        "at_or_below": {str(level): share(hits, runs) for level, hits in below.items()},
        "p_too_eager": float(min(1.0, len(eager) * min(eager))),
        "p_conservative": float(min(1.0, len(rare) * min(rare))),
    }


def judged(row: Mapping[str, Any], comparisons: int) -> str:
    """Whether small p-values are as frequent as they should be, corrected for all comparisons."""
    if row["p_too_eager"] * comparisons < SIGNIFICANCE:
        return "too eager"
    return "conservative" if row["p_conservative"] * comparisons < SIGNIFICANCE else "calibrated"


def rendered(record: Mapping[str, Any]) -> list[str]:
    """The tables of docs/diagnose.md: of every test and every rule, the range over its data."""
    tests: dict[str, list[Mapping[str, Any]]] = {}
    for row in record["tests"]:
        tests.setdefault(_label(row["test"], row["data"]), []).append(row)
    lines = ["| nothing to find: p-value of | p <= 0.05 | p <= 0.01 | p <= 0.001 | found to be |"]
    lines.append("|---|---|---|---|---|")
    for label, rows in tests.items():
        shares = [_range([r["at_or_below"][str(level)] for r in rows]) for level in LEVELS[::-1]]
        counts = Counter(row["verdict"] for row in rows)
        found = ", ".join(f"{verdict} {counts[verdict]}" for verdict in sorted(counts))
        lines.append(f"| {label} | {' | '.join(shares)} | {found} |")
    rules: dict[str, list[Mapping[str, Any]]] = {}
    for row in record["rules"]:
        rules.setdefault(_label(row["rule"], row["data"]), []).append(row)
    lines += ["", "| nothing to find: verdict's rule | false alarms | most in one kind of data |"]
    lines.append("|---|---|---|")
    for label, rows in rules.items():
        most = max(rows, key=lambda row: row["hits"])
        low, high = (100.0 * end for end in most["interval95"])
        total = f"{sum(row['hits'] for row in rows)} of {sum(row['runs'] for row in rows)}"
        lines.append(f"| {label} | {total} | {100 * most['share']:.1f} [{low:.1f}, {high:.1f}] % |")
    return lines


def _label(name: str, data: str) -> str:
    """A name in a table: readings of one loop that drift are a case apart."""
    return f"{name}; readings drift" if "levels" in data and "drifting" in data else name


def _range(shares: Sequence[Mapping[str, Any]]) -> str:
    low, high = (100.0 * end(one["share"] for one in shares) for end in (min, max))
    return f"{low:.1f} %" if len(shares) == 1 else f"{low:.1f} to {high:.1f} %"


def main() -> None:
    """Draw, judge and print the tables; write the record where it is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    began = time.process_time()
    rows: list[dict[str, Any]] = []
    rules: list[dict[str, Any]] = []
    for case in cases():
        p_values, alarms = drawn(case, options.runs)
        rows += [{"test": t, "data": case.data, **measured(p)} for t, p in p_values.items()]
        rules += [
            {"rule": rule, "data": case.data, "runs": options.runs, **share(hits, options.runs)}
            for rule, hits in alarms.items()
        ]
        print(f"{case.data}: {time.process_time() - began:.0f} s", file=sys.stderr)
    for row in rows:
        row["verdict"] = judged(row, len(rows))
    record = {
        "command": COMMAND,
        "pamsim": pamsim.__version__,
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "python": platform.python_version(),
        "cpu_seconds": round(time.process_time() - began),
        "tests": rows,
        "rules": rules,
    }
    print("\n".join(rendered(record)))
    if options.json:
        options.json.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
