"""Where there is nothing to find, small p-values are no more frequent than their values."""

from __future__ import annotations

import json
import runpy
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, ttest_1samp

from pamsim.comparison.noise_floor import noise_floor
from pamsim.comparison.trial_regressors import regressors
from pamsim.diagnosis.method.evidence import compare_trials
from pamsim.diagnosis.method.where import trial_maps
from pamsim.recordings.trial import Trial

ROOT = Path(__file__).parents[3]
SCRIPT = runpy.run_path(str(ROOT / "scripts/null_calibration.py"), run_name="null_calibration")
RECORD = json.loads((ROOT / "scripts/results/null_calibration.json").read_text(encoding="utf-8"))
DRAWS = 60
MOST = int(binom.ppf(0.9999, DRAWS, 0.05))  # p-values below 0.05, of so many draws


def test_the_tables_of_the_document_are_those_of_the_record():
    text = (ROOT / "docs/diagnose.md").read_text(encoding="utf-8")
    assert "\n".join(SCRIPT["rendered"](RECORD)) in text
    drifting = [
        row
        for row in RECORD["tests"]
        if (row["test"], row["data"][-8:]) == ("lack of fit", "drifting")
        and "2 repeats" not in row["data"]
    ]
    hits = sum(row["at_or_below"]["0.05"]["hits"] for row in drifting)
    runs = sum(row["runs"] for row in drifting)
    assert f"p <= 0.05 came up in {hits} of {runs} data sets, not in {runs // 20}." in text


def test_the_record_is_judged_as_it_says():
    rows = RECORD["tests"]
    assert all(row["verdict"] == SCRIPT["judged"](row, len(rows)) for row in rows)
    assert {row["runs"] for row in rows} == {500}
    assert len({(row["test"], row["data"]) for row in rows}) == len(rows)
    assert {case.data for case in SCRIPT["cases"]()} == {row["data"] for row in rows}
    # Readings of a single loop that drift do depend on the direction.
    eager = {row["data"] for row in rows if row["verdict"] == "too eager"}
    assert eager == {"10 levels, drifting"}


@pytest.mark.parametrize(
    "kind", ["3 inputs, 3 repeats, drifting", "10 rows, white", "6 levels, white"]
)
def test_false_alarms_are_no_more_than_promised(kind):
    case = next(case for case in SCRIPT["cases"]() if case.data == kind)
    p_values, _ = SCRIPT["drawn"](case, DRAWS)
    assert len(p_values) >= 3
    for test, values in p_values.items():
        assert np.sum(values <= 0.05) <= MOST, test


def arm_and_residuals():
    arm = SCRIPT["Arm"]((3, 3, 3), "drifting")
    return arm, [arm.residual(np.random.default_rng([4, k])) for k in range(DRAWS)]


def test_a_test_that_counts_samples_as_units_is_found_out():
    arm, residuals = arm_and_residuals()
    shape = 0.3 * SCRIPT["NOISE"]["angle"] * arm.effects["friction"]
    hits = 0
    for residual in residuals:
        gain = (residual + shape) ** 2 - (residual - shape) ** 2
        hits += ttest_1samp(gain[shape != 0.0], 0.0, alternative="greater").pvalue <= 0.05
    assert hits > MOST


def test_a_map_over_the_measured_signal_shows_its_own_noise():
    arm, residuals = arm_and_residuals()
    hits = Counter()
    for residual in residuals:
        floor = noise_floor(arm.layout, residual)
        for kind, noise in (("measured", -residual), ("simulated", 0.0 * residual)):
            over = {
                p.block.trial: {
                    "pressure": arm.regressors[p.block.trial]["pressure"] + noise[p.rows]
                }
                for p in arm.layout.places
                if p.block.channel == "pressure_1"
            }
            maps = trial_maps(arm.layout, residual, floor, over)
            hits[kind] += next(m for m in maps if m.channel == "pressure_1").p_value <= 0.05
    assert hits["simulated"] <= MOST < hits["measured"]


def test_quantities_of_a_map_do_not_depend_on_what_was_measured():
    time = np.linspace(0.0, 2.0, 100)
    clean = {"angle": np.sin(3.0 * time), "pressure_1": 2.0 + time, "pressure_2": 3.0 - time}
    command = np.sin(time)[:, np.newaxis] * np.array([1.0, -1.0])

    def quantities(noise):
        rng = np.random.default_rng(1)
        measured = {c: y + noise * rng.standard_normal(100) for c, y in clean.items()}
        trial = Trial(
            name="t", protocol="p", drive="pressure_set", load=0.0, time=time, command=command,
            measured=measured,
        )  # fmt: skip
        return regressors(trial, clean)

    calm, noisy = quantities(0.0), quantities(0.5)
    assert {"angle", "speed", "common_pressure", "since_reversal"} <= set(calm)
    for name, values in calm.items():
        assert np.array_equal(values, noisy[name]), name


@pytest.mark.parametrize(
    ("counts", "spreads"), [((4, 4, 4), (1.0, 0.01, 0.01)), ((4, 4, 1), (1.0, 1.0, 1.0))]
)
def test_protocols_that_scatter_differently_or_once_promise_no_more(counts, spreads):
    """Degrees of freedom of all protocols, or no scatter of the single trial: twice as many."""
    rng = np.random.default_rng(8)
    names = [(f"{p}_{k}", str(p), spreads[p]) for p, n in enumerate(counts) for k in range(n)]
    protocol_of = {name: protocol for name, protocol, _ in names}
    level, draws, hits = 0.01, 2_000, 0
    for _ in range(draws):
        after = {name: spread * rng.standard_normal() for name, _, spread in names}
        hits += compare_trials(dict.fromkeys(after, 0.0), after, protocol_of).p_value <= level
    assert hits <= binom.ppf(0.999, draws, level)
