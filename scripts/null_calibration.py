"""Whether the p-values on which a diagnosis rests hold where there is nothing to find.

    python scripts/null_calibration.py [--json scripts/results/null_calibration.json]

Every test that decides something in trials, in tables at rest and in loops gets 500 data sets of
its own null hypothesis. Its p-values should then be uniform: one in twenty below 0.05. Shares come
with exact 95 % intervals (Clopper and Pearson, Biometrika 26, 1934), the whole distribution with
the Kolmogorov-Smirnov test. A test is too eager if p-values below one of the levels are more
frequent than the level, conservative if they are rarer, below 0.05 or anywhere; either is only said
if it stays significant (5 %) after Bonferroni's correction for all cases here. It takes about a
minute.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from records import parser, share, write
from scipy.signal import lfilter
from scipy.stats import binomtest, kstest

from pamsim.comparison.links import PARTS, Link
from pamsim.core.computation import versions
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.held_out import remainders
from pamsim.diagnosis.by_link.limits import ALPHA
from pamsim.inference.model_comparison import compare_paired
from pamsim.inference.row_tests import (
    UnseenRows,
    best_of_many_p_values,
    missed_together,
    nearest_units,
)

Found = tuple[dict[str, float], dict[str, bool]]
"""Of one data set: test -> its p-value, and rule -> whether it found something."""

Draw = Callable[[np.random.Generator], Found]

COMMAND = "python scripts/null_calibration.py --json scripts/results/null_calibration.json"
INPUTS, SAMPLES = 4, 400  # of recordings: their inputs, and samples of a trial
LEVELS = (0.001, 0.01, 0.05)

KEPT = 0.88  # of drifting noise from one reading to the next
ROWS = "two equally wrong models"
BEST_ROW_EFFECT = "best of four absent effects"
SCORES = "an absent effect, by flips of the rows' scores"
ADDS = "what another effect adds to the true one"
NEAR = "error common to neighbouring rows"
NEAR_LEVELS = "error common to neighbouring levels of a loop"
TRIALS = "two equally wrong models, in held-out trials"
SHARED = "error common to repeats, in either of two links"
PLANTED = 0.3  # what two equally wrong models miss, in standard deviations of the noise
TRUE_SIZE = 2.0  # of the true effect, in standard deviations of the noise


def _noise(rng: np.random.Generator, shape: tuple[int, int], colour: str) -> FloatArray:
    """Noise of standard deviation 1."""
    if colour == "heavy tails":
        return rng.standard_t(3, shape) / np.sqrt(3.0)
    white = rng.standard_normal(shape)
    if colour != "drifting":
        return white
    white[:, 1:] *= np.sqrt(1.0 - KEPT**2)  # stationary from the first sample on
    return lfilter([1.0], [1.0, -KEPT], white, axis=1)


def row_tests(count: int, colour: str, rng: np.random.Generator) -> Found:
    """Tests on angles at rest whose linear model is perfect but for its gain, or equally wrong."""
    fixed = np.random.default_rng(3)
    low = np.where(np.arange(count) % 2, fixed.uniform(0.0, 4.0, count), 0.0)
    step = fixed.uniform(0.4, 4.5, count)
    load = fixed.choice([0.0, 1.2, 2.1], count)
    effects = (step**3, step * low, load, np.ones(count))
    seed = int(rng.integers(2**31))
    residual = _noise(rng, (1, count), colour)[0]
    columns = [np.stack([step, *more], axis=1) for more in [(), *zip(effects)]]
    base, *extended = [_left(residual, jacobian) for jacobian in columns]
    p_values = best_of_many_p_values(
        base, columns[0], list(zip(extended, columns[1:], strict=True)), seed=seed
    )
    beside = UnseenRows(base, columns[0])
    found = [beside.effect(-own) for own in effects]
    scores = [one.p_value(seed) for one in found]
    unseen = [compare_paired(beside.losses - one.losses, seed=seed)[1] for one in found]
    wrong = PLANTED * np.sign(effects[0] - np.median(effects[0]))
    _, equally = compare_paired((residual + wrong) ** 2 - (residual - wrong) ** 2, seed=seed)
    true = residual - TRUE_SIZE * effects[0] / float(np.std(effects[0]))
    both = np.column_stack([columns[1], effects[1]])
    adds = best_of_many_p_values(
        _left(true, columns[1]), columns[1], [(_left(true, both), both)], seed=seed
    )
    near = nearest_units(np.stack([low, step, load], axis=1))
    _, left = missed_together(base, columns[0], near, seed=seed)
    return (
        {
            ROWS: equally,
            BEST_ROW_EFFECT: min(p_values),
            SCORES: scores[0],
            ADDS: adds[0],
            NEAR: left,
        },
        {
            "effect claimed in rows": any(
                max(chance, score, by_losses) <= ALPHA
                for chance, score, by_losses in zip(p_values, scores, unseen, strict=True)
            ),
            "remainder in rows": left <= ALPHA,
        },
    )


def _left(residual: FloatArray, jacobian: FloatArray) -> FloatArray:
    """What a linear fit leaves of all rows."""
    span = np.linalg.qr(jacobian)[0]
    return residual - span @ (span.T @ residual)


def trial_tests(repeats: int, kind: str, rng: np.random.Generator) -> Found:
    """Tests on held-out trials whose model is perfect, or beside one that is as wrong.

    Trials are of some inputs, each repeated, and of two links of one channel each; ``kind`` is what
    repeats differ by.
    """
    seed = int(rng.integers(2**31))
    time = np.linspace(0.0, 1.0, SAMPLES)
    signal = np.stack([np.sin(2.0 * np.pi * (k + 1) * time) for k in range(INPUTS)])
    noise = [_trial_noise(rng, repeats, kind, signal) for _ in range(2)]
    wrong = PLANTED * signal[:, np.newaxis]
    losses = [np.mean((noise[0] + sign * wrong) ** 2, axis=-1).ravel() for sign in (1.0, -1.0)]
    _, equally = compare_paired(losses[0] - losses[1], seed=seed)
    links = [Link(PARTS[:1]), Link(PARTS[1:])]
    rows = {
        link: [
            {f"{k} {j}": trial for j, trial in enumerate(repeats)} for k, repeats in enumerate(own)
        ]
        for link, own in zip(links, noise, strict=True)
    }
    each = {link: np.mean(own**2, axis=-1).ravel() for link, own in zip(links, noise, strict=True)}
    left = remainders(rows, each, seed=seed).values()
    return (
        {TRIALS: equally, SHARED: min(1.0, *(one.p_value for one in left))},
        {"remainder in trials": any(one.counts for one in left)},
    )


def _trial_noise(
    rng: np.random.Generator, repeats: int, kind: str, signal: FloatArray
) -> FloatArray:
    """What trials (inputs, repeats, samples) of one link differ by; white it is 1."""
    shape = (INPUTS, repeats, SAMPLES)
    if kind != "trials that vary as a whole":
        return _noise(rng, (INPUTS * repeats, SAMPLES), kind).reshape(shape)
    size = rng.standard_normal((INPUTS, repeats, 1))
    return rng.standard_normal(shape) + size * signal[:, np.newaxis]


def loop_tests(levels: int, colour: str, rng: np.random.Generator) -> Found:
    """The test for a loop, read up and down, where there is none: near levels open by the same."""
    level = np.linspace(0.0, 4.0, levels)
    error = 0.05 + 0.02 * np.concatenate([level, level[::-1]])
    noise = error * _noise(rng, (1, error.size), colour)[0]
    opened = noise[:levels] - noise[levels:][::-1]
    near = nearest_units(level[:, np.newaxis])
    rows, none = opened / error[:levels], np.empty((levels, 0))
    _, left = missed_together(rows, none, near, seed=int(rng.integers(2**31)))
    return {NEAR_LEVELS: left}, {"remainder in a loop": left <= ALPHA}


def cases() -> Iterator[tuple[str, Draw]]:
    """All kinds of data, in words, and what draws one data set of it and tests it."""
    for repeats in (3, 5):
        for kind in ("white", "drifting", "trials that vary as a whole"):
            data = f"{INPUTS} inputs of {repeats} repeats, {kind}"
            yield data, partial(trial_tests, repeats, kind)
    for rows, colour in ((10, "white"), (24, "white"), (24, "heavy tails")):
        yield f"{rows} rows, {colour}", partial(row_tests, rows, colour)
    for levels, colour in ((6, "white"), (10, "white"), (10, "drifting")):
        yield f"{levels} levels, {colour}", partial(loop_tests, levels, colour)


def drawn(data: str, draw: Draw, runs: int) -> tuple[dict[str, FloatArray], dict[str, int]]:
    """Test -> its p-values over some data sets, and rule -> how often it found something."""
    p_values: dict[str, list[float]] = {}
    alarms: dict[str, int] = {}
    for run in range(runs):
        found, rules = draw(np.random.default_rng([*data.encode(), run]))
        for test, p_value in found.items():
            p_values.setdefault(test, []).append(p_value)
        for rule, alarm in rules.items():
            alarms[rule] = alarms.get(rule, 0) + int(alarm)
    return {test: np.array(values) for test, values in p_values.items()}, alarms


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
    if row["p_too_eager"] * comparisons < ALPHA:
        return "too eager"
    return "conservative" if row["p_conservative"] * comparisons < ALPHA else "calibrated"


def rendered(record: Mapping[str, Any]) -> list[str]:
    """The tables of docs/validation.md: of every test and every rule, the range over its data."""
    lines = ["| nothing to find: p-value of | p <= 0.05 | p <= 0.01 | p <= 0.001 | found to be |"]
    lines.append("|---|---|---|---|---|")
    for label, rows in _by_label(record["tests"], "test").items():
        shares = [_range([r["at_or_below"][str(level)] for r in rows]) for level in LEVELS[::-1]]
        counts = Counter(row["verdict"] for row in rows)
        found = ", ".join(f"{verdict} {counts[verdict]}" for verdict in sorted(counts))
        lines.append(f"| {label} | {' | '.join(shares)} | {found} |")
    lines += ["", "| nothing to find: rule | false alarms | most in one kind of data |"]
    lines.append("|---|---|---|")
    for label, rows in _by_label(record["rules"], "rule").items():
        most = max(rows, key=lambda row: row["hits"])
        low, high = (100.0 * end for end in most["interval95"])
        total = f"{sum(row['hits'] for row in rows)} of {sum(row['runs'] for row in rows)}"
        lines.append(f"| {label} | {total} | {100 * most['share']:.1f} [{low:.1f}, {high:.1f}] % |")
    return lines


def _by_label(
    rows: Sequence[Mapping[str, Any]], name: str
) -> Mapping[str, list[Mapping[str, Any]]]:
    """Rows by their name in a table: readings of one loop that drift are a case apart."""
    found: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        apart = "levels" in row["data"] and "drifting" in row["data"]
        found.setdefault(row[name] + "; readings drift" * apart, []).append(row)
    return found


def _range(shares: Sequence[Mapping[str, Any]]) -> str:
    low, high = (100.0 * end(one["share"] for one in shares) for end in (min, max))
    return f"{low:.1f} %" if len(shares) == 1 else f"{low:.1f} to {high:.1f} %"


def main() -> None:
    """Draw, judge and print the tables; write the record where it is asked for."""
    options = parser(__doc__, runs=500).parse_args()
    began = time.process_time()
    rows: list[dict[str, Any]] = []
    rules: list[dict[str, Any]] = []
    for data, draw in cases():
        p_values, alarms = drawn(data, draw, options.runs)
        rows += [{"test": t, "data": data, **measured(p)} for t, p in p_values.items()]
        rules += [
            {"rule": rule, "data": data, "runs": options.runs, **share(hits, options.runs)}
            for rule, hits in alarms.items()
        ]
        print(f"{data}: {time.process_time() - began:.0f} s", file=sys.stderr)
    for row in rows:
        row["verdict"] = judged(row, len(rows))
    record = {
        "command": COMMAND,
        **versions("scipy"),
        "cpu_seconds": round(time.process_time() - began),
        "tests": rows,
        "rules": rules,
    }
    print("\n".join(rendered(record)))
    write(record, options.json)


if __name__ == "__main__":
    main()
