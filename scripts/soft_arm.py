"""A soft arm, link by link: identified on January 10, predicted on January 23.

FOLDER is a copy of github.com/ASU-RISE-Lab/4-chamber-softarm-control, commit 9fe7de6 (MIT). Its two
segments have a right and a left chamber each; wanted and measured pressures [psi] and the positions
of the arm's middle and tip [m] are in 38 columns without a header. Every fit, and the choice of its
structure, sees January 10 alone; every error is compared with what the repeats of a day differ by.

    python scripts/soft_arm.py FOLDER --json scripts/results/soft_arm.json [--only PART]

PART is links: transfer functions from the wanted to the measured pressures, and from those to the
positions; rigs: one chamber between two valves in place of a regulator's transfer function; or
diagnosis: what such a rig misses if both valves have one conductance. It needs rigs.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from records import head, parser, run_parts

import pamsim
from pamsim.comparison.measurements import read_calibration_data
from pamsim.comparison.trial_prediction import TrialPredictor
from pamsim.core.units import FloatArray
from pamsim.identification.data import read_data, trials_of
from pamsim.identification.model import IdentifiedModel
from pamsim.identification.records import SignalRecord
from pamsim.identification.result import Identification
from pamsim.identification.signals import signal, used_trial

OUT = Path(__file__).parents[1] / "out" / "soft_arm"
COMMAND = "python scripts/soft_arm.py FOLDER --json scripts/results/soft_arm.json"
DATA = Path("data-collection/2023")
BOTH, LEFT, RIGHT = ("Jan 10-2",), ("Jan 10-3",), ("Jan 10-4", "Jan 10-5", "Jan 10-6")
"""Days on which both chambers of a segment are driven, or one."""
LATER = "Jan 23-1"
"""Both chambers, up to 10 and 15 psi."""
CHAMBERS = {"right 1": (2, 5), "left 1": (3, 6), "right 2": (8, 11), "left 2": (9, 12)}
"""Chamber -> columns of its wanted and of its measured pressure."""
SWITCHES = (5.0, 15.0, 25.0)
"""After each, the next change of a wanted pressure begins a hold [s]: they come every 10 s."""
HOLD, RATE = 9.8, 20.0
"""Time that is compared of every hold [s], and how often [Hz]: below the logger's 30 Hz or so."""
SMALL = "first_order_dead_time"
"""The model that stands beside the chosen one."""

PSI = 6894.757
"""[Pa]"""
WEIGHT = 50
"""More than the muscle lifts at 1 bar [kg]: the volume of the chamber does not change."""
BOUNDS = {
    "valve.conductance_fill": (1e-11, 1e-7),
    "valve.conductance_exhaust": (1e-11, 1e-7),
    "sensor.pressure_bias": (-2e4, 2e4),
}
"""What is calibrated, and within what [SI]: far more than a valve or a sensor can be off."""
EFFECTS = (
    "valve_asymmetry", "valve_delay", "line_lag", "valve_slew", "regulator_dead_band",
    "least_set_point", "pressure_scale", "air_leak",
)  # fmt: skip
"""What a regulator and its sensor may miss."""
DIAGNOSED = "right 2"
KEPT = ("verdict", "sentence", "links", "effects", "remainder", "gap")
"""Of a diagnosis, in the record."""
RECORDING = """schema = "pamsim-recording/2"
rig = "{rig}"

[columns]
time = {{ column = "column_1", unit = "s" }}
"lifter.pressure_set" = {{ column = "column_{wanted}", unit = "psi" }}
"lifter.pressure" = {{ column = "column_{measured}", unit = "psi" }}
"""
TRIAL = """
[[trial]]
file = "{file}"
protocol = "{day}"
drive = "pressure_set"
rate = "{rate} Hz"
load_kg = {weight}
"""


@dataclass(frozen=True)
class Link:
    """One output, the columns that drive it, and the days that it is fitted to and judged by."""

    inputs: tuple[str, ...]
    output: str
    fitted: tuple[str, ...]
    judged: str = LATER
    factor: float = 1e3  # to mm; pressures stay in psi


SUMS, DIFFERENCES = (
    tuple(f"column_{right}{sign}column_{right + 1}" for right in (5, 11)) for sign in "+-"
)
SIDEWAYS = "column_32-column_18"
LINKS = {
    f"regulator {name}, {which}": Link(
        (f"column_{wanted}",), f"column_{measured}", BOTH + more, factor=1.0
    )
    for name, (wanted, measured) in CHAMBERS.items()
    for which, more in (("10-2", ()), ("all", LEFT if name.startswith("left") else RIGHT))
} | {
    "height of the middle": Link(SUMS[:1], "column_27", BOTH),
    "tip below the middle": Link(SUMS[1:], "column_34-column_27", BOTH),
    "height of the tip": Link(SUMS, "column_34", BOTH),
    "tip sideways": Link(DIFFERENCES, SIDEWAYS, LEFT + RIGHT),
    "tip sideways, 10-6": Link(DIFFERENCES, SIDEWAYS, RIGHT[:2], RIGHT[2]),
}


def files(folder: Path, *days: str) -> list[Path]:
    """Logs of some days."""
    return [log for day in days for log in sorted((folder / DATA / day).glob("data_collect_*"))]


def holds(log: Path) -> FloatArray:
    """Times at which a hold is compared, (holds, n) [s], each counted from the log's own switch."""
    table = np.genfromtxt(log, delimiter=",")
    wanted = table[:, [column - 1 for column, _ in CHAMBERS.values()]]
    times = table[1:, 0][np.any(np.diff(wanted, axis=0) != 0.0, axis=1)]
    return np.add.outer(
        [times[times > after][0] for after in SWITCHES], np.arange(0.0, HOLD, 1.0 / RATE)
    )


def rms(errors: FloatArray) -> float:
    """Over all trials and holds."""
    return float(np.sqrt(np.mean(np.square(errors))))


class Day:
    """Logs of some days as identification reads one link of them."""

    def __init__(self, folder: Path, link: Link, *days: str) -> None:
        self.logs = files(folder, *days)
        tables = trials_of(read_data(self.logs), time="column_1").tables
        inputs, output = tuple(signal(i, tables) for i in link.inputs), signal(link.output, tables)
        self.trials = [used_trial(table, inputs, output)[0].record for table in tables]
        self.factor = link.factor

    def in_holds(self, signals: Sequence[FloatArray]) -> FloatArray:
        """A signal of every trial in its holds, (trials, holds, n)."""
        return self.factor * np.stack(
            [
                np.interp(holds(log), trial.time, values)
                for log, trial, values in zip(self.logs, self.trials, signals, strict=True)
            ]
        )

    @property
    def output(self) -> FloatArray:
        """What was measured in the holds."""
        return self.in_holds([trial.output for trial in self.trials])

    def errors(self, model: IdentifiedModel) -> FloatArray:
        """Measured minus simulated, a constant of each trial taken off."""
        return self.in_holds([trial.output - model.simulate(trial) for trial in self.trials])

    def constants(self, model: IdentifiedModel) -> FloatArray:
        """Of every trial, the output at which the model rests without any input."""

        def rest(trial: SignalRecord) -> float:
            own = model.structure.free_run(model.coordinates, trial)[1]
            return own[0] - trial.inputs[0] @ [channel.gain for channel in model.channels]

        return self.factor * np.array([rest(trial) for trial in self.trials])


def floor(output: FloatArray) -> float:
    """What repeats differ by about their mean."""
    return float(np.sqrt(np.mean(np.var(output, axis=0, ddof=1))))


def identified(folder: Path, link: Link) -> dict[str, Any]:
    """Identify a link on the days fitted; predict the other day."""
    fitted, later = Day(folder, link, *link.fitted), Day(folder, link, link.judged)
    found = pamsim.identify(
        fitted.logs, time="column_1", input=link.inputs, output=link.output, local=False
    )
    assert isinstance(found, Identification)
    models: dict[str, Any] = {}
    for one in (found.shown, *(c for c in found.candidates if c.name == SMALL)):
        left = later.errors(one.fit)
        models[one.name] = {
            "status": str(one.fit.status),
            "estimates": {e.name: e.value for e in one.fit.estimates},
            "rms_fitted": rms(fitted.errors(one.fit)),
            "rms_constant_free": rms(left),
        }
        structure = one.fit.structure
        if one.fit.status != "at_bound" and not (structure.integrators or structure.drift):
            # Others have no output at rest that could be carried from one day to the other.
            moved = later.constants(one.fit) - fitted.constants(one.fit).mean()
            models[one.name]["constant_moved"] = float(moved.mean())
            models[one.name]["rms"] = rms(left + moved[:, np.newaxis, np.newaxis])
    return {
        "fitted": link.fitted,
        "judged": link.judged,
        "stroke": float(np.ptp(later.output[..., -1].mean(axis=0))),
        "floor_fitted": floor(Day(folder, link, link.fitted[0]).output),
        "floor": floor(later.output),
        "chosen": found.shown.name,
        "recommended": found.recommendation.name,
        "missing": found.recommendation.missing,
        "models": models,
    }


def protocol(day: str) -> str:
    """Name of a day in a recording."""
    return day.replace(" ", "_").replace("-", "_")


def recording(folder: Path, chamber: str, *days: str) -> Path:
    """Logs of some days as a recording of one chamber."""
    made = OUT / f"{chamber} {days[0]}"
    made.mkdir(parents=True, exist_ok=True)
    wanted, measured = CHAMBERS[chamber]
    text = RECORDING.format(rig=OUT / "regulator", wanted=wanted, measured=measured)
    for log in files(folder, *days):
        day = protocol(log.parent.name)
        shutil.copy(log, made / f"{day}_{log.stem[-1]}.txt")
        text += TRIAL.format(file=f"{day}_{log.stem[-1]}.txt", day=day, rate=RATE, weight=WEIGHT)
    (made / "recording.toml").write_text(text, encoding="utf-8")
    return made


def rig_errors(rig: pamsim.Rig, source: Path, logs: Sequence[Path]) -> FloatArray:
    """Measured minus simulated pressure in the holds, (trials, holds, n) [psi]."""
    data, channel = read_calibration_data([source]).of_rig(rig), "lifter.pressure"
    (found,) = TrialPredictor(rig, data, channels=("pressure",)).predictions([rig])
    assert found is not None
    left = [t.measured[channel] - found.trials[t.name][channel] for t in data.trials]
    return np.stack(
        [
            np.interp(holds(log), trial.time, values / PSI)
            for log, trial, values in zip(logs, data.trials, left, strict=True)
        ]
    )


def calibrated(folder: Path, chamber: str, workers: int) -> dict[str, Any]:
    """Calibrate the rig of a chamber on January 10, predict January 23."""
    days = BOTH + (LEFT if chamber.startswith("left") else RIGHT[:1])
    source, later = recording(folder, chamber, *days), recording(folder, chamber, LATER)
    fit = pamsim.calibrate(
        [source],
        free=tuple(BOUNDS),
        bounds=BOUNDS,
        channels=["pressure"],
        threads=workers,
        out=OUT / chamber,
    )
    rig = pamsim.load_rig(OUT / chamber / "rig")
    left = rig_errors(rig, later, files(folder, LATER))
    return {
        "fitted": days,
        "parameters": {p.name: [p.value, *(p.interval95 or ())] for p in fit.parameters},
        "rms_fitted": rms(rig_errors(rig, source, files(folder, *days))),
        "rms": rms(left),
        "rms_constant_free": rms(left - left.mean(axis=(1, 2), keepdims=True)),
    }


def diagnosis(folder: Path, workers: int) -> dict[str, Any]:
    """What a rig with one conductance for both valves misses on January 10."""
    rig = pamsim.load_rig(OUT / DIAGNOSED / "rig")
    same = rig.muscles["lifter"].valve.conductance_fill
    report = pamsim.diagnose(
        [recording(folder, DIAGNOSED, *BOTH, RIGHT[0])],
        rig=rig.with_parameters({"valve.conductance_exhaust": same}),
        effects=EFFECTS,
        nuisance=("valve.conductance_fill",),
        hold_out=[protocol(RIGHT[0])],
        threads=workers,
    )
    print(report.summary())
    kept = report.to_dict()
    return {key: kept[key] for key in KEPT}


def main() -> None:
    """Do what is asked for and write the record."""
    options = parser(__doc__, workers=2)
    options.add_argument("folder", type=Path, help="the authors' repository")
    options.add_argument("--only", choices=("links", "rigs", "diagnosis"))
    asked = options.parse_args()
    folder = asked.folder
    source = "github.com/ASU-RISE-Lab/4-chamber-softarm-control, commit 9fe7de6, MIT"
    pamsim.new_rig("regulator", "bench", out=OUT / "regulator", force=True)
    jobs = {
        "links": lambda: {name: identified(folder, link) for name, link in LINKS.items()},
        "rigs": lambda: {name: calibrated(folder, name, asked.workers) for name in CHAMBERS},
        "diagnosis": lambda: diagnosis(folder, asked.workers),
    }
    run_parts(asked.json, head(COMMAND) | {"data": source}, jobs, asked.only)


if __name__ == "__main__":
    main()
