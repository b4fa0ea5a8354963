"""Whether mistakes in units, signs and columns are refused or named, and valid recordings not.

    python scripts/trust/unit_slips.py [--seed 0] [--json FILE]

Recordings of three kinds (set points with measured forces, valves in the independent plant, an arm
of two joints and four muscles) are simulated with noise and an effect that the rig as it is does
not have. Each mistake alters the numbers of one of them and leaves the names of its columns, as a
person does who logs mbar and writes kPa. Then `pamsim.check` reads it. A mistake counts as found
if the refusal or the suspicion names its correction. Valid recordings, of many kinds and of rigs
that are not calibrated, must raise no suspicion. Exits 1 if less than nine in ten mistakes are
found, or a valid recording is suspected.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

import pamsim
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.twins.synthetic_recording import SyntheticRecording

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[1]))
from records import head, parser, print_and_write

import tests.plant.hide

Table = dict[str, FloatArray]
Change = Callable[[Table], None]

EFFECTS = ("viscous_friction",)  # whose visibility a check computes besides
FOUND = 0.9
"""Share of the mistakes that must be found."""

BAR, MBAR, MMHG, PSI, ATMOSPHERE = 0.01, 10.0, 7.50062, 0.1450377, 101.325  # of a kPa, and in kPa
MEASURED = r"p\d_kpa|(?!.*_set).*_kpa"
SET = r".*_set_kpa"
PRESSURES = r".*_kpa"


@dataclass(frozen=True, kw_only=True)
class Made:
    """How a recording is made.

    Attributes:
        rig: name.
        effects: hidden, as `pamsim.hide` takes them.
        parameters: of the rig in truth -> factor on its own.
        options: further arguments of `pamsim.hide`.
        hide: `pamsim.hide`, or that of the independent plant.
    """

    rig: str = "mas20_arm"
    effects: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    hide: Callable[..., SyntheticRecording] = pamsim.hide

    def save(self, folder: Path, seed: int) -> None:
        """Simulate and write it; it names the shipped rig, whatever the true parameters are."""
        rig: Rig = pamsim.load_rig(self.rig)
        true = {n: f * rig_parameter(rig, n).value for n, f in self.parameters.items()}
        rig = rig.with_parameters(true)
        settings = {"duration": 4.0, "repeats": 2, **self.options, "seed": seed}
        self.hide(rig, self.effects, **settings).save(folder)


ALTERED = {
    "set points": Made(
        effects={"coulomb_friction": 1.0},
        options={"protocols": ("triangle", "staircase")},
    ),
    "valves": Made(
        effects={"viscous_friction": 1.0},
        options={"formulation": "plant", "protocols": ("bursts",), "forces": False},
        hide=tests.plant.hide.hide,
    ),
    "two joints": Made(
        rig="two_joint_arm",
        effects={"coulomb_friction at elbow": 1.0},
        options={"protocols": ("staircase", "multisine"), "forces": False},
    ),
}
"""Recordings in which mistakes are made."""

EVERY = ("triangle", "staircase", "multisine", "cocontraction", "bursts", "loaded_steps")
VALID = {
    **ALTERED,
    "every input": Made(options={"protocols": EVERY}),
    "drifting noise": Made(options={"coloured": True, "noise": 3.0, "protocols": ("multisine",)}),
    "measured drive": Made(options={"measured_drive": True, "protocols": ("triangle",)}),
    "one log": Made(options={"repeats": 1, "protocols": ("staircase",), "duration": 12.0}),
    "quantised": Made(options={"quantised": True, "protocols": ("bursts",)}),
    "cocontraction alone": Made(options={"protocols": ("cocontraction",)}),
    "small steps under a load": Made(options={"protocols": ("loaded_steps",)}),
    "leak": Made(effects={"air_leak": 3.0}, options={"protocols": ("staircase", "bursts")}),
    "sensor zero": Made(effects={"pressure_bias": 3.0}, options={"protocols": ("triangle",)}),
    "angle zero": Made(effects={"angle_bias": 3.0}, options={"protocols": ("triangle",)}),
    "much friction": Made(effects={"coulomb_friction": 4.0}, options={"protocols": ("triangle",)}),
    "muscles a third weaker": Made(
        parameters={"force.scale": 0.67}, options={"protocols": ("staircase", "bursts")}
    ),
    "valves half as wide": Made(
        parameters={"valve.conductance_fill": 0.5, "valve.conductance_exhaust": 0.5},
        options={"protocols": ("multisine", "bursts")},
    ),
    "damping three times": Made(
        parameters={"joint.shaft.damping": 3.0}, options={"protocols": ("bursts", "multisine")}
    ),
    "sprockets a third larger": Made(
        parameters={"tendon.chain_1.coef": 1.33, "tendon.chain_2.coef": 1.33},
        options={"protocols": ("staircase",)},
    ),
    "two joints, valves": Made(rig="two_joint_arm", options={"protocols": ("bursts",)}),
    "bench, stretched": Made(rig="muscle_bench", options={"protocols": ("stretch",)}),
    "bench, isometric": Made(rig="muscle_bench", options={"protocols": ("isometric",)}),
    "bench, a weight": Made(rig="muscle_bench", options={"protocols": ("staircase",)}),
}
"""Recordings that nothing is wrong with but the rig's numbers."""

SEEDED = 3
"""Seeds of each of `ALTERED` that are checked without a mistake; the other valid ones have one."""


def changed(pattern: str, new: Callable[[FloatArray], FloatArray]) -> Change:
    """Columns whose name matches, with new numbers."""

    def change(table: Table) -> None:
        for name in table:
            if re.fullmatch(pattern, name):
                table[name] = new(table[name])

    return change


def times(pattern: str, factor: float) -> Change:
    """Columns in another unit."""
    return changed(pattern, lambda values: values * factor)


def plus(pattern: str, offset: float) -> Change:
    """Columns from another zero."""
    return changed(pattern, lambda values: values + offset)


def swapped(*pairs: tuple[str, str]) -> Change:
    """Columns under each other's names."""

    def change(table: Table) -> None:
        for first, second in pairs:
            table[first], table[second] = table[second], table[first]

    return change


@dataclass(frozen=True)
class Mistake:
    """A mistake: what it is, in which recording, and a word of its correction."""

    what: str
    recording: str
    change: Change
    correction: str


def _mistakes() -> list[Mistake]:
    """All mistakes."""
    found: list[Mistake] = []

    def add(recording: str, what: str, change: Change, correction: str) -> None:
        found.append(Mistake(what, recording, change, correction))

    one, two, four = "set points", "valves", "two joints"
    units = {"mbar": MBAR, "mmHg": MMHG, "psi": PSI, "bar": BAR}
    for unit, factor in units.items():
        add(one, f"measured pressures in {unit}", times(MEASURED, factor), unit)
        add(one, f"all pressures in {unit}", times(PRESSURES, factor), unit)
    add(one, "set points times ten", times(SET, 10.0), r"mbar|0\.1\b")
    add(one, "set points in psi", times(SET, PSI), "psi")
    add(one, "measured pressures absolute", plus(MEASURED, ATMOSPHERE), "absolute")
    add(one, "all pressures absolute", plus(PRESSURES, ATMOSPHERE), "absolute")
    add(one, "one pressure absolute", plus("p2_kpa", ATMOSPHERE), "absolute")
    add(one, "one pressure in psi", times("p1_kpa", PSI), "psi")
    for name in (one, two):
        add(name, "angle in rad", times("angle_deg", np.pi / 180.0), "like rad")
        add(name, "angle in turns", times("angle_deg", 1.0 / 360.0), "like turns")
        add(name, "angle negated", times("angle_deg", -1.0), "sign")
    add(one, "forces in kN", times(r"force\d_n", 1e-3), "kN")
    add(one, "forces in kgf", times(r"force\d_n", 1.0 / 9.80665), "kgf")
    for name in (one, two, four):
        add(name, "time in minutes", times("time_s", 1.0 / 60.0), "minutes|min\\b")
        add(name, "time in ms", times("time_s", 1e3), "milliseconds|ms\\b")
    forces, read = ("force1_n", "force2_n"), ("p1_kpa", "p2_kpa")
    wanted = "p1_set_kpa", "p2_set_kpa"
    add(one, "muscles swapped in measured pressures", swapped(read), "swap")
    add(one, "muscles swapped in set points", swapped(wanted), "swap")
    add(one, "muscles swapped in both", swapped(read, wanted), "swap")
    add(one, "muscles swapped in forces", swapped(forces), "swap")
    for unit in ("mbar", "mmHg", "psi"):
        add(two, f"measured pressures in {unit}", times(MEASURED, units[unit]), unit)
    add(two, "measured pressures absolute", plus(MEASURED, ATMOSPHERE), "absolute")
    add(two, "muscles swapped in measured pressures", swapped(read), "swap")
    add(two, "muscles swapped in valves", swapped(("u1", "u2")), "swap")
    add(two, "muscles swapped in both", swapped(read, ("u1", "u2")), "swap")
    add(two, "valves negated", times(r"u\d", -1.0), "sign")
    add(four, "all pressures in mbar", times(PRESSURES, MBAR), "mbar")
    add(four, "measured pressures in psi", times(MEASURED, PSI), "psi")
    add(four, "measured pressures absolute", plus(MEASURED, ATMOSPHERE), "absolute")
    add(four, "set points times ten", times(SET, 10.0), r"mbar|0\.1\b")
    add(four, "both angles in rad", times(".*_deg", np.pi / 180.0), "like rad")
    add(four, "elbow in rad", times("elbow_deg", np.pi / 180.0), "like rad")
    add(four, "elbow negated", times("elbow_deg", -1.0), "sign")
    add(four, "joints swapped", swapped(("shoulder_deg", "elbow_deg")), "swap")
    read, wanted = ("biceps_kpa", "triceps_kpa"), ("biceps_set_kpa", "triceps_set_kpa")
    add(four, "muscles swapped in measured pressures", swapped(read), "swap")
    add(four, "muscles swapped in set points", swapped(wanted), "swap")
    add(four, "muscles swapped in both", swapped(read, wanted), "swap")
    return found


MISTAKES = _mistakes()


def altered(folder: Path, out: Path, change: Change) -> None:
    """A recording with every file's numbers changed."""
    out.mkdir()
    for path in folder.iterdir():
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".csv":
            header, *rows = text.splitlines()
            names = header.split(",")
            numbers = np.array([row.split(",") for row in rows], dtype=float)
            table = dict(zip(names, numbers.T, strict=True))
            change(table)
            cells = np.column_stack([table[name] for name in names])
            lines = (",".join(f"{value:.9g}" for value in row) for row in cells)
            text = "\n".join([header, *lines]) + "\n"
        (out / path.name).write_text(text, encoding="utf-8")


def checked(folder: Path) -> tuple[str, list[str]]:
    """How a recording is taken: ``refused``, ``suspected`` or ``silent``, and what is reported."""
    try:
        found = pamsim.check(folder, effects=EFFECTS)
    except InputError as error:
        return "refused", [str(error).replace(f"{folder}/", "")]
    reported = list(found.suspicions)
    return ("suspected" if reported else "silent"), reported


def named(mistake: Mistake, reported: Sequence[str]) -> bool:
    """Whether what is reported names the correction of a mistake."""
    return bool(re.search(mistake.correction, " ".join(reported)))


def run(seed: int) -> dict[str, Any]:
    """All mistakes and all valid recordings."""
    mistakes: list[dict[str, Any]] = []
    valid: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as place:
        for name, made in tqdm(VALID.items(), desc="valid", unit="kind"):
            for number in range(SEEDED if name in ALTERED else 1):
                folder = Path(place) / f"{name} {number}"
                made.save(folder, 100 * seed + number)
                how, reported = checked(folder)
                valid.append({"recording": name, "seed": 100 * seed + number, "how": how})
                valid[-1] |= {"reported": reported} if reported else {}
        for number, mistake in enumerate(tqdm(MISTAKES, desc="mistakes", unit="mistake")):
            folder = Path(place) / f"mistake {number}"
            altered(Path(place) / f"{mistake.recording} 0", folder, mistake.change)
            how, reported = checked(folder)
            mistakes.append({"recording": mistake.recording, "mistake": mistake.what, "how": how})
            mistakes[-1] |= {"correction_named": named(mistake, reported), "reported": reported}
    return {
        "mistakes": len(mistakes),
        "found": sum(one["correction_named"] for one in mistakes),
        "how": dict(Counter(one["how"] for one in mistakes)),
        "valid": len(valid),
        "false_alarms": sum(one["how"] != "silent" for one in valid),
        "each_mistake": mistakes,
        "each_valid": valid,
    }


def main() -> None:
    """Run, print, write."""
    options = parser(__doc__, seed=0).parse_args()
    command = f"python scripts/trust/unit_slips.py --seed {options.seed}"
    result = {**head(command), **run(options.seed)}
    print_and_write(result, options.json)
    sys.exit(int(result["found"] < FOUND * result["mistakes"] or result["false_alarms"] > 0))


if __name__ == "__main__":
    main()
