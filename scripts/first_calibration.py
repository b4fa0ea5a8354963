"""How often `pamsim calibrate --first` finds a rig whose file is far off.

    python scripts/first_calibration.py [--count 60] [--seed 0] [--workers 2] [--stopped]
        [--json FILE]

Case number i, drawn with seed i, is a recording of one of four rigs whose true numbers are off
those of its file in five parameters out of those that ``--first`` frees: a mounting length by 1 to
3 % of the muscle's, dry friction of 0.05 to 0.3 N m or 0.5 to 3 N that the file has not, any other
by 20 to 50 % either way. Two repeats of each of three inputs, 4 s each, with the noise of sensors;
muscles are commanded by set points, and every other case has load cells. Each recording is
calibrated with ``--first`` and, with the same parameters freed, without.

A parameter is found where its 95 % interval holds the true value, or where it is nearer than a
tenth of how far the file was off; it is tied where a flag says that it can change together with
others. Finished rows are kept in out/first_calibration.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from records import fingerprint, kept_rows, median, study_parser, write_rows

import pamsim
from pamsim.calibration.calibrate import calibrate
from pamsim.comparison.free_parameters import first_names
from pamsim.core.computation import versions
from pamsim.core.errors import PamsimError
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.inference.estimate import Flag

KEPT = Path("out/first_calibration")
RIGS = ("mas20_arm", "joint", "muscle_bench", "two_joint_arm")
TEMPLATES = ("joint", "leg", "bench", "bellows")
"""Kinds of `pamsim new-rig`."""
INPUTS = ("triangle", "staircase", "multisine", "cocontraction", "bursts")
TIED = {Flag.FLAT_DIRECTION, Flag.NOT_PINNED, Flag.DEAD}
NEAR = 0.1


def rig_of(name: str, folder: Path) -> Rig:
    """A rig as its file describes it; a template is written into a folder."""
    if name in TEMPLATES:
        return pamsim.load_rig(pamsim.new_rig(f"my_{name}", name, out=folder / "rig"))
    return pamsim.load_rig(name)


def off(rig: Rig, rng: np.random.Generator) -> dict[str, float]:
    """True values of five parameters [SI]."""
    true: dict[str, float] = {}
    for name in map(str, rng.choice(first_names(rig), 5, replace=False)):
        value, side = rig_parameter(rig, name).value, rng.choice([-1.0, 1.0])
        if name.endswith(".length_at_zero"):
            muscle = rig.muscles[name.partition(":")[0] if ":" in name else next(iter(rig.muscles))]
            true[name] = value + side * rng.uniform(0.01, 0.03) * muscle.braided.nominal_length
        elif name.endswith(".frictionloss"):
            turns = rig.joints[name.split(".")[1]] == "angle"
            true[name] = rng.uniform(0.05, 0.3) * (1.0 if turns else 10.0)
        else:
            true[name] = value * rng.uniform(1.2, 1.5) ** side
    return true


def run_one(kind: str, name: str, seed: int) -> dict[str, Any]:
    """Calibrate one recording, ``first`` or ``plain``."""
    rng = np.random.default_rng((seed, 43))
    with tempfile.TemporaryDirectory() as place:
        rig, folder = rig_of(name, Path(place)), Path(place) / "data"
        true = off(rig, rng)
        row: dict[str, Any] = {"kind": kind, "rig": name, "seed": seed}
        inputs = tuple(str(one) for one in rng.choice(INPUTS, size=3, replace=False))
        try:
            pamsim.hide(
                rig.with_parameters(true),
                {},
                duration=4.0,
                repeats=2,
                seed=seed,
                protocols=inputs,
                forces=bool(seed % 2),
            ).save(folder)
        except PamsimError as error:  # such as a muscle longer than its fibres
            return {**row, "not_made": str(error)}
        free = () if kind == "first" else first_names(rig)
        try:
            found = calibrate([folder], rig=rig, free=free, first=kind == "first", threads=1)
        except PamsimError as error:
            return {**row, "refused": str(error)}
        parameters = {p.name: p for p in found.parameters}
        each: dict[str, str] = {}
        inside = [0, 0]
        for parameter, value in true.items():
            one, before = parameters.get(parameter), rig_parameter(rig, parameter).value
            if one is None:
                each[parameter] = "not shown"
                continue
            held = one.interval95 and one.interval95[0] <= value <= one.interval95[1]
            inside = [inside[0] + bool(held), inside[1] + bool(one.interval95)]
            near = abs(one.value - value) < NEAR * abs(before - value)
            tied = TIED & set(one.flags)
            each[parameter] = "found" if held or near else "tied" if tied else "missed"
    return {
        **row,
        "status": str(found.status),
        "seconds": found.seconds,
        "simulations": found.simulations,
        "inside": inside,
        "parameters": each,
    }


def counted(rows: Mapping[Any, Mapping[str, Any]]) -> dict[str, Any]:
    """Counts of each kind."""
    table: dict[str, Any] = {}
    for kind in ("first", "plain"):
        own = [r for (k, *_), r in rows.items() if k == kind and "not_made" not in r]
        done = [row for row in own if "refused" not in row]
        each = [verdict for row in done for verdict in row["parameters"].values()]
        table[kind] = {
            "rigs": len(own),
            "all five found or said to be tied": sum(
                "missed" not in row["parameters"].values() for row in done
            ),
            "all five found": sum(set(row["parameters"].values()) == {"found"} for row in done),
            "parameters": {verdict: each.count(verdict) for verdict in sorted(set(each))},
            "intervals that hold the true value": [
                sum(row["inside"][k] for row in done) for k in (0, 1)
            ],
            "refused": len(own) - len(done),
            "median_seconds": median([row["seconds"] for row in done]),
        }
    return table


def main() -> None:
    """Run what is left, count, write."""
    options = study_parser(__doc__, count=60, seed=0).parse_args()
    cases = [(RIGS[k % len(RIGS)], options.seed + k) for k in range(options.count)]
    tasks = [(kind, *case) for kind in ("first", "plain") for case in cases]
    mark = fingerprint("pamsim", __file__)
    folder = KEPT / f"{options.seed}_{options.count}"
    rows = kept_rows(run_one, tasks, folder, mark, options.workers, stopped=options.stopped)
    command = f"python scripts/first_calibration.py --count {options.count} --seed {options.seed}"
    result = {
        "command": command,
        "versions": versions(),
        "counts": counted(rows),
        "rows": list(rows.values()),
    }
    write_rows(result, options.json)


if __name__ == "__main__":
    main()
