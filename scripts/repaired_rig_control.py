"""Controllers designed on the rig as filed and on the rig that `pamsim diagnose` repaired.

    python scripts/repaired_rig_control.py [--json FILE]

The plant's muscles are stiffer and have more hysteresis than its file states. Recordings of it are
diagnosed. Controllers are designed and tuned on the rig as filed, then on the repaired one, without
use of the plant; all are scored on the plant. Designs on the plant itself show the best possible.
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path

import gymnasium
from controller_scoreboard import SEEDS, driven, tuned
from records import RESULTS, parser, print_and_write

from pamsim.controllers.suite import Suite
from pamsim.core.computation import versions
from pamsim.diagnosis.diagnose import diagnose
from pamsim.engine.rig import Rig, load_rig
from pamsim.twins.hide import hide

HIDDEN = {"passive_stiffness": 1.0, "muscle_hysteresis": 1.0}
PROTOCOLS = ("triangle", "multisine", "loaded_steps")
NAMES = ("PID", "LQG", "feed-forward", "feed-forward + PID", "feed-forward, compensated + PID")
TASKS = ("sine", "step")
LOAD = 1.2


def environment(rig: Rig, task: str) -> gymnasium.Env:
    """The environment of a rig."""
    return gymnasium.make("pamsim/PamArmPressure-v0", rig=rig, task=task, load=LOAD)


def scores(known: Rig, plant: Rig, label: str) -> list[dict[str, object]]:
    """Controllers designed on what is known, scored on the plant."""
    suite, found = Suite(rig=known, load=LOAD), []
    for task in TASKS:
        own, real = environment(known, task), environment(plant, task)
        for name in NAMES:
            chosen, controller = tuned(name, suite, {"pressure_set": own}) or (None, None)
            got = driven(real, controller, SEEDS).rmse if controller else math.inf
            found.append(
                {
                    "designed_on": label,
                    "task": task,
                    "controller": name,
                    "chosen": chosen,
                    "rmse_deg": round(math.degrees(got), 4),
                }
            )
        own.close()
        real.close()
    return found


def main() -> int:
    """Hide, diagnose, design, drive, write; 1 if the diagnosis names nothing to repair."""
    target = parser(__doc__, RESULTS / "repaired_rig_control.json").parse_args().json
    filed = load_rig("mas20_arm")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        hidden = hide(filed, HIDDEN, protocols=PROTOCOLS, duration=5.0, repeats=4, seed=21)
        hidden.save(folder / "data")
        report = diagnose([folder / "data"], seed=0)
        print(report.summary())
        _, *repaired = report.save(folder / "out")
        if not repaired:
            print("no repaired rig follows from this verdict", file=sys.stderr)
            return 1
        plant = filed.with_parameters(hidden.hidden)
        designs = {"the rig as filed": filed, "the repaired rig": load_rig(repaired[0])}
        rows = [
            row
            for label, known in {**designs, "the plant itself": plant}.items()
            for row in scores(known, plant, label)
        ]
    page = {
        "schema": "pamsim-repaired-control/1",
        "command": "python scripts/repaired_rig_control.py",
        "hidden": hidden.to_dict()["effects"],
        "verdict": report.verdict,
        "sentence": report.summary(),
        "load_kg": LOAD,
        "rows": rows,
        "versions": versions("scipy", "control", "gymnasium"),
    }
    print_and_write(page, target)
    return 0


if __name__ == "__main__":
    sys.exit(main())
