"""How often the 95 % intervals of `pamsim calibrate` hold the planted rig, end to end.

    python scripts/calibrate_study.py [--workers 2] [--stopped]
        [--json scripts/results/calibrate_study.json]

Five parameters of the MAS-20 arm are planted 5 to 50 % off the rig's own values. Two valve
sequences (one under load, 1.5 s at 100 Hz), four repeats of each or one trial, are simulated, get
noise on angle and pressures, are written to files and calibrated from the rig's own values: for
each number of repeats 200 seeds of white and 200 of coloured noise (AR(1), correlation time 0.1 s)
of 0.05 deg and 0.4 kPa. Then experiments that cannot show what is asked: valves that only fill,
from which the conductance of exhaust is wanted; and angles at rest without load, from which active
and passive forces are both wanted, though only their ratio turns the arm.

Finished runs are kept in out/calibrate_study: a stopped study goes on where it was. With
``--stopped`` nothing is run; settings of which not all is finished stay as they are in FILE.
"""

from __future__ import annotations

import dataclasses
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from records import RESULTS, fingerprint, kept_rows, noise, print_and_write, read, study_parser

import pamsim
from pamsim.calibration.calibrate import calibrate
from pamsim.core.computation import versions
from pamsim.recordings.recording import write_recording

KEPT = Path("out/calibrate_study")
RUNS, BLIND_RUNS = 200, 20
REPEATS = 4  # from here on intervals rest on the scatter of trials, not on a model of the noise
ONE = ", one trial"
"""Ends the names of settings without repeats."""
RATE, HOLD = 100.0, 0.3
TIMESTEP = 1e-3  # twice the rig's own, in both plant and fit: half the time for the same statistics
ANGLE_NOISE, PRESSURE_NOISE = np.radians(0.05), 400.0
COLOURS = {"white": 0.0, "coloured 0.1 s": 0.1}
SETTINGS = (*COLOURS, *(colour + ONE for colour in COLOURS))
PLANTED = {
    "valve.conductance_fill": 6.1e-10,
    "valve.conductance_exhaust": 4.7e-10,
    "joint.shaft.damping": 0.33,
    "passive.locking": 27.5,
    "body.rig.tilt": -0.05,
}
SEQUENCES: dict[str, tuple[float, list[tuple[float, float]]]] = {
    "swing": (0.0, [(0.4, -0.5), (0.0, 0.0), (-0.6, 0.5), (0.0, 0.2), (0.3, -0.3)]),
    "lift": (1.2, [(0.3, -0.4), (0.2, 0.0), (-0.5, 0.3), (0.1, -0.1), (0.0, 0.3)]),
}
ONLY_FILLING = {"up": (0.0, [(0.3, 0.0), (0.0, 0.2), (0.1, 0.0), (0.0, 0.1), (0.05, 0.05)])}
REST_PRESSURES = [(300, 100), (400, 150), (500, 300), (500, 0), (200, 400), (100, 500)]
BLIND = {
    "valves only fill": ["valve.conductance_fill", "valve.conductance_exhaust"],
    "rest without load": ["force.scale", "passive.stiffness"],
}


def experiment(load: float, openings: list[tuple[float, float]]) -> pamsim.Experiment:
    """A trial that holds each pair of valve openings for a while."""
    return pamsim.Experiment(
        drive="valve",
        command_time=HOLD * np.arange(len(openings)),
        command_value=np.array(openings),
        start_pressure=np.array([2.5e5, 2.5e5]),
        duration=HOLD * len(openings),
        sample_rate=RATE,
        load=load,
        settle=2.0,
    )


def recorded(
    rig: pamsim.Rig, sequences: dict[str, Any], setting: str, seed: int, path: Path
) -> None:
    """Simulate a rig's trials and write noisy repeats of each."""
    rng = np.random.default_rng([seed, SETTINGS.index(setting)])
    correlation = RATE * COLOURS[setting.removesuffix(ONE)]
    repeats = 1 if setting.endswith(ONE) else REPEATS
    trials: dict[str, pamsim.Recording] = {}
    for name, (load, openings) in sequences.items():
        run = pamsim.simulate(rig, experiment(load, openings)).completed()
        for repeat in range(1, 1 + repeats):
            angle = noise(rng, run.angle.shape, correlation, 1000)
            pressure = noise(rng, run.pressure.shape, correlation, 1000)
            trials[f"{name}_{repeat}"] = dataclasses.replace(
                run.with_angle(run.angle + ANGLE_NOISE * angle),
                pressure=run.pressure + PRESSURE_NOISE * pressure,
            )
    write_recording(path, "mas20_arm", trials)


def at_rest(rig: pamsim.Rig, seed: int, path: Path) -> None:
    """Write a rig's noisy angles at rest without load."""
    rng = np.random.default_rng(seed)
    rows = ["p1_kpa,p2_kpa,load_kg,angle_deg"]
    for first, second in REST_PRESSURES:
        high = 1e3 * max(first, second)
        step = pamsim.pressure_step((high, high), (1e3 * first, 1e3 * second), duration=6.0)
        angle = pamsim.simulate(rig, step).completed().angle[-1]
        rows.append(f"{first},{second},0,{np.degrees(angle + ANGLE_NOISE * rng.normal()):.5f}")
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def run_one(kind: str, name: str, seed: int) -> dict[str, Any]:
    """Run one task of either kind, in a worker."""
    rig = pamsim.load_rig("mas20_arm")
    rig.model.opt.timestep = TIMESTEP
    free = list(PLANTED) if kind == "cover" else BLIND[name]
    planted = rig.with_parameters({key: PLANTED[key] for key in free if key in PLANTED})
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "data"
        if name == "rest without load":
            path = path.with_suffix(".csv")
            at_rest(planted, seed, path)
        elif kind == "cover":
            recorded(planted, SEQUENCES, name, seed, path)
        else:
            recorded(planted, ONLY_FILLING, "white", seed, path)
        # Forces are left out: few rigs have them.
        found = calibrate([path], rig=rig, free=free, channels=["angle", "pressure"], threads=1)
    result = found.fit
    return {
        "seconds": found.seconds,
        "simulations": found.simulations,
        "status": str(result.status),
        "sentence": result.sentence,
        "parameters": {
            p.name: {
                "value": p.value,
                "interval95": p.interval95,
                "flags": [str(flag) for flag in p.flags],
            }
            for p in result.parameters
        },
    }


def coverage(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Errors and coverage of the planted parameters over runs."""
    table: dict[str, Any] = {}
    for name, truth in PLANTED.items():
        found = [row["parameters"][name] for row in rows]
        values = np.array([f["value"] for f in found])
        ends = np.array([f["interval95"] or (np.nan, np.nan) for f in found])
        table[name] = {
            "planted": truth,
            "median_error_percent": 100.0 * float(np.median(np.abs(values / truth - 1.0))),
            "bias_percent": 100.0 * float(np.mean(values) / truth - 1.0),
            "mean_half_width_percent": 50.0 * float(np.nanmean(ends[:, 1] - ends[:, 0])) / truth,
            "coverage_percent": 100.0
            * float(np.mean((ends[:, 0] <= truth) & (truth <= ends[:, 1]))),
        }
    return {
        **ended(rows),
        "median_seconds": float(np.median([row["seconds"] for row in rows])),
        "median_simulations": float(np.median([row["simulations"] for row in rows])),
        "parameters": table,
    }


def blindness(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What was said of parameters that the recordings cannot show."""
    flags: dict[str, dict[str, float]] = {}
    for name in rows[0]["parameters"]:
        own = [row["parameters"][name]["flags"] for row in rows]
        every = sorted({flag for each in own for flag in each})
        flags[name] = {f: 100.0 * float(np.mean([f in each for each in own])) for f in every}
    return {**ended(rows), "sentence_of_seed_0": rows[0]["sentence"], "flags_percent": flags}


def ended(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """How many runs there were, and how they ended."""
    statuses = Counter(row["status"] for row in rows)
    return {"runs": len(rows), "statuses": dict(sorted(statuses.items()))}


def main() -> None:
    """Run what is not yet there unless it is stopped, and summarise all, or what is finished."""
    options = study_parser(__doc__, RESULTS / "calibrate_study.json").parse_args()
    before = read(options.json)
    mark = fingerprint("pamsim.", __file__, *Path("models/mas20_arm").glob("*.toml"))
    tasks = [("cover", name, seed) for name in reversed(SETTINGS) for seed in range(RUNS)]
    tasks += [("blind", name, seed) for name in BLIND for seed in range(BLIND_RUNS)]
    rows = kept_rows(run_one, tasks, KEPT, mark, options.workers, stopped=options.stopped)
    covered, blind = (dict(before.get(key, {})) for key in ("coverage", "rank_deficient"))
    for kind, names, count, summary, table in (
        ("cover", SETTINGS, RUNS, coverage, covered),
        ("blind", BLIND, BLIND_RUNS, blindness, blind),
    ):
        for name in names:
            keys = [(kind, name, seed) for seed in range(count)]
            if rows.keys() >= set(keys):
                table[name] = summary([rows[key] for key in keys])
    result = {
        "command": "python scripts/calibrate_study.py",
        "versions": versions(),
        "timestep_s": TIMESTEP,
        "repeats": REPEATS,
        "noise": {"angle_deg": float(np.degrees(ANGLE_NOISE)), "pressure_pa": PRESSURE_NOISE},
        "coverage": covered,
        "rank_deficient": blind,
    }
    print_and_write(result, options.json)


if __name__ == "__main__":
    main()
