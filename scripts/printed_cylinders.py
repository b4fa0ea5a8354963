"""Seal friction of printed cylinders: over pressure, and at pressures that no fit has seen.

FOLDER is a copy of github.com/EvaZillen/3D-printed-pneumatic-actuator at commit 6e0bcb4 (CC0). A
carriage moves a cylinder to and fro at one regulated pressure; position, pressure and force are
read. Here the position is imposed, the pressure is the measured one, and the force is compared.

    python scripts/printed_cylinders.py FOLDER [--workers 2]

Each pressure between the lowest and the highest is left out in turn.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pictures import save_small_png
from records import RESULTS, parser, write

import pamsim
from pamsim.comparison.measurements import read_calibration_data
from pamsim.comparison.trial_prediction import TrialPredictor
from pamsim.core.computation import versions
from pamsim.core.units import FloatArray
from pamsim.report.style import finish_axes, new_figure, series_look, styled

ROOT = Path(__file__).parents[1]
RIG = ROOT / "scripts" / "printed_cylinder"
OUT = ROOT / "out" / "printed_cylinders"
SCHEMA = "pamsim-printed-cylinders/1"

DATA = Path("results_pneumatic-actuator/data")
SEALS = dict.fromkeys(("O-ring", "NAPN", "NAP310", "PK", "KDN"), 25.0)
SEALS |= {"O-ring257": 25.7, "X-ring257": 25.7}
"""Seal -> diameter of its bore [mm], results_friction_force.py."""
BARS = (1, 3, 5, 7)
RERUNS = tuple(f"repeatability/rerun/friction/{number}_" for number in (1, 2, 3))
COPIES = "repeatability/reconnected/friction/2_"
"""Said to be byte copies of the second rerun."""

BEGIN, END = 10.0, 30.0  # of a log that is used [s]: three strokes or more
RATE = 50.0  # [Hz]
SLOW = 1e-3  # a rod that moves slower is turning round [m/s]
MIDDLE = (0.25, 0.75)  # of the stroke, where friction is read
MODELS = {
    "in proportion to pressure": ("force.area", "friction.coulomb_force", "friction.tension_share"),
    "the same at every pressure": ("force.area", "friction.coulomb_force"),
}
RECORDING = """schema = "pamsim-recording/2"
rig = "{rig}"

[columns]
time = {{ column = "ms", unit = "ms" }}
"rod.position" = {{ column = "mm", unit = "mm", sign = -1 }}
"rod.force" = {{ column = "n", unit = "N", sign = -1 }}
"piston.pressure" = {{ column = "bar", unit = "bar" }}
"""
TRIAL = """
[[trial]]
file = "{bar}.csv"
protocol = "bar_{bar}"
drive = {{ piston = "measured", rod = "length" }}
"""


def table(path: Path) -> FloatArray:
    """Time [ms], position [mm], pressure [bar] and force [N] of a log without a header."""
    text = path.read_text(encoding="ascii").replace("\r", "\n")
    return np.array([[float(c) for c in line.split()] for line in text.splitlines() if line])[
        :, [0, 4, 5, 6]
    ]


def recording(folder: Path, seal: str, prefix: str = "friction/") -> Path:
    """Some strokes of a seal at every pressure, with a header, as a recording."""
    made = OUT / (prefix.replace("/", "_") + seal)
    made.mkdir(parents=True, exist_ok=True)
    for bar in BARS:
        log = table(folder / DATA / f"{prefix}{seal}_{bar}bar.csv")
        # The logger stops for 0.3 s where the carriage turns round; that is bridged.
        clock = np.arange(BEGIN, END, 1.0 / RATE) * 1e3
        log = np.column_stack([clock, *(np.interp(clock, log[:, 0], c) for c in log.T[1:])])
        rows = "\n".join(",".join(f"{number:.7g}" for number in row) for row in log)
        (made / f"{bar}.csv").write_text(f"ms,mm,bar,n\n{rows}\n", encoding="utf-8")
    text = RECORDING.format(rig=RIG) + "".join(TRIAL.format(bar=bar) for bar in BARS)
    (made / "recording.toml").write_text(text, encoding="utf-8")
    return made


def ways(position: FloatArray, time: FloatArray) -> tuple[NDArray[np.bool], NDArray[np.bool]]:
    """Samples at mid-stroke at which a rod moves out, and back; position in m, time in s."""
    speed = np.gradient(np.convolve(position, np.ones(9) / 9.0, mode="same"), time)
    low, high = np.quantile(position, MIDDLE)
    inside = (position > low) & (position < high)
    return inside & (speed > SLOW), inside & (speed < -SLOW)


def frictions(source: Path, rig: pamsim.Rig | None = None) -> dict[int, float]:
    """Pressure [bar] -> friction [N], measured or, of a rig, simulated.

    It is half of what the force less pressure times area differs by between the two directions.
    """
    data = read_calibration_data([source])
    model = rig or pamsim.load_rig(RIG)
    data = data.of_rig(model)
    predictor = TrialPredictor(model, data, channels=("force",))
    (prediction,) = predictor.predictions([model])
    assert prediction is not None
    area = model.muscles["piston"].force.area  # pyright: ignore[reportAttributeAccessIssue]
    found: dict[int, float] = {}
    for trial in data.trials:
        force = trial.measured["rod.force"]
        if rig is not None:
            force = prediction.trials[trial.name]["rod.force"]
        command = dict(zip(("pressure", "position"), trial.command.T, strict=True))
        rest = force + command["pressure"] * area
        bar = int(trial.protocol.removeprefix("bar_"))
        out, back = ways(command["position"], trial.time)
        found[bar] = 0.5 * float(rest[out].mean() - rest[back].mean())
    return found


def areas(source: Path) -> dict[int, float]:
    """Pressure [bar] -> mean force of the two directions over pressure [m^2]."""
    found: dict[int, float] = {}
    for trial in pamsim.read_recordings(source).trials:
        pressure, position = trial.command.T
        ratio = [
            -trial.measured["rod.force"][way].mean() / pressure[way].mean()
            for way in ways(position, trial.time)
        ]
        found[int(trial.protocol.removeprefix("bar_"))] = float(np.mean(ratio))
    return found


def seal_result(folder: Path, seal: str, workers: int) -> dict[str, Any]:
    """Friction of a seal over pressure, and what fits to other pressures predict."""
    source = recording(folder, seal)
    measured = frictions(source)
    rig = pamsim.load_rig(RIG).with_parameters(
        {"force.area": 0.25 * math.pi * (SEALS[seal] * 1e-3) ** 2}
    )
    held: list[dict[str, Any]] = []
    for bar in BARS[1:-1]:
        for model, free in MODELS.items():
            start = rig if "friction.tension_share" in free else rig.with_parameters(
                {"friction.tension_share": 0.0}
            )  # fmt: skip
            fit = pamsim.calibrate(
                [source],
                rig=start,
                free=free,
                channels=["force"],
                hold_out=[f"bar_{bar}"],
                threads=workers,
            )
            values = {p.name: p.value for p in fit.parameters}
            predicted = frictions(source, start.with_parameters(values))[bar]
            held.append(
                {
                    "held_out_bar": bar,
                    "model": model,
                    "fitted": values,
                    "friction": predicted,
                    "error": predicted / measured[bar] - 1.0,
                }
            )
            print(seal, held[-1])
    return {"friction": measured, "area": areas(source), "held_out": held}


def repeats(folder: Path) -> dict[str, Any]:
    """Friction of three reruns of one seal, and whether files are copies of each other."""
    runs = [frictions(recording(folder, "O-ring257", prefix)) for prefix in RERUNS]
    return {
        "friction": runs,
        "copies": {
            bar: (folder / DATA / f"{COPIES}O-ring257_{bar}bar.csv").read_bytes()
            == (folder / DATA / f"{RERUNS[1]}O-ring257_{bar}bar.csv").read_bytes()
            for bar in BARS
        },
    }


@styled
def friction_figure(record: dict[str, Any]) -> Figure:
    """Friction of every seal over pressure; held-out predictions as open marks."""
    figure, (ax,) = new_figure(3.6)
    for index, (seal, result) in enumerate(record["seals"].items()):
        colour, _ = series_look(index)
        dashed = "--" if index > 4 else "-"
        pressures = sorted(map(int, result["friction"]))
        forces = [result["friction"][str(bar)] for bar in pressures]
        ax.plot(pressures, forces, dashed, color=colour, marker="o", label=seal)
        for held in result["held_out"]:
            if held["model"] == next(iter(MODELS)):
                ax.plot(
                    held["held_out_bar"], held["friction"], "o", color=colour, mfc="none", ms=10
                )
    ax.set_ylim(bottom=0.0)
    ax.legend(loc="upper left", ncols=4)
    finish_axes(ax, x="pressure [bar]", y="friction [N]", zero=False)
    return figure


def main() -> None:
    """Run all seals and write the record."""
    options = parser(__doc__, RESULTS / "printed_cylinders.json", workers=2)
    options.add_argument("folder", type=Path, help="the author's repository")
    asked = options.parse_args()
    record: dict[str, Any] = {
        "schema": SCHEMA,
        "command": "python scripts/printed_cylinders.py FOLDER",
        "data": "github.com/EvaZillen/3D-printed-pneumatic-actuator, commit 6e0bcb4, CC0",
        "versions": versions("scipy"),
        "seconds": [BEGIN, END],
        "seals": {},
        "repeats": repeats(asked.folder),
    }
    for seal in SEALS:
        record["seals"][seal] = seal_result(asked.folder, seal, asked.workers)
        write(json.loads(json.dumps(record)), asked.json)
    save_small_png(friction_figure(json.loads(json.dumps(record))), "printed_cylinders")


if __name__ == "__main__":
    main()
