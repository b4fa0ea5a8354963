"""How often `pamsim diagnose` is right: data sets in which an effect, several or none are hidden.

    python scripts/blind_study.py tuning|final [--workers 2] [--only KIND] [--stopped] [--json FILE]

Every data set is a recording on disk (five protocols, four repeats of each of two settings, 5 s at
100 Hz, angle, pressures and forces) of the MAS-20 arm; it is diagnosed through files, by all
effects, as `pamsim diagnose` does. Conditions and seeds stand in blind_study_conditions.py: those
of ``tuning`` served to choose thresholds, those of ``final`` were committed before and are run with
the thresholds as they then were. Finished rows are kept in out/blind_study.jsonl: a stopped study
goes on where it was.
"""

from __future__ import annotations

import argparse
import json
import platform
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from blind_study_conditions import Condition, conditions
from blind_study_scores import scores
from kept_rows import Task, fingerprint, kept_rows

import pamsim
from pamsim.core.recording import write_recording
from pamsim.diagnosis.diagnose import diagnose
from pamsim.diagnosis.method.screen import signature_similarity
from pamsim.diagnosis.result import Diagnosis
from pamsim.effects.catalog import TRIAL_EFFECTS
from pamsim.twins.hide import hide
from pamsim.twins.synthetic_recording import SyntheticRecording

RESULTS = Path("scripts/results/blind_study.json")
KEPT = Path("out/blind_study.jsonl")
RIG = "mas20_arm"
PROTOCOLS = ("triangle", "staircase", "multisine", "bursts", "loaded_steps")
DURATION, REPEATS = 5.0, 4


def settings(one: Condition, **changed: Any) -> dict[str, Any]:
    """How the data of a condition are made."""
    chosen: dict[str, Any] = {
        "protocols": PROTOCOLS,
        "duration": DURATION,
        "repeats": REPEATS,
        "coloured": one.coloured,
        "variation": one.variation,
        "formulation": one.formulation,
        "seed": one.seed,
    }
    return {**chosen, **changed}


def run_one(task: tuple[str, str, int]) -> tuple[str, str, int, dict[str, Any]]:
    """Hide, diagnose, and write down what a score needs."""
    kind, name, seed = task
    (one,) = [c for c in conditions(kind) if c.name == name]
    rig = pamsim.load_rig(RIG)
    began = time.perf_counter()
    hidden = hide(rig, dict(one.effects), **settings(one))
    with tempfile.TemporaryDirectory() as folder:
        write_recording(Path(folder), RIG, hidden.trials, hidden.protocols)
        tried = [effect for effect in TRIAL_EFFECTS if effect not in one.removed]
        report = diagnose([folder], effects=tried, threads=1, seed=seed)
    row = found_row(report, hidden)
    if one.effects:
        changed = settings(one, repeats=1, noise=0.0, variation=0.0)
        clean = hide(rig, dict(one.effects), **changed)
        row["true_cells"] = true_cells(report, clean)
    row["seconds_with_data"] = round(time.perf_counter() - began, 1)
    return kind, name, seed, row


def found_row(report: Diagnosis, hidden: SyntheticRecording) -> dict[str, Any]:
    """The result of a diagnosis, with the hidden values beside it."""
    found = report.method
    protocols = {part.protocol for part in report.comparisons}
    best = found.conclusion.best
    perfect = found.perfect_loss
    after = found.base_loss if best is None else best.loss
    by_name = {s.candidate.name: s for s in found.screened}
    likest = {
        name: max(
            (signature_similarity(s, o) for n, o in by_name.items() if n != name), default=0.0
        )
        for name, s in by_name.items()
    }
    return {
        "verdict": str(found.conclusion.verdict),
        "named": list(best.names) if best else [],
        "tied": [list(m.names) for m in found.conclusion.tied],
        "explained": round(found.conclusion.explained, 4),
        "remainder": round(found.conclusion.remainder, 4),
        "lack": None
        if found.conclusion.lack is None
        else [round(found.conclusion.lack.size, 4), found.conclusion.lack.p_value],
        "excess": round(_ratio(found.base_loss, perfect) - 1.0, 4),
        "rms_after": round(float(np.sqrt(_ratio(after, perfect))), 4),
        "parameters": {}
        if best is None
        else {
            p.name: {
                "value": best.fit.values[p.name],
                "interval95": list(best.intervals[p.name]),
                "truth": hidden.hidden.get(p.name),
                "neutral": c.neutral.get(p.name),
            }
            for c in best.candidates
            for p in c.parameters
        },
        "cells": [[c.channel, c.protocol, round(c.excess, 3)] for c in found.cells[:4]],
        "likest": {name: round(value, 3) for name, value in likest.items()},
        "visible": {name: s.visible for name, s in by_name.items()},
        "screened": [s.candidate.name for s in found.screened[:5]],
        "models": [
            [
                list(m.names),
                round(m.mean_loss, 4),
                round(m.improvement.gain, 4),
                m.improvement.p_value,
            ]
            for m in found.models
        ],
        "protocols": len(protocols),
        "evaluations": found.evaluations,
        "rollouts": report.rollouts,
        "seconds": round(report.seconds, 1),
    }


def true_cells(report: Diagnosis, clean: SyntheticRecording) -> list[list[Any]]:
    """Where the effect truly shows: noise-free ground truth against the refitted base model."""
    floor = report.method.floor
    first: dict[str, str] = {}
    for part in report.comparisons:
        first.setdefault(part.protocol, part.trial)
    cells: list[tuple[float, str, str]] = []
    for stem, protocol in clean.protocols.items():
        run = clean.trials[stem]
        signals = {"angle": run.angle}
        for muscle in range(run.pressure.shape[1]):
            signals[f"pressure_{muscle + 1}"] = run.pressure[:, muscle]
            signals[f"force_{muscle + 1}"] = run.tension[:, muscle]
        simulated = {
            part.channel: part.before
            for part in report.comparisons
            if part.trial == first[protocol] and part.before is not None
        }
        for channel, values in simulated.items():
            count = min(values.size, signals[channel].size)
            off = float(np.mean((values[:count] - signals[channel][:count]) ** 2))
            cells.append((off / floor.variance[channel, protocol], channel, protocol))
    cells.sort(reverse=True)
    return [[channel, protocol, round(excess, 3)] for excess, channel, protocol in cells[:4]]


def _ratio(loss: Any, perfect: Any) -> float:
    return float(np.mean([loss[t] for t in perfect]) / np.mean(list(perfect.values())))


def main() -> None:
    """Run what is left, score, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("batch", choices=("tuning", "final"))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", default="", help="kinds of condition that begin so")
    parser.add_argument("--stopped", action="store_true", help="score the finished rows only")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    here = Path(__file__).parent
    mark = fingerprint(
        "pamsim", __file__, here / "blind_study_conditions.py", *Path("models").glob("*/*.*ml")
    )
    chosen = [c for c in conditions(options.batch) if c.kind.startswith(options.only)]
    tasks = [(options.batch, c.name, c.seed) for c in chosen]
    if options.stopped:
        done = {(r["kind"], r["name"], r["seed"]) for r in _kept() if r["fingerprint"] == mark}
        tasks = [task for task in tasks if task in done]
    rows = kept_rows(run_one, tasks, KEPT, mark, options.workers)
    result = study(options.batch, chosen, rows, mark)
    print(json.dumps(result["scores"], indent=1))
    if options.json is not None:
        options.json.write_text(written(result), encoding="utf-8")


def study(
    batch: str, chosen: Sequence[Condition], rows: Mapping[Task, dict[str, Any]], mark: str
) -> dict[str, Any]:
    """The result: scores, and what they were counted from.

    Args:
        batch: ``tuning`` or ``final``.
        chosen: conditions; those without a row do not count, but are said.
        rows: (batch, name, seed) -> row.
        mark: of the code that made them.
    """
    pairs = [(c, rows[key]) for c in chosen if (key := (batch, c.name, c.seed)) in rows]
    return {
        "schema": "pamsim-blind-study/1",
        "command": f"python scripts/blind_study.py {batch}",
        "fingerprint": mark,
        "planned": len(chosen),
        "data": {
            "protocols": PROTOCOLS,
            "settings_of_each": 2,
            "repeats": REPEATS,
            "seconds_of_a_trial": DURATION,
        },
        "versions": {"mujoco": mujoco.__version__, "python": platform.python_version()},
        "scores": scores(pairs),
        "rows": [{**c.as_dict(), **_short(c, row)} for c, row in pairs],
    }


def written(result: Mapping[str, Any]) -> str:
    """JSON with a line per data set."""
    head = {name: value for name, value in result.items() if name != "rows"}
    lines = ",\n".join("  " + json.dumps(row) for row in result["rows"])
    text = json.dumps(head, indent=1)
    return f'{text[:-2]},\n "rows": [\n{lines}\n ]\n}}\n'


def _short(one: Condition, row: dict[str, Any]) -> dict[str, Any]:
    """A row without what only its making was watched by."""
    kept = {k: v for k, v in row.items() if k not in ("visible", "models", "screened", "protocols")}
    truths = {name for name, _ in one.effects}
    kept["likest"] = {n: v for n, v in row["likest"].items() if n in truths}
    for cells in ("cells", "true_cells"):
        if cells in kept:
            kept[cells] = kept[cells][:2]
    return kept


def _kept() -> list[dict[str, Any]]:
    lines = KEPT.read_text(encoding="utf-8").splitlines() if KEPT.exists() else []
    return [json.loads(line) for line in lines]


if __name__ == "__main__":
    main()
