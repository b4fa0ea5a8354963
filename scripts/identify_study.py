r"""Errors, coverage and false alarms of identify on a known G2, and of public peers.

    python scripts/identify_study.py [--workers 2] [--json scripts/results/identify_study.json]

Plant: K = 1, T1 = 0.0926 s, T2 = 0.57873 s (the slow constant of Matiskova 2021's G2; T1/T2 =
0.16), sampled at 100 Hz for 20 s. Input: rest for 0.5 s, a step held for 2.5 s, then random levels
-1 and 1 held for 0.2 s each. Noise is white, or AR(1) with a correlation time of 0.1 or 0.3 s, or
grows towards frequency 0: its spectrum as f^-0.6, 1/f or f^-1.4 from a period of 328 s on. dB is
the variance of the clean output over that of the noise. 200 seeds each. Finished runs are in
out/identify_study, so that a stopped study goes on where it was.

Public peers need an environment of their own, since pamsim does not depend on them:

    python scripts/identify_study.py --write-records out/identify_peers.npz
    OMP_NUM_THREADS=1 <venv with sippy-unipi>/bin/python scripts/identify_peers.py \
        out/identify_peers.npz

which writes scripts/results/identify_peers.json; the next run of the study puts it in the table.
python-control has no estimator for records with an offset and a noise model, only impulse-response
and realisation methods; scipy stands for the plain baseline (curve_fit, one start, white noise).
"""

from __future__ import annotations

import hashlib
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from records import RESULTS, fingerprint, kept_rows, noise, parser, read, write, write_arrays
from scipy.optimize import curve_fit
from scipy.signal import cont2discrete, lfilter, ss2tf, tf2ss

from pamsim.core.computation import versions
from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.records import SignalRecord
from pamsim.identification.residual_tests import residual_independence

KEPT = Path("out/identify_study")
RUNS, PEER_RUNS = 200, 25
INTERVAL, SAMPLES = 0.01, 2000
GAIN, FAST, SLOW, DELAY = 1.0, 0.0926, 0.57873, 0.0437
OFFSET = 0.3

SCENARIOS: dict[str, dict[str, float]] = {
    "40 dB white": {"decibel": 40.0, "correlation_s": 0.0, "delay_s": DELAY},
    "20 dB white": {"decibel": 20.0, "correlation_s": 0.0, "delay_s": DELAY},
    "20 dB coloured 0.1 s": {"decibel": 20.0, "correlation_s": 0.1, "delay_s": DELAY},
    "20 dB coloured 0.3 s": {"decibel": 20.0, "correlation_s": 0.3, "delay_s": DELAY},
    "20 dB f^-0.6": {"decibel": 20.0, "exponent": 0.6, "delay_s": DELAY},
    "20 dB 1/f": {"decibel": 20.0, "exponent": 1.0, "delay_s": DELAY},
    "20 dB f^-1.4": {"decibel": 20.0, "exponent": 1.4, "delay_s": DELAY},
}
PEER_SCENARIOS: dict[str, dict[str, float]] = {
    name: {**options, "delay_s": 0.0}
    for name, options in SCENARIOS.items()
    if "correlation_s" in options and name != "20 dB coloured 0.1 s"
}


def clean_output(given: FloatArray, delay: float, fast: float, slow: float) -> FloatArray:
    """The plant's output by scipy alone, the delay on a grid of a twentieth of a millisecond."""
    fine = 200 if delay else 1
    step = INTERVAL / fine
    system = tf2ss([GAIN], np.convolve([fast, 1.0], [slow, 1.0]))
    discrete = cont2discrete(system, step, method="zoh")
    above, below = ss2tf(*discrete[:4])
    held = np.concatenate([np.zeros(round(delay / step)), np.repeat(given, fine)])
    return np.asarray(lfilter(above[0], below, held[: given.size * fine])[::fine])


def growing(rng: np.random.Generator, exponent: float) -> FloatArray:
    """Noise of standard deviation 1 whose spectrum is ``f^-exponent``: a part of a long period."""
    period = 1 << 15
    frequency = np.fft.rfftfreq(period)[1:]
    waves = rng.standard_normal((2, frequency.size)) * frequency ** (-0.5 * exponent)
    whole = np.fft.irfft(np.append(0.0, waves[0] + 1j * waves[1]), period)
    first = rng.integers(period - SAMPLES)
    return whole[first : first + SAMPLES] / np.std(whole)


def planted(
    seed: int,
    *,
    decibel: float,
    delay_s: float,
    correlation_s: float = 0.0,
    exponent: float | None = None,
) -> SignalRecord:
    """One record of the plant."""
    rng = np.random.default_rng([seed, 7])
    levels = np.repeat(rng.choice([-1.0, 1.0], SAMPLES // 20 + 1), 20)
    u = np.concatenate([np.zeros(50), np.ones(250), levels])[:SAMPLES]
    y = clean_output(u, delay_s, FAST, SLOW)
    if exponent is None:
        errors = noise(rng, (SAMPLES,), correlation_s / INTERVAL, 1000)
    else:
        errors = growing(rng, exponent)
    y = y + OFFSET + np.std(y) * 10.0 ** (-decibel / 20.0) * errors
    return SignalRecord(f"{seed}", INTERVAL * np.arange(SAMPLES), u, y)


def fitted(name: str, seed: int) -> dict[str, Any]:
    """Fit one record of a scenario with the right structure and with two that lack something."""
    record = planted(seed, **SCENARIOS[name])
    began = time.perf_counter()
    fit = fit_model([record], ContinuousStructure(order=2, dead_time=True))
    seconds = time.perf_counter() - began
    row: dict[str, Any] = {
        "seconds": seconds,
        "status": fit.status.value,
        "p_right": residual_independence(fit, [record]).p_value,
        "parameters": {e.name: [e.value, *(e.interval95 or (None, None))] for e in fit.estimates},
    }
    if seed < PEER_RUNS:
        without = fit_model([record], ContinuousStructure(order=2))
        row["p_without_dead_time"] = residual_independence(without, [record]).p_value
        shorter = fit_model([record], ContinuousStructure(order=1, dead_time=True))
        row["p_one_lag"] = residual_independence(shorter, [record]).p_value
    return row


def scipy_baseline(record: SignalRecord) -> dict[str, float]:
    """Plain curve_fit of K, T1, T2 and the offset from one usual start."""

    def model(u: FloatArray, gain: float, log_fast: float, log_slow: float, offset: float) -> Any:
        return gain * clean_output(u, 0.0, np.exp(log_fast), np.exp(log_slow)) + offset

    y = record.output
    start = [float(np.ptp(y)) / 2.0, np.log(0.05), np.log(0.5), float(y[0])]
    best, covariance = curve_fit(model, record.input, y, p0=start)
    # Two-sided 95 % of the normal distribution: 1996 degrees of freedom.
    low, high = (np.exp(best + side * 1.96 * np.sqrt(np.diag(covariance))) for side in (-1, 1))
    order = 1 if best[1] <= best[2] else -1
    fast, slow = (1, 2)[::order]
    return {
        "T1": float(np.exp(best[fast])),
        "T2": float(np.exp(best[slow])),
        "covers_T1": float(low[fast] < FAST < high[fast]),
        "covers_T2": float(low[slow] < SLOW < high[slow]),
    }


def compared(name: str, seed: int) -> dict[str, Any]:
    """Time and error of pamsim's estimators and scipy's on one record without dead time."""
    record = planted(seed, **PEER_SCENARIOS[name])

    def continuous() -> dict[str, float]:
        fit = fit_model([record], ContinuousStructure(order=2))
        sides = fit.interval95_time_constants
        covers = {
            f"covers_T{k + 1}": float(side is not None and side[0] < truth < side[1])
            for k, (side, truth) in enumerate(zip(sides, (FAST, SLOW), strict=True))
        }
        return {"T1": fit.time_constants[0], "T2": fit.time_constants[1], **covers}

    def discrete(kind: str) -> dict[str, float]:
        fit = fit_model([record], DiscreteStructure(kind, 2, 2, 1, record.sample_time))
        return {e.name: e.value for e in fit.estimates if e.name in ("T1", "T2")}

    methods: dict[str, Callable[[], dict[str, float]]] = {
        "pamsim continuous": continuous,
        "pamsim OE": lambda: discrete("oe"),
        "pamsim ARX": lambda: discrete("arx"),
        "scipy curve_fit": lambda: scipy_baseline(record),
    }
    rows: dict[str, Any] = {}
    for method, run in methods.items():
        began = time.perf_counter()
        estimates = run()
        rows[method] = {**estimates, "seconds": time.perf_counter() - began}
    return rows


def run_one(kind: str, name: str, seed: int) -> dict[str, Any]:
    """Run one task of either kind, in a worker."""
    return (fitted if kind == "fit" else compared)(name, seed)


def summary(name: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Errors, coverage and alarm rates of one scenario."""
    truth = {"K": GAIN, "T1": FAST, "T2": SLOW, "L": SCENARIOS[name]["delay_s"]}
    parameters: dict[str, Any] = {}
    for parameter, true in truth.items():
        values = np.array([row["parameters"][parameter] for row in rows], dtype=float)
        errors = np.abs(values[:, 0] - true)
        covered = (values[:, 1] <= true) & (true <= values[:, 2])
        parameters[parameter] = {
            "truth": true,
            "median_error_percent": 100.0 * float(np.median(errors)) / true,
            "percentile95_error_percent": 100.0 * float(np.percentile(errors, 95.0)) / true,
            "bias_percent": 100.0 * float(np.mean(values[:, 0]) - true) / true,
            "coverage_percent": 100.0 * float(np.mean(covered)),
            "mean_half_width_over_1.96_scatter": float(
                np.mean(values[:, 2] - values[:, 1]) / 2.0 / 1.96 / np.std(values[:, 0])
            ),
        }
    delays = np.array([row["parameters"]["L"][0] for row in rows])
    statuses = Counter(row["status"] for row in rows)
    return {
        **SCENARIOS[name],
        "runs": len(rows),
        "parameters": parameters,
        "dead_time_within_one_sample_percent": 100.0
        * float(np.mean(np.abs(delays - truth["L"]) < INTERVAL)),
        "statuses": dict(sorted(statuses.items())),
        "median_seconds_per_fit": float(np.median([row["seconds"] for row in rows])),
        "independence_false_alarm_percent_at_5": 100.0
        * float(np.mean([row["p_right"] < 0.05 for row in rows])),
        "independence_power_percent": {
            lack: 100.0 * float(np.mean([row[lack] < 0.05 for row in rows if lack in row]))
            for lack in ("p_without_dead_time", "p_one_lag")
        },
    }


def side_by_side(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Median errors, failures and times of each method over the same records."""
    table: dict[str, Any] = {}
    for method in rows[0]:
        estimates = [row[method] for row in rows]
        good = [f for f in estimates if f.get("T1") is not None and f.get("T2") is not None]
        entry: dict[str, Any] = {
            "records": len(estimates),
            "records_without_two_lags": len(estimates) - len(good),
            "median_seconds": float(np.median([f["seconds"] for f in estimates])),
        }
        for key, true in (("T1", FAST), ("T2", SLOW)):
            errors = [100.0 * abs(f[key] / true - 1.0) for f in good]
            entry[f"median_error_{key}_percent"] = float(np.median(errors)) if good else None
            if good and f"covers_{key}" in good[0]:
                rate = float(np.mean([f[f"covers_{key}"] for f in good]))
                entry[f"coverage_{key}_percent"] = 100.0 * rate
        table[method] = entry
    return table


def peer_tables() -> dict[str, Any] | None:
    """Read what identify_peers.py wrote, if it was run.

    Raises:
        SystemExit: if it was run on other records.
    """
    page = read(RESULTS / "identify_peers.json")
    if not page:
        return None
    if page["records_sha256"] != records_digest():
        raise SystemExit("identify_peers.json is of other records: run the peers again, see --help")
    tables = {name: side_by_side(rows) for name, rows in page["scenarios"].items()}
    return {"versions": page["versions"], "command": page["command"], "scenarios": tables}


def peer_records() -> dict[str, FloatArray]:
    """Inputs and outputs of the records that peers are given."""
    arrays: dict[str, FloatArray] = {}
    for name, options in PEER_SCENARIOS.items():
        records = [planted(seed, **options) for seed in range(PEER_RUNS)]
        arrays[f"{name}|u"] = np.stack([record.input for record in records])
        arrays[f"{name}|y"] = np.stack([record.output for record in records])
    return arrays


def records_digest() -> str:
    """Fingerprint of the peers' records, rounded so that it does not hang on the last bit."""
    text = b"".join(np.round(v, 9).tobytes() + k.encode() for k, v in peer_records().items())
    return hashlib.sha256(text).hexdigest()


def main() -> None:
    """Run what is not yet there and summarise all, or write the records that peers are given."""
    arguments = parser(__doc__, RESULTS / "identify_study.json", workers=2)
    arguments.add_argument("--write-records", type=Path, metavar="FILE")
    options = arguments.parse_args()
    if options.write_records:
        write_arrays(options.write_records, peer_records(), records_digest())
        return
    peers = peer_tables()
    mark = fingerprint("pamsim.identification.", __file__)
    tasks = [("fit", name, seed) for name in SCENARIOS for seed in range(RUNS)]
    tasks += [("compare", name, seed) for name in PEER_SCENARIOS for seed in range(PEER_RUNS)]
    rows = kept_rows(run_one, tasks, KEPT, mark, options.workers)
    result = {
        "command": "python scripts/identify_study.py",
        "versions": versions("scipy"),
        "plant": {"K": GAIN, "T1_s": FAST, "T2_s": SLOW, "L_s": DELAY},
        "record": {"sample_time_s": INTERVAL, "samples": SAMPLES, "input": "step, then PRBS"},
        "recovery": {
            name: summary(name, [rows["fit", name, seed] for seed in range(RUNS)])
            for name in SCENARIOS
        },
        "side_by_side_without_dead_time": {
            name: side_by_side([rows["compare", name, seed] for seed in range(PEER_RUNS)])
            for name in PEER_SCENARIOS
        },
        "peers_on_the_same_records": peers,
    }
    write(result, options.json)


if __name__ == "__main__":
    main()
