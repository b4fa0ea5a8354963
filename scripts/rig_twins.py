"""Is what is hidden in recordings of the shipped rigs named, and at the right joint or muscle?

    python scripts/rig_twins.py [--group GROUP] [--workers 1] [--json FILE]

Every case hides one effect in a shipped rig, simulates noisy recordings of it by the library's own
formulas, and diagnoses the files by the public `pamsim.diagnose` with its defaults, in one thread:

- ``arm``: two joints and four muscles, under set points and valves;
- ``bench``: one muscle in a tensile machine that imposes its length;
- ``measured``: one joint that is driven by its measured pressures, without commands;
- ``measured_larger``: the same effects twice as large, added after ``measured`` had named none;
- ``measured_common``: the effects of ``measured``, with a further input in which the common
  pressure varies, which the verdicts of ``measured`` had asked for;
- ``log``: the same joint, 60 s of one log without repeats;
- ``log_common``: the same, its common pressure varied.

Of an effect that no diagnosis tries at single muscles unless asked (`BY_MUSCLE`), all usual effects
are tried and, besides, this one at each muscle.

Cases, sizes and seeds of a group were fixed before any of it was run. A size is that at which
simulations with and without the effect differ, after a linear refit of the nuisance parameters, by
a mean square of about 1 variance of what repeats differ by, in a log of about 5 of the sensors'
noise. Sizes were found by hand, and no diagnosis had a part in it; what it states of the gap is
``excess``: mean square misfit before the repair over the noise floor, minus 1.

A name is right if this effect, and nothing else, is claimed, whatever its form; a place, if it is
claimed there. Spurious is a claim of an effect of another family. Tied: the verdict leaves open
which of several effects it is, and the hidden one, at its place, is among them.

Finished cases are kept in out/rig_twins, so that a stopped run goes on where it was; a case takes
one to two minutes. The record holds those of all groups.
"""

from __future__ import annotations

import dataclasses
import re
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from kept_rows import as_text, fingerprint, kept_rows
from records import parser, write

import pamsim
from pamsim.comparison.effects_on_rig import rig_effect
from pamsim.core.computation import versions
from pamsim.effects.catalog import TRIAL_EFFECTS
from pamsim.effects.effect import AT
from pamsim.engine.rig import Rig
from pamsim.twins.hide import hide

RESULTS = Path(__file__).parent / "results" / "rig_twins.json"
KEPT = Path("out/rig_twins")
SCHEMA = "pamsim-rig-twins/1"

BY_MUSCLE = ("air_leak", "muscle_hysteresis")
"""Effects that act on all muscles unless they are asked for at one."""


@dataclass(frozen=True, kw_only=True)
class Group:
    """Recordings of one kind.

    Attributes:
        rig: name of the shipped rig.
        drive: in words.
        hidden: effect, with its joint or muscle -> size [typical sizes].
        seeds: of the recordings; each effect is hidden once with each.
        options: further arguments of `pamsim.hide`.
        one_log: whether the first trial alone is kept.
    """

    rig: str
    drive: str
    hidden: Mapping[str, float]
    seeds: Sequence[int]
    options: Mapping[str, Any]
    one_log: bool = False


MEASURED = Group(
    rig="mas20_arm",
    drive="measured pressures",
    hidden={
        "coulomb_friction": 0.11,
        "viscous_friction": 0.28,
        "muscle_hysteresis": 0.055,
        "viscoelastic_creep": 0.07,
    },
    seeds=(1,),
    options={
        "protocols": ("triangle", "multisine"),
        "duration": 3.0,
        "repeats": 3,
        "measured_drive": True,
    },
)

LOG = Group(
    rig="mas20_arm",
    drive="one log of 60 s",
    hidden={"coulomb_friction": 0.18, "muscle_hysteresis": 0.07, "air_leak": 4.3},
    seeds=(1,),
    options={"protocols": ("staircase",), "duration": 60.0, "repeats": 1},
    one_log=True,
)

GROUPS = {
    "arm": Group(
        rig="two_joint_arm",
        drive="set points and valves",
        hidden={
            "coulomb_friction at elbow": 0.2,
            "viscous_friction at shoulder": 0.55,
            "added_inertia at elbow": 0.55,
            "muscle_mismatch at biceps": 0.12,
            "coulomb_friction at shoulder": 0.2,
            "viscous_friction at elbow": 1.2,
            "air_leak at triceps": 2.2,
            "muscle_hysteresis at shoulder_flexor": 0.085,
        },
        seeds=(1, 2),
        options={"protocols": ("triangle", "multisine", "bursts"), "duration": 3.0, "repeats": 3},
    ),
    "bench": Group(
        rig="muscle_bench",
        drive="imposed length",
        hidden={
            "muscle_hysteresis": 0.16,
            "viscoelastic_creep": 0.06,
            "threshold_pressure": 0.25,
            "pressure_bias": 0.3,
            "air_leak": 3.1,
            "coulomb_friction:dahl": 0.65,
        },
        seeds=(1, 2),
        options={
            "protocols": ("stretch", "isometric", "relaxation"),
            "duration": 3.0,
            "repeats": 3,
        },
    ),
    "measured": MEASURED,
    "measured_larger": dataclasses.replace(
        MEASURED,
        drive="measured pressures, effects twice as large",
        hidden={effect: 2.0 * size for effect, size in MEASURED.hidden.items()},
    ),
    "measured_common": dataclasses.replace(
        MEASURED,
        drive="measured pressures, the common one varied",
        options={**MEASURED.options, "protocols": ("triangle", "multisine", "cocontraction")},
    ),
    "log": LOG,
    "log_common": dataclasses.replace(
        LOG,
        drive="one log of 60 s, the common pressure varied",
        options={**LOG.options, "protocols": ("cocontraction",)},
    ),
}
"""The cases, the most wanted first."""


def recorded(group: Group, rig: Rig, effect: str, seed: int, folder: Path) -> int:
    """Write the recordings of a case; return the number of trials."""
    made = hide(rig, {effect: group.hidden[effect]}, seed=seed, **group.options)
    if group.one_log:
        stem = next(iter(made.trials))
        made = dataclasses.replace(
            made, trials={stem: made.trials[stem]}, protocols={stem: made.protocols[stem]}
        )
    made.save(folder)
    return len(made.trials)


def asked(rig: Rig, effect: str) -> tuple[str, ...]:
    """Effects to try; empty for the usual ones."""
    name, at, _ = effect.partition(AT)
    if not at or name not in BY_MUSCLE:
        return ()
    return (*TRIAL_EFFECTS, *(f"{name}{AT}{muscle}" for muscle in rig.muscles))


def run_one(kind: str, name: str, seed: int) -> dict[str, str]:
    """Hide an effect as a group does, diagnose, and compare what is claimed with it."""
    group, effect = GROUPS[kind], name
    rig = pamsim.load_rig(group.rig)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "data"
        trials = recorded(group, rig, effect, seed, folder)
        began = time.process_time()
        found = pamsim.diagnose(folder, effects=asked(rig, effect), threads=1).to_dict()
        seconds = time.process_time() - began
    row = {
        "group": kind,
        "rig": group.rig,
        "drive": group.drive,
        "hidden": effect,
        "size": group.hidden[effect],
        "seed": seed,
        "trials": trials,
        **judged(rig, effect, found),
        "processor_seconds": round(seconds, 1),
        "commit": commit(),
    }
    return as_text(row)


def judged(rig: Rig, hidden: str, found: Mapping[str, Any]) -> dict[str, Any]:
    """What a diagnosis, as its JSON states it, claims, and whether that is right."""
    levels = {re.sub(r":\w+", "", one["effect"]): one["level"] for one in found["effects"]}
    claimed = sorted(levels)
    name, _, place = hidden.partition(AT)
    right = [one.partition(AT)[0] for one in claimed] == [name.partition(":")[0]]
    family = rig_effect(rig, hidden).family
    return {
        "verdict": found["verdict"],
        "claimed": claimed,
        "tied": sorted({one for rivals in found["alternatives"].values() for one in rivals}),
        "levels": levels,
        "before": {one["link"]: one["before"] for one in found["links"]},
        "name_right": right,
        "place_right": (right and claimed[0].partition(AT)[2] == place) if place else None,
        "spurious": any(
            one["certain"]["family"] and one["family"] != family for one in found["effects"]
        ),
        "sentence": found["sentence"],
    }


def commit() -> str:
    """Commit of the checkout."""
    asked_for = ["git", "rev-parse", "--short", "HEAD"]
    found = subprocess.run(asked_for, capture_output=True, text=True, check=True)
    return found.stdout.strip()


def counts(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """For each group what a table shows."""
    found: list[dict[str, Any]] = []
    for name, group in GROUPS.items():
        own = [row for row in rows if row["group"] == name]
        if not own:
            continue
        rig = pamsim.load_rig(group.rig)
        placed = [row for row in own if row["place_right"] is not None]
        found.append(
            {
                "group": name,
                "rig": group.rig,
                "drive": group.drive,
                "joints": len(rig.joints),
                "muscles": len(rig.muscles),
                "trials": own[0]["trials"],
                "seconds_of_a_trial": group.options["duration"],
                "runs": len(own),
                "planned": len(group.hidden) * len(group.seeds),
                "name_right": sum(row["name_right"] for row in own),
                "tied": sum(row["hidden"].partition(":")[0] in row["tied"] for row in own),
                "placed": len(placed),
                "place_right": sum(row["place_right"] for row in placed),
                "spurious": sum(row["spurious"] for row in own),
                "median_processor_seconds": float(
                    np.median([row["processor_seconds"] for row in own])
                ),
            }
        )
    return found


def record(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The result: counts, and the rows that they were counted from."""
    return {
        "schema": SCHEMA,
        "command": "python scripts/rig_twins.py",
        "versions": versions(),
        "groups": counts(rows),
        "rows": rows,
    }


def main() -> None:
    """Run what is left of a group or of all; write what is finished of all."""
    asked = parser(__doc__, RESULTS, workers=1)
    asked.add_argument("--group", choices=GROUPS)
    options = asked.parse_args()
    mark = fingerprint("pamsim", __file__)
    rows: list[dict[str, Any]] = []
    for name, group in GROUPS.items():
        tasks = [(name, effect, seed) for seed in group.seeds for effect in group.hidden]
        stopped = options.group not in (None, name)
        own = kept_rows(run_one, tasks, KEPT / name, mark, options.workers, stopped=stopped)
        rows += own.values()
    write(record(rows), options.json)
    for group in counts(rows):
        print(group)


if __name__ == "__main__":
    main()
