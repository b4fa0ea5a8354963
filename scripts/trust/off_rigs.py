"""Whether a check distinguishes mistakes in recordings from numbers of the rig that are off.

    python scripts/trust/off_rigs.py [--count 200] [--seed 0] [--exact] [--workers 2] [--stopped]
        [--json FILE]

Each case is a recording of one of ten rigs whose true numbers are off those of its file: valves by
a factor of up to 4, volume and damping 3, forces and stiffness 1.5, the mounting of each muscle by
3 % of its length; half of the joints have dry friction that the file has not. Commands are set
points, the measured pressures, or a torque on a joint between sealed muscles. `pamsim.check` reads
each as it is, where a suspicion is false, and with one mistake of unit or sign, whose correction it
must name. With ``--exact`` the rigs are as their files say.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import pamsim
from pamsim.core.errors import PamsimError
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.papers.bench_experiments import bench
from pamsim.recordings.recording import write_recording

sys.path.insert(0, str(Path(__file__).parents[1]))
from first_calibration import INPUTS, TEMPLATES, rig_of
from records import fingerprint, kept_rows, print_and_write, study_parser
from unit_slips import ATMOSPHERE, MBAR, PSI, Table, altered, checked, plus, times

KEPT = Path("out/off_rigs")
SHIPPED = ("mas20_arm", "two_joint_arm", "muscle_bench", "equimus_leg")
BENCHES = ("sarosi", "alraouf2025")
RIGS = (*TEMPLATES, *SHIPPED, *BENCHES)
OF_MUSCLES = {
    "valve.conductance_fill": 4.0,
    "valve.conductance_exhaust": 4.0,
    "chamber.dead_volume": 3.0,
    "force.scale": 1.5,
    "force.area": 1.5,
    "force.stiffness": 1.5,
    "passive.stiffness": 1.5,
}
"""Number -> factor by which it may be off."""
DAMPING, MOUNTING = 3.0, 0.03
FRICTION = {"angle": 0.3, "position": 3.0}
"""Largest dry friction of a joint [N m or N]."""
READ = {r".*_deg": 0.05, r"(?!.*_set).*_kpa": 0.4, r".*(force\d|muscle|rod)_n": 1.0}
"""Columns -> noise [their unit]."""

MISTAKES = {
    "measured pressures in mbar": (times(r"(?!.*_set).*_kpa", MBAR), "mbar"),
    "measured pressures in psi": (times(r"(?!.*_set).*_kpa", PSI), "psi"),
    "measured pressures absolute": (plus(r"(?!.*_set).*_kpa", ATMOSPHERE), "absolute"),
    "all pressures in mbar": (times(r".*_kpa", MBAR), "mbar"),
    "angles in rad": (times(r".*_deg", np.pi / 180.0), r"\brad\b"),
    "angles negated": (times(r".*_deg", -1.0), "sign"),
    "time in minutes": (times("time_s", 1.0 / 60.0), r"minutes|min\b"),
    "time in ms": (times("time_s", 1e3), r"milliseconds|ms\b"),
}


def off(rig: Rig, rng: np.random.Generator) -> Rig:
    """The rig as it may be in truth."""
    true: dict[str, float] = {}

    def scaled(name: str, factor: float) -> None:
        try:
            value = rig_parameter(rig, name).value
        except PamsimError:  # the rig has none
            return
        if rng.random() < 0.6:
            true[name] = value * factor ** rng.uniform(-1.0, 1.0)

    for name, factor in OF_MUSCLES.items():
        scaled(name, factor)
    for joint, kind in rig.joints.items():
        scaled(f"joint.{joint}.damping", DAMPING)
        if rng.random() < 0.5:
            true[f"joint.{joint}.frictionloss"] = rng.uniform(0.0, FRICTION[kind])
    for muscle, one in rig.muscles.items():
        reach = MOUNTING * (one.stroke or one.braided).nominal_length
        length = one.mounting.length_at_zero + reach * rng.uniform(-1.0, 1.0)
        true[f"{muscle}:mounting.length_at_zero"] = length
    return rig.with_parameters(true)


def record(rig: Rig, true: Rig, folder: Path, rng: np.random.Generator) -> str:
    """Write a recording; what was done is returned."""
    turning = [joint for joint, kind in rig.joints.items() if kind == "angle"]
    if turning and len(rig.joints) == 1 and rng.random() < 0.3:
        time = np.arange(601) / 50.0
        torque = np.interp(time, np.linspace(0.0, 12.0, 9), [0.0, *rng.uniform(-3.0, 3.0, 7), 0.0])
        shut = np.zeros((time.size, len(rig.muscles)))
        swing = pamsim.Experiment(
            drive={**dict.fromkeys(rig.muscles, "sealed"), turning[0]: "torque"},
            command_time=time,
            command_value=np.column_stack([shut, torque]),
            start_pressure=np.full(len(rig.muscles), rng.uniform(0.3, 0.7) * rig.supply_pressure),
            duration=12.0,
            sample_rate=50.0,
        )
        runs = {"swing": pamsim.simulate(true, swing).completed()}
        exact = folder.with_name("exact")
        write_recording(exact, str(rig.file.folder), runs)
        altered(exact, folder, lambda table: add_noise(table, rng))
        return "sealed, driven by a torque"
    measured = bool(rng.random() < 0.2)
    inputs = tuple(str(name) for name in rng.choice(INPUTS, size=2, replace=False))
    recording = pamsim.hide(
        true,
        {},
        duration=4.0,
        repeats=2,
        seed=int(rng.integers(1 << 30)),
        protocols=inputs,
        forces=bool(rng.random() < 0.5),
        measured_drive=measured,
    )
    recording.save(folder)
    return f"{' and '.join(inputs)}, {'measured pressures' if measured else 'set points'}"


def add_noise(table: Table, rng: np.random.Generator) -> None:
    """Add the sensors' noise to what was simulated."""
    for name in table:
        for pattern, noise in READ.items():
            if re.fullmatch(pattern, name):
                table[name] = table[name] + noise * rng.standard_normal(table[name].size)


def run_one(kind: str, name: str, seed: int) -> dict[str, Any]:
    """One recording, read as it is (``valid``) or with a mistake (``mistake``); of an exact rig."""
    kind, _, exact = kind.partition(" ")
    rng = np.random.default_rng((seed, RIGS.index(name)))
    with tempfile.TemporaryDirectory() as place:
        rig = bench(name) if name in BENCHES else rig_of(name, Path(place))
        folder = Path(place) / "data"
        try:
            what = record(rig, rig if exact else off(rig, rng), folder, rng)
        except PamsimError as error:  # such as a muscle longer than its fibres
            return {"not_made": str(error)}
        row: dict[str, Any] = {"rig": name, "seed": seed, "what": what}
        if kind == "valid":
            how, reported = checked(folder)
            return {**row, "how": how, "reported": reported}
        columns = next(folder.glob("*.csv")).read_text(encoding="utf-8").split("\n")[0].split(",")
        possible = [m for m, (change, _) in MISTAKES.items() if _changes(change, columns)]
        mistake = str(rng.choice(possible))
        change, correction = MISTAKES[mistake]
        altered(folder, Path(place) / "mistaken", change)
        how, reported = checked(Path(place) / "mistaken")
        named = bool(re.search(correction, " ".join(reported)))
        return {**row, "mistake": mistake, "how": how, "named": named, "reported": reported}


def _changes(change: Any, columns: list[str]) -> bool:
    table = {name: np.ones(1) for name in columns}
    change(table)
    return any(values[0] != 1.0 for values in table.values())


def counted(rows: Mapping[Any, Mapping[str, Any]]) -> dict[str, Any]:
    """Counts of both kinds, and every row that went wrong."""
    made = {task: row for task, row in rows.items() if "not_made" not in row}
    valid = [row for (kind, *_), row in made.items() if kind.startswith("valid")]
    mistaken = [row for (kind, *_), row in made.items() if kind.startswith("mistake")]
    alarms = [row for row in valid if row["how"] != "silent"]
    missed = [row for row in mistaken if not row["named"]]
    return {
        "not_made": len(rows) - len(made),
        "valid": len(valid),
        "false_alarms": len(alarms),
        "mistakes": len(mistaken),
        "named": len(mistaken) - len(missed),
        "each_false_alarm": alarms,
        "each_missed": missed,
    }


def main() -> None:
    """Run what is left, count, write."""
    parser = study_parser(__doc__, count=200, seed=0)
    parser.add_argument("--exact", action="store_true", help="rigs as their files say")
    options = parser.parse_args()
    exact = " exact" if options.exact else ""
    cases = [(RIGS[k % len(RIGS)], options.seed + k) for k in range(options.count)]
    kinds = [f"{kind}{exact}" for kind in ("valid", "mistake")]
    tasks = [(kind, *case) for case in cases for kind in kinds]
    mark = fingerprint("pamsim", __file__)
    folder = KEPT / f"{options.seed}_{options.count}{exact.strip()}"
    rows = kept_rows(run_one, tasks, folder, mark, options.workers, stopped=options.stopped)
    command = f"python scripts/trust/off_rigs.py --count {options.count} --seed {options.seed}"
    command += " --exact" * options.exact
    result = {"command": command, **counted(rows)}
    print_and_write(result, options.json)


if __name__ == "__main__":
    main()
