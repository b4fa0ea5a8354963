"""Hoses of 1 to 8 m, filled and vented: does the package's tube predict those that no fit has seen?

FOLDER is a copy of github.com/Foadsf/PneuAct_ICRA2018 at commit 066f640 (for scientific and
academic purposes). A hose is closed at one end, with valves at the other and a pressure sensor at
both. Held out are 3, 6 and 8 m, and 7 bar; one set of numbers is fitted to all other files.

    python scripts/hoses.py FOLDER --json scripts/results/hoses.json

The simulation is a row of volumes with links between them. One link is the package's tube,
`valve.tube_resistance` or, turbulent, `valve.tube_friction`, as a test checks against
`pamsim.simulate`; the others show what it misses.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numba
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pictures import save_small_png
from records import head, parser, write_rows
from scipy.optimize import least_squares

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.engine.jit import hand_to_numba, reached_functions
from pamsim.physics.air import ATMOSPHERE, GAS_CONSTANT, mass_flow
from pamsim.report.style import finish_axes, new_figure, styled
from pamsim.scene.series_colours import BLUE, VERMILION

NAME = re.compile(r"tube_l(\d)_p([\d.]+)_(start|end)(_1)?\.csv")
"""Files of one fill or one vent a run, by length [m] and pressure [bar]; others mix both."""
HELD_LENGTHS, HELD_BAR = (3, 6, 8), 7.0
"""Hoses [m] and pressure [bar] that no fit sees; 8 m extrapolates."""

AREA = 0.25 * math.pi * 4e-3**2
"""Section of a hose of 4 mm, assumed [m^2]: with another one all fitted numbers scale."""
PER_MASS = GAS_CONSTANT * 293.15
"""Pressure times volume per mass of air at 20 degrees Celsius, assumed [J/kg]."""
LAMINAR_RATIO = 0.99
"""Of the valves: a flow that sets in less steeply than by default, as the first volume is small."""
HORIZON = 400
"""Time that is simulated [ms]: twice that to 63 % of the longest hose."""
SEGMENT = 0.25
"""Length of a link of the models with many [m]: a wave passes it in 0.7 ms."""
STEP, SEGMENTS_STEP = 5e-5, 1e-4
"""Time steps with one link, and with many and the inertia that makes them smooth [s]."""
SHARE = 1.0 - math.exp(-1.0)
"""Of a step, at which its time is read."""
LOW, HIGH = 2.0, 6.0
"""Pressures [bar] of the two delays of a valve; between and beyond, a delay changes evenly."""

# Name -> start and bounds: conductances [m^3/(s Pa)], delays [ms], volume at both ends together as
# a length of hose [m], sag of the supply [Pa s/kg] with the volume of its line [m^3], resistance of
# a metre [Pa s/(kg m)] (less needs shorter steps), pressure lost in a metre times density over
# mass flow squared [1/m^5]. The index sets the speed of waves, 290 m/s to 343 m/s.
FREE = {
    "conductance_fill": (2e-9, 1e-10, 1e-7),
    "conductance_exhaust": (4e-9, 1e-10, 1e-7),
    "critical_ratio": (0.3, 0.01, 0.8),
    "delay_fill": (12.0, 0.1, 20.0),
    "delay_vent": (20.0, 0.1, 30.0),
    "end_length": (0.1, 0.001, 2.0),
    "supply_resistance": (3e7, 1e5, 1e10),
    "supply_volume": (1e-5, 1e-6, 1e-3),
    "delay_fill_high": (8.0, 0.1, 20.0),
    "delay_vent_high": (24.0, 0.1, 40.0),
    "resistance": (8e6, 2e6, 5e8),
    "friction": (1.5e10, 1e8, 1e13),
    "index": (1.2, 1.0, 1.4),
}
BASE, SUPPLY, LATE = tuple(FREE)[:6], tuple(FREE)[6:8], tuple(FREE)[8:10]
MODELS = {
    "volume alone": BASE,
    "package's tube": (*BASE, "resistance"),
    "and a supply that sags": (*BASE, *SUPPLY, "resistance"),
    "and delays by pressure": (*BASE, *SUPPLY, *LATE, "resistance"),
    "turbulent": (*BASE, *SUPPLY, *LATE, "friction"),
    "laminar, segments with inertia": (*BASE, *SUPPLY, *LATE, "resistance", "index"),
    "turbulent, segments with inertia": (*BASE, *SUPPLY, *LATE, "friction", "index"),
}
"""Name -> what is fitted; with an index, a hose is segments with the air's inertia, else one link.
"""
PICTURED = {"package's tube": "--", "turbulent, segments with inertia": "-"}
"""Model -> its line in the picture."""


@dataclasses.dataclass(frozen=True)
class Log:
    """The runs of a file: times [ms], runs' numbers, and pressures near and far (n, 2) [bar]."""

    metres: int
    bar: float
    fills: bool
    time: NDArray[np.int64]
    run: NDArray[np.int64]
    pressure: FloatArray

    @property
    def step(self) -> float:
        """Pressure at the end of a fill, or at the start of a vent [bar]."""
        last = np.diff(self.run, append=-1) != 0
        return float(np.median(self.pressure[last if self.fills else np.roll(last, 1)]))

    @property
    def group(self) -> str:
        """Which part of the data the file belongs to."""
        parts = [f"{self.metres} m"] if self.metres in HELD_LENGTHS else []
        return ", ".join(parts + ["7 bar"] * (self.bar == HELD_BAR)) or "fitted"

    def times(self, pressure: FloatArray) -> FloatArray:
        """Time to 63 % of the step at the far end of every run that shows it [ms]."""
        done = pressure[:, 1] / self.step if self.fills else 1.0 - pressure[:, 1] / self.step
        found: list[float] = []
        for run in np.unique(self.run):
            time, share = self.time[self.run == run], done[self.run == run]
            i = int(np.argmax(share >= SHARE))
            if share[i] >= SHARE and i > 0:
                part = (SHARE - share[i - 1]) / (share[i] - share[i - 1])
                found.append(float(time[i - 1] + part * (time[i] - time[i - 1])))
        return np.array(found)

    def floor(self) -> float:
        """RMS of what runs differ by at the same tick of the clock, as a share of the step."""
        total, count = 0.0, 0
        for tick in np.unique(self.time[self.time < HORIZON]):
            same = self.pressure[self.time == tick]
            total += float(((same - same.mean(axis=0)) ** 2).sum())
            count += same.size - 2
        return math.sqrt(total / count) / self.step


def read(path: Path) -> Log | None:
    """A file of the authors, without lines that are no samples; None for one of other contents."""
    if (name := NAME.fullmatch(path.name)) is None:
        return None
    lines = [line.split(",") for line in path.read_text(encoding="latin1").splitlines()]
    rows = np.array([line[:3] for line in lines if len(line) == 5], dtype=float)
    rows = rows[(rows[:, 0] < 1e5) & (np.abs(rows[:, 1:]) < 10.0).all(axis=1)]
    run = np.cumsum(np.diff(rows[:, 0], prepend=0.0) < 0.0, dtype=np.int64)
    return Log(
        int(name[1]), float(name[2]), name[3] == "start", rows[:, 0].astype(int), run, rows[:, 1:]
    )


hand_to_numba(reached_functions(mass_flow))


@numba.njit(error_model="numpy")
def simulated(dt: float, first: float, valve: Any, hose: Any, links: int) -> Any:
    """Absolute pressures (HORIZON, 2) at both ends of a hose, every millisecond [Pa]."""
    source, conductance, critical_ratio, delay, supply_resistance, supply_volume = valve
    volume, end_volume, resistance, friction, inertia, index = hose
    pressure, room = np.full(links + 1, first), np.full(links + 1, volume / max(links, 1))
    if links > 0:
        room[0] *= 0.5
        room[-1] *= 0.5
    room[0] += 0.5 * end_volume
    room[-1] += 0.5 * end_volume
    flow = np.zeros(links + 2)  # before each volume; nothing beyond the last
    line, found, steps = source, np.empty((HORIZON, 2)), round(1e-3 / dt)
    for tick in range(HORIZON * steps):
        if tick % steps == 0:
            found[tick // steps, 0], found[tick // steps, 1] = pressure[0], pressure[-1]
        opened = conductance * min(max(tick + 1.0 - delay / dt, 0.0), 1.0)
        flow[0] = mass_flow(line, pressure[0], opened, critical_ratio, LAMINAR_RATIO, 293.15)
        if supply_resistance > 0.0:
            given = (source - line) / supply_resistance
            line += dt * PER_MASS * (given - flow[0]) / supply_volume
        for i in range(1, links + 1):
            # I dm/dt = dp - R m - K m |m| / density, with m at the end of the step.
            stored = inertia / (links * dt)
            drive = pressure[i - 1] - pressure[i] + stored * flow[i]
            plain = resistance / links + stored
            density = 0.5 * (pressure[i - 1] + pressure[i]) / PER_MASS
            root = math.sqrt(plain * plain + 4.0 * abs(drive) * friction / links / density)
            flow[i] = 2.0 * drive / (plain + root) if drive != 0.0 else 0.0
        for i in range(links + 1):
            pressure[i] += dt * index * PER_MASS * (flow[i] - flow[i + 1]) / room[i]
    return found


def predicted(values: Mapping[str, float], log: Log) -> FloatArray:
    """Gauge pressures (n, 2) at the samples of a file [bar]; beyond HORIZON the last."""
    segments, step = "index" in values, ATMOSPHERE + log.step * PA_PER_BAR
    links = int("resistance" in values or "friction" in values)
    first, source = (ATMOSPHERE, step) if log.fills else (step, ATMOSPHERE)
    way, metres = "delay_fill" if log.fills else "delay_vent", float(log.metres)
    later = values.get(f"{way}_high", values[way]) - values[way]
    valve = (
        source,
        values["conductance_fill" if log.fills else "conductance_exhaust"],
        values["critical_ratio"],
        1e-3 * (values[way] + later * (log.bar - LOW) / (HIGH - LOW)),
        values.get("supply_resistance", 0.0) if log.fills else 0.0,
        values.get("supply_volume", 1.0),
    )
    hose = (
        AREA * metres,
        AREA * values["end_length"],
        values.get("resistance", 0.0) * metres,
        values.get("friction", 0.0) * metres,
        metres / AREA if segments else 0.0,
        values.get("index", 1.0),
    )
    links, dt = (round(metres / SEGMENT), SEGMENTS_STEP) if segments else (links, STEP)
    rows = simulated(dt, first, valve, hose, links)
    return (rows[np.minimum(log.time, HORIZON - 1)] - ATMOSPHERE) / PA_PER_BAR


def misses(values: Mapping[str, float], log: Log) -> FloatArray:
    """Simulated minus measured pressures before HORIZON, as shares of the step."""
    return ((predicted(values, log) - log.pressure) / log.step)[log.time < HORIZON]


def fitted(free: tuple[str, ...], logs: Iterable[Log]) -> dict[str, float]:
    """Numbers of a model that leave least of some files, which count equally."""
    start, low, high = np.log(np.array([FREE[name] for name in free])).T

    def cost(logged: FloatArray) -> FloatArray:
        values = dict(zip(free, np.exp(logged).tolist(), strict=True))
        missed = [misses(values, log).ravel() for log in logs]
        return np.concatenate([miss / math.sqrt(miss.size) for miss in missed])

    found = least_squares(cost, start, bounds=(low, high), diff_step=1e-3)
    return {name: float(f"{v:.4g}") for name, v in zip(free, np.exp(found.x), strict=True)}


def row(log: Log, fits: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    """Of a file: times [ms] and their scatter, floor, and time and RMS of every model [ms, %]."""
    runs = log.times(log.pressure)
    numbers = np.round([np.median(runs), runs.std(ddof=1), 100.0 * log.floor()], 3).tolist()
    found: dict[str, Any] = {"group": log.group, "metres": log.metres, "bar": log.bar}
    found |= {"fills": log.fills, "runs": runs.size}
    found |= dict(zip(("time", "scatter", "floor"), numbers, strict=True)) | {"models": {}}
    for name, values in fits.items():
        time, square = log.times(predicted(values, log)), np.mean(misses(values, log) ** 2)
        found["models"][name] = np.round([np.median(time), 100.0 * np.sqrt(square)], 3).tolist()
    return found


def summary(rows: list[dict[str, Any]], model: str) -> dict[str, Any]:
    """Of a model: RMS of all samples in floors, and errors of the times, median and largest [%]."""
    both = np.array([(r["models"][model][1], r["floor"]) for r in rows])
    rms, least = np.sqrt((both**2).mean(axis=0))
    found: dict[str, Any] = {"rms": round(float(rms), 3), "floors": round(float(rms / least), 3)}
    for way in ("fill", "vent"):
        part = [r for r in rows if r["fills"] == (way == "fill")]
        errors = np.array([100.0 * (r["models"][model][0] / r["time"] - 1.0) for r in part])
        largest = errors[np.argmax(np.abs(errors))]
        found[way] = [round(float(np.median(errors)), 2), round(float(largest), 2)]
    return found


@styled
def figure(logs: list[Log], fits: Mapping[str, Mapping[str, float]]) -> Figure:
    """Both ends of a hose in a fill and a vent: samples, and two models."""
    made, axes = new_figure(3.0, columns=2, sharey=True)
    for ax, log in zip(axes, logs, strict=True):
        ticks = dataclasses.replace(log, time=np.arange(HORIZON))
        for end, (label, colour) in enumerate((("valves", BLUE), ("far end", VERMILION))):
            dots = log.pressure[log.time < HORIZON, end]
            ax.plot(log.time[log.time < HORIZON], dots, ".", color=colour, ms=3, label=label)
            for name, style in PICTURED.items():
                ax.plot(ticks.time, predicted(fits[name], ticks)[:, end], style, color=colour)
        finish_axes(ax, x="time [ms]", y="pressure [bar]" if ax is axes[0] else "", zero=False)
    axes[0].legend(loc="upper right")
    return made


def main() -> None:
    """Fit all models, write the record and draw the picture."""
    options = parser(__doc__)
    options.add_argument("folder", type=Path, help="the authors' repository")
    asked = options.parse_args()
    paths = sorted((asked.folder / "Fig6/Fig6_data").glob("*.csv"))
    logs = [log for log in map(read, paths) if log is not None]
    seen = [log for log in logs if log.group == "fitted"]
    fits = {name: fitted(free, seen) for name, free in MODELS.items()}
    rows = [row(log, fits) for log in logs]
    groups: dict[str, list[dict[str, Any]]] = {}
    for one in rows:
        groups.setdefault(one["group"], []).append(one)
    line = [r for r in rows if r["fills"] and r["bar"] == 4.0 and r["metres"] < 8]

    def rate(times: list[float]) -> float:
        return round(float(np.polyfit([r["metres"] for r in line], times, 1)[0]), 2)

    record = head("python scripts/hoses.py FOLDER --json scripts/results/hoses.json") | {
        "data": "github.com/Foadsf/PneuAct_ICRA2018, commit 066f640",
        "files": len(paths),
        "ms_a_metre": rate([r["time"] for r in line]),
        "models": {
            name: {
                "values": values,
                "ms_a_metre": rate([r["models"][name][0] for r in line]),
                "groups": {group: summary(part, name) for group, part in groups.items()},
            }
            for name, values in fits.items()
        },
        "rows": rows,
    }
    write_rows(record, asked.json)
    save_small_png(
        figure([log for log in logs if (log.metres, log.bar) == (6, 4.0)], fits), "hoses"
    )


if __name__ == "__main__":
    main()
