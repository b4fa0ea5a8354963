"""Diagnoses of real data: the printed MAS-20 angles at rest, and the loop of Alraouf 2025.

The base of the first is the published force map in a plain balance; it is diagnosed with the
wheel's radius, which is not printed, refitted with every effect, and without. Twins of the same
rows tell how far such a verdict can be trusted: effects hidden in simulated rows, nothing hidden,
and a hidden effect that the library lacks. The base of the second is the best reversible curve.

    python scripts/real_data_diagnoses.py [--only rest|twins|loop] [--seeds 1] [--workers 2]

Rows of twins that are kept in out/ are not run again. A diagnosis of the rows takes one to two
minutes of one processor, and so does each twin; the loops take seconds, their runs a minute.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib.metadata
import json
import platform
import time
from pathlib import Path
from typing import Any

import numpy as np
from kept_rows import Task, fingerprint, kept_rows

from pamsim.comparison.rest_prediction import RestPredictor
from pamsim.core.units import DEG_PER_RAD
from pamsim.diagnosis.diagnose_loop import (
    ALRAOUF_2025_FORMS,
    alraouf2025_loop,
    diagnose_length_loop,
)
from pamsim.diagnosis.diagnose_rest import ORDINARY, RestReport, diagnose_rest
from pamsim.diagnosis.method.loop_diagnosis import diagnose_loop
from pamsim.diagnosis.method.loop_effects import CANDIDATES
from pamsim.diagnosis.method.loop_model import Loop
from pamsim.effects.catalog import EFFECTS
from pamsim.papers.published_rig import published_rig
from pamsim.store.json_file import write_json
from pamsim.store.static_table import read_static_table

RESULTS = Path(__file__).parent / "results" / "real_data_diagnoses.json"
KEPT = Path("out") / "real_data_twins.jsonl"
SCHEMA = "pamsim-real-data/1"

NOISE_DEG = 0.5
"""Of the twins' rows: about what the best models leave of the real ones."""

LOCKS = {"passive.locking": 35.0, "passive.stiffness": 500.0}
TWINS: dict[str, tuple[dict[str, float], str]] = {
    "nothing": ({}, ""),
    "braid_locking": (LOCKS, ""),
    "stretch_weakening": ({"force.a": -4e-4}, ""),
    "load_torque": ({"body.rig.tilt": -0.1}, ""),
    "rest_length": ({"mounting.length_at_zero": 0.2465}, ""),
    "braid_locking, not in the library": (LOCKS, "braid_locking"),
}
"""Name -> parameters hidden in simulated rows [SI], and what is taken out of the library."""

RUNS = (3, 6, 12, 24, 48)
DRAWS = 60


def rest() -> dict[str, Any]:
    """The printed rows, with the wheel's radius refitted and with nothing refitted."""
    table = read_static_table("mas20")
    found: dict[str, Any] = {}
    for name, ordinary in (("wheel radius refitted", ORDINARY), ("nothing refitted", ())):
        cpu = time.process_time()
        report = diagnose_rest(table, published_rig(), ordinary=ordinary)
        result = report.as_dict()
        result["processor_seconds"] = time.process_time() - cpu
        result["simulated_in_time"] = in_time(report)
        print(f"{name}: {result['verdict']}; {result['sentence']}")
        found[name] = result
    return found


def in_time(report: RestReport) -> dict[str, float] | None:
    """The repaired rig simulated in time: what the balance of torques is worth."""
    best, repaired = report.found.best, report.repaired
    if best is None or repaired is None:
        return None
    rows = RestPredictor(lambda _: repaired, report.table)
    ends = rows.simulated(repaired)
    assert ends is not None
    residual = rows.reported(repaired, ends) - report.table.angle
    return {
        "rms_deg": float(np.sqrt(np.mean(residual**2))) * DEG_PER_RAD,
        "largest_difference_deg": float(np.max(np.abs(residual - best.fit.residual))) * DEG_PER_RAD,
    }


def twin(task: Task) -> tuple[str, str, int, dict[str, Any]]:
    """Hide an effect in simulated rows and diagnose them."""
    kind, name, seed = task
    hidden, removed = TWINS[name]
    table, rig = read_static_table("mas20"), published_rig()
    ends = RestPredictor(lambda _: None, table, threads=1).simulated(rig.with_parameters(hidden))
    assert ends is not None
    rng = np.random.default_rng([seed, 11])
    angle = ends + NOISE_DEG / DEG_PER_RAD * rng.standard_normal(ends.size)
    report = diagnose_rest(
        dataclasses.replace(table, name="twin", angle=angle),
        rig,
        effects=[e for e in EFFECTS if e != removed],
        seed=seed,
        threads=1,
    )
    result = report.as_dict()
    keep = ("verdict", "effects", "alternatives", "gap", "seconds")
    return kind, name, seed, {key: result[key] for key in keep}


def twins(seeds: int, workers: int) -> list[dict[str, Any]]:
    """Every twin with several seeds."""
    tasks = [("twin", name, seed) for seed in range(seeds) for name in TWINS]
    mark = fingerprint("pamsim.", __file__)
    rows = kept_rows(twin, tasks, KEPT, mark, workers)
    found: list[dict[str, Any]] = []
    for (_, name, seed), row in sorted(rows.items()):
        named = [effect["name"] for effect in row["effects"]]
        print(f"{name}, seed {seed}: {row['verdict']} {named}")
        found.append({"hidden": name, "seed": seed, **row})
    return found


def loop() -> dict[str, Any]:
    """The loop of Alraouf 2025 in both printed forms, and how many runs would show it."""
    found: dict[str, Any] = {}
    for form, source in ALRAOUF_2025_FORMS.items():
        result = diagnose_length_loop(alraouf2025_loop(form), source).as_dict()
        print(f"{form}: {result['verdict']}; {result['sentence']}")
        found[form] = result
    found["runs"] = [shown_by(runs) for runs in RUNS]
    for row in found["runs"]:
        print(f"{row['runs']} runs: hysteresis is best of what is claimed in {row['claimed']:.2f}")
    return found


def shown_by(runs: int) -> dict[str, Any]:
    """How often the printed branches would be seen to be a loop, read with Table 2's scatter."""
    branches, means = alraouf2025_loop("branches"), alraouf2025_loop("means")
    assert means.error is not None
    error = means.error * np.sqrt(3.0 / runs)
    tried = [c for c in CANDIDATES if not c.moving]
    claimed = direction = 0
    for draw in range(DRAWS):
        rng = np.random.default_rng([runs, draw])
        read = branches.output + error * rng.standard_normal(error.size)
        shown = diagnose_loop(
            Loop(input=branches.input, output=read, rising=branches.rising, error=error), tried
        )
        best = shown.best
        claimed += best is not None and best.effect is not None and (
            best.effect.family == "muscle_hysteresis"
        )  # fmt: skip
        direction += shown.p_value < 0.05
    return {
        "runs": runs,
        "draws": DRAWS,
        "claimed": claimed / DRAWS,
        "direction_significant": direction / DRAWS,
    }


def main() -> None:
    """Run what is asked for and write the record."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", choices=("rest", "twins", "loop"))
    parser.add_argument("--seeds", type=int, default=1, help="of every twin")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    record: dict[str, Any] = {}
    if RESULTS.is_file():
        record = json.loads(RESULTS.read_text(encoding="utf-8"))
    record |= {
        "schema": SCHEMA,
        "command": "python scripts/real_data_diagnoses.py",
        "versions": {
            "python": platform.python_version(),
            **{n: importlib.metadata.version(n) for n in ("mujoco", "numpy", "scipy")},
        },
    }
    if asked.only in (None, "rest"):
        record["mas20"] = rest()
        write_json(RESULTS, record)
    if asked.only in (None, "loop"):
        record["alraouf2025"] = loop()
        write_json(RESULTS, record)
    if asked.only in (None, "twins"):
        record["twins"] = {"noise_deg": NOISE_DEG, "rows": twins(asked.seeds, asked.workers)}
        write_json(RESULTS, record)


if __name__ == "__main__":
    main()
