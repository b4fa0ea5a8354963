"""Diagnoses of real data: the printed MAS-20 angles at rest, and the loop of Alraouf 2025.

The base of the first is the published force map in a plain balance; the sprocket's radius, which is
not printed, is refitted with every effect. Synthetic tables show how reliable such a verdict is: an
effect hidden in simulated rows, nothing hidden, and a hidden effect that is removed from the
library. The base of the second is the best reversible curve.
Beside both stands what the authors' own models leave. The pictures of docs/real_data.md are drawn
from the record, and those of the authors' models from the papers.

    python scripts/real_data_diagnoses.py [--only PART] [--seeds 1] [--workers 2]

PART is table, loop, authors, synthetic or pictures. Finished synthetic tables are kept in out/ and
not run again. A diagnosis of a table takes one to two minutes of one processor; the loops take
seconds, their synthetic runs some minutes.
"""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path
from typing import Any

import numpy as np
from pictures import save_small_png
from records import RESULTS, fingerprint, kept_rows, parser, run_parts

from pamsim.comparison.rest_simulator import RestPredictor
from pamsim.core.computation import versions
from pamsim.core.units import DEG_PER_RAD, MM_PER_M
from pamsim.diagnosis.by_link.result import LinkReport
from pamsim.diagnosis.diagnose import diagnose
from pamsim.diagnosis.fitted_rig import PULLEY, possible_rig
from pamsim.diagnosis.length_pressure_loop import (
    PRINTED_LOOPS,
    diagnose_length_loop,
    printed_loop,
)
from pamsim.diagnosis.options import Options
from pamsim.diagnosis.table_at_rest import diagnose_table, published_rig
from pamsim.effects.catalog import ROW_EFFECTS
from pamsim.engine.rig import Rig
from pamsim.papers.alraouf2025.loop import loop_scores
from pamsim.papers.claim import evaluate, recomputed
from pamsim.papers.replicate import replication_figures
from pamsim.papers.torque_law import printed_rows_law
from pamsim.recordings.static_table import read_static_table
from pamsim.report.link_page import first_figure
from pamsim.report.replication_figures import arctangent_loop, static_law

KEPT = Path("out") / "real_data_synthetic"
SCHEMA = "pamsim-real-data/3"

NOISE_DEG = 0.5
"""Of the synthetic rows: about what the best models leave of the real ones."""

LOCKS = {"passive.locking": 35.0, "passive.stiffness": 500.0}
SYNTHETIC: dict[str, tuple[dict[str, float], str]] = {
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
HYSTERESIS = "muscle_hysteresis"

PARTS = {
    "table": "mas20", "loop": "alraouf2025", "authors": "authors", "synthetic": "synthetic",
    "pictures": "pictures",
}  # fmt: skip
"""Part -> its key in the record."""
MM_PER_CM = 10.0


def printed_table() -> dict[str, Any]:
    """The printed rows, with the sprocket's radius refitted."""
    table, rig = read_static_table("mas20"), published_rig()
    cpu = time.process_time()
    report = diagnose_table(table, rig)
    result = report.to_dict()
    result["processor_seconds"] = time.process_time() - cpu
    result["as_it_is_deg"] = rms_in_time(rig)
    result["repaired_in_time_deg"] = rms_in_time(repaired(report))
    print(f"{result['verdict']}; {result['sentence']}")
    return result


def repaired(report: LinkReport) -> Rig:
    """The published rig with the effects that were found and the refitted radius."""
    values = {n: size.value_si for one in report.effects for n, size in one.sizes.items()}
    (radius,) = report.nuisance
    rig = possible_rig(published_rig(), values | {PULLEY: radius.whole / MM_PER_M})
    assert rig is not None
    return rig


def rms_in_time(rig: Rig) -> float:
    """What a rig simulated in time misses of the printed rows, RMS [deg]."""
    rows = RestPredictor(lambda _: None, read_static_table("mas20"))
    ends = rows.simulated(rig)
    assert ends is not None
    residual = rows.reported(rig, ends) - rows.table.angle
    return float(np.sqrt(np.mean(residual**2))) * DEG_PER_RAD


def synthetic_table(kind: str, name: str, seed: int) -> dict[str, Any]:
    """Hide an effect in simulated rows and diagnose them."""
    del kind
    hidden, removed = SYNTHETIC[name]
    table, rig = read_static_table("mas20"), published_rig()
    ends = RestPredictor(lambda _: None, table, threads=1).simulated(rig.with_parameters(hidden))
    assert ends is not None
    rng = np.random.default_rng([seed, 11])
    angle = ends + NOISE_DEG / DEG_PER_RAD * rng.standard_normal(ends.size)
    result = diagnose_table(
        dataclasses.replace(table, name="synthetic", angle=angle),
        rig,
        Options(effects=tuple(e for e in ROW_EFFECTS if e != removed), seed=seed, threads=1),
    ).to_dict()
    keep = ("verdict", "sentence", "effects", "alternatives", "gap", "run")
    return {key: result[key] for key in keep}


def synthetic_tables(seeds: int, workers: int) -> dict[str, Any]:
    """Every synthetic table with several seeds."""
    tasks = [("synthetic", name, seed) for seed in range(seeds) for name in SYNTHETIC]
    mark = fingerprint("pamsim.", __file__)
    rows = kept_rows(synthetic_table, tasks, KEPT, mark, workers)
    results: list[dict[str, Any]] = []
    for (_, name, seed), row in sorted(rows.items()):
        print(f"{name}, seed {seed}: {row['verdict']}; {row['sentence']}")
        results.append({"hidden": name, "seed": seed, **row})
    return {"noise_deg": NOISE_DEG, "rows": results}


def loop() -> dict[str, Any]:
    """The loop of Alraouf 2025 in both printed forms, and how many runs would show it."""
    results: dict[str, Any] = {}
    for name in PRINTED_LOOPS:
        result = diagnose(name).to_dict()
        print(f"{name}: {result['verdict']}; {result['sentence']}")
        results[name] = result
    results["runs"] = [shown_by(runs) for runs in RUNS]
    for row in results["runs"]:
        print(f"{row['runs']} runs: {row['found']:.2f} find a loop, {row['named']:.2f} name it")
    return results


def shown_by(runs: int) -> dict[str, Any]:
    """How often the printed branches would be seen to be a loop, read with Table 2's scatter."""
    branches, means = printed_loop("alraouf2025_equations"), printed_loop("alraouf2025")
    assert means.error is not None
    error = means.error * np.sqrt(3.0 / runs)
    found = named = 0
    for draw in range(DRAWS):
        rng = np.random.default_rng([runs, draw])
        read = branches.length + error * rng.standard_normal(error.size)
        loop = dataclasses.replace(branches, length=read, error=error)
        effects = diagnose_length_loop(loop, "drawn").effects
        found += bool(effects)
        named += any(one.certain["family"] for one in effects if one.family == HYSTERESIS)
    return {"runs": runs, "draws": DRAWS, "found": found / DRAWS, "named": named / DRAWS}


def authors_models() -> dict[str, Any]:
    """What the authors' own models leave of the printed rows and of the printed loop, RMS."""
    printed_law, any_unit = (evaluate(f"matiskova2021-{number}") for number in (11, 12))
    _, refitted = recomputed("matiskova2021-09")
    branches = {}
    for branch, number in (("up", 18), ("down", 22)):
        _, own = recomputed(f"alraouf2025-{number}")
        branches[branch] = {
            "arctangent_as_printed": loop_scores(branch, "arctangent")["RMSE"].value * MM_PER_CM,
            "bouc_wen_as_printed": loop_scores(branch, "bouc_wen")["RMSE"].value * MM_PER_CM,
            "arctangent_on_table_2": own.value.value * MM_PER_CM,
            "arctangent_refitted": own.evidence["fitted"] * MM_PER_CM,
        }
    return {
        "rows_deg": {
            "equation_23": printed_law.recomputed,
            "equation_23_any_unit": any_unit.recomputed,
            "equation_17_refitted": refitted.evidence["rms"],
            "torque_law_held_out": printed_rows_law().left_out_rms_deg,
        },
        "loop_mm": branches,
    }


def draw(record: dict[str, Any]) -> None:
    """Write the pictures of docs/real_data.md."""
    rows, loops = record["mas20"], record["alraouf2025"]
    curves = replication_figures(("matiskova2021", "alraouf2025"))
    for name, figure in (
        ("mas20_rows", first_figure(rows)[1]),
        ("matiskova2021_law", static_law(curves["matiskova2021"])),
        ("alraouf2025_means", first_figure(loops["alraouf2025"])[1]),
        ("alraouf2025_equations", first_figure(loops["alraouf2025_equations"])[1]),
        ("alraouf2025_law", arctangent_loop(curves["alraouf2025"])),
    ):
        save_small_png(figure, name)


def main() -> None:
    """Run what is asked for and write the record."""
    options = parser(__doc__, RESULTS / "real_data_diagnoses.json", workers=2, seeds=1)
    options.add_argument("--only", choices=PARTS)
    asked = options.parse_args()
    about = {
        "schema": SCHEMA,
        "command": "python scripts/real_data_diagnoses.py",
        "versions": versions("scipy"),
    }
    jobs = {
        "mas20": printed_table,
        "alraouf2025": loop,
        "authors": authors_models,
        "synthetic": lambda: synthetic_tables(asked.seeds, asked.workers),
    }
    draw(run_parts(asked.json, about, jobs, PARTS.get(asked.only)))


if __name__ == "__main__":
    main()
