"""The EquiMus leg: open loop, calibrated, diagnosed, and judged on recordings that no fit has seen.

FOLDER is a copy of github.com/fly-pigTH/EquiMus at commit 095f3a5 (MIT). Fitted is a part of its
ToCenter recording: steps from no pressure to a held one and back. Judged are cycles 2 to 10 of its
TriStatic recording: three steps in turn, a month earlier.

    python scripts/equimus_leg.py FOLDER [--only PART] [--workers 2]

PART is open, static, calibrate, diagnose, repeats, judge or pictures. Calibration takes a quarter
of an hour of one processor, the diagnosis a minute, that of cycles that repeat each other five.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from pictures import save_small_png
from records import RESULTS, parser, run_parts

import pamsim
from pamsim.comparison.measurements import read_calibration_data
from pamsim.comparison.trial_prediction import TrialPredictor
from pamsim.core.computation import versions
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.recordings.experiment import Experiment
from pamsim.report.style import finish_axes, new_figure, styled
from pamsim.scene.series_colours import BLUE, INK, MUTED, VERMILION

OUT = Path(__file__).parents[1] / "out" / "equimus_leg"
SCHEMA = "pamsim-equimus-leg/1"
PARTS = ("open", "static", "calibrate", "diagnose", "repeats", "judge", "pictures")

DYNAMIC = Path("src/validation_physical/dynamic")
STATIC = Path("src/validation_physical/static")
TRIANGLE = DYNAMIC / "data" / "TriStatic_2025-01-21_19-26-44_A2B_data.csv"
RELEASE = DYNAMIC / "data" / "ToCenter_2025-02-20_21-06-20_A2B_data.csv"

JOINTS = ("hip", "knee")
CHANNELS = ("hip.angle", "knee.angle")

FITTED, CHECKED = (2, 7, 12, 19, 30), (8, 13, 24)
"""Steps of ToCenter, of 36 in the file's order. None drives the knee to its stop, see STATIC."""
STEP_SECONDS, CYCLE_SECONDS, CYCLES = 10, 6, 10

# name -> what `pamsim calibrate` may change, and within what [SI]; None for five times either way.
BELLOWS = ("hip_bellows", "knee_bellows")
BASE = {
    f"{bellows}:{name}": None
    for name in ("force.area", "force.stiffness", "stroke.nominal_length", "stroke.damping")
    for bellows in BELLOWS
} | {"joint.hip.damping": (0.0, 3.0), "joint.knee.damping": (0.0, 1.0)}
"""The ten numbers that the authors fitted."""
VALVES = {
    f"{muscle}:valve.conductance_{way}": (5e-12, 5e-9)
    for muscle in BELLOWS
    for way in ("fill", "exhaust")
}
CALIBRATED = "with_valves"
FREES = {"as_the_authors": BASE, CALIBRATED: {**BASE, **VALVES}}
NUISANCE = tuple(f"{b}:{n}" for n in ("force.scale", "stroke.nominal_length") for b in BELLOWS)
EFFECTS = (
    "valve_delay", "line_lag", "valve_slew", "valve_asymmetry", "tube_resistance",
    "coulomb_friction", "viscous_friction", "muscle_hysteresis", "viscoelastic_creep",
)  # fmt: skip

KEPT = ("verdict", "sentence", "links", "effects", "remainder", "gap", "next_experiment", "run")
"""Of a diagnosis, in the record."""

STATIC_NUMBERS = {
    "hip_bellows:force.stiffness": 203.94877985761158,
    "knee_bellows:force.stiffness": 105.07337552294058,
    "hip_bellows:force.area": 0.0004108979203914209,
    "knee_bellows:force.area": 0.0003244353052769064,
    "hip_bellows:stroke.nominal_length": 0.1740,
    "knee_bellows:stroke.nominal_length": 0.2562,
}
"""The authors' static fit, static/log/sysid_parameters.csv."""
AT_STOP = 0.5  # deg: a knee below it lies on its stop

UNDAMPED = {"joint.hip.damping": 0.0, "knee_bellows:stroke.damping": (2 * 25.7807 + 0.4224) / 4.0}
"""What trajectory_track_triangle.ipynb simulates: it asks for a joint RB_shoulder, the model has
RB_Shoulder, and the hip's damping lands on the last joint, half of the knee bellows."""
SCORED_FROM, SCORED_FOR, RECORDED = 28.0, 40.0, 59.98
"""That notebook scores 40 s from 28 s on [s]; the recording ends before, and its last angles are
held: ``time_sim[6000]`` is 30 s at the model's step of 5 ms."""

HEAD = """schema = "pamsim-recording/2"
rig = "equimus_leg"

[columns]
time = {{ column = "relative_time", unit = "s", wraps = {wraps} }}
"hip.angle" = {{ column = "thigh_theta21", unit = "deg" }}
"knee.angle" = {{ column = "calf_theta32", unit = "deg" }}
"hip_bellows.{quantity}" = {{ column = "{first}", unit = "Pa" }}
"knee_bellows.{quantity}" = {{ column = "{second}", unit = "Pa" }}

[[trial]]
file = "{file}"
protocol = "{protocol}"
drive = "{drive}"
rate = "{rate} Hz"
lead_in = "{lead} s"
segments = {segments}
"""


def recording(
    folder: Path, file: Path, protocol: str, segments: list[list[float]], **settings: Any
) -> Path:
    """Make a recording of a log of the authors; returns its folder."""
    triangle = file == TRIANGLE
    columns = ("pressure{}_end", 2) if triangle else ("current_pressure{}", STEP_SECONDS)
    given = {"quantity": "pressure_set", "drive": "pressure_set", **settings}
    made = OUT / "recordings" / f"{protocol}_{given['drive']}"
    made.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(folder / file, made / "log.csv")
    text = HEAD.format(
        wraps=columns[1],
        first=columns[0].format(1),
        second=columns[0].format(2),
        file="log.csv",
        protocol=protocol,
        segments=segments,
        **given,
    )
    (made / "recording.toml").write_text(text, encoding="utf-8")
    return made


def released(folder: Path, steps: tuple[int, ...], protocol: str) -> Path:
    """Some steps of ToCenter."""
    spans = [[STEP_SECONDS * k, STEP_SECONDS * k + 9.0] for k in steps]
    return recording(folder, RELEASE, protocol, spans, rate=25, lead=1)


def triangle(folder: Path, **settings: Any) -> Path:
    """Cycles 2 to 10 of TriStatic, each from the one before."""
    spans = [
        [float(CYCLE_SECONDS * k), min(CYCLE_SECONDS * (k + 1.0), RECORDED)]
        for k in range(1, CYCLES)
    ]
    return recording(
        folder, TRIANGLE, "triangle_check", spans, rate=50, lead=CYCLE_SECONDS, **settings
    )


def by_joint(values: ArrayLike) -> dict[str, float]:
    """Joint -> its number of two."""
    return dict(zip(JOINTS, np.asarray(values).tolist(), strict=True))


def residuals(rig: Rig, source: Path) -> list[FloatArray]:
    """Measured minus simulated angles of every trial, (n, 2) [rad]."""
    data = read_calibration_data([source]).of_rig(rig)
    predictor = TrialPredictor(rig, data, channels=("angle",))
    (prediction,) = predictor.predictions([rig])
    assert prediction is not None
    return [
        np.stack([t.measured[c] - prediction.trials[t.name][c] for c in CHANNELS], axis=1)
        for t in data.trials
    ]


def rms(found: list[FloatArray]) -> dict[str, float]:
    """Joint -> RMS over all trials [rad]."""
    return by_joint(np.sqrt(np.mean(np.concatenate(found) ** 2, axis=0)))


def cycles(source: Path) -> tuple[FloatArray, FloatArray]:
    """Time in a cycle (n,) [s], and measured angles (cycles, n, 2) [rad]."""
    trials = pamsim.read_recordings(source).trials
    rows = min(t.time.size for t in trials)
    angles = [np.stack([t.measured[c][:rows] for c in CHANNELS], axis=1) for t in trials]
    return trials[0].time[:rows], np.stack(angles)


def floors(folder: Path) -> dict[str, float]:
    """Joint -> what cycles 2 to 10 of TriStatic differ by from their mean [rad]."""
    _, measured = cycles(triangle(folder))
    return by_joint(np.sqrt(measured.var(axis=0, ddof=1).mean(axis=0)))


def log(folder: Path) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time [s], angles [rad] and commanded pressures [Pa] of the whole of TriStatic."""
    table = np.genfromtxt(folder / TRIANGLE, delimiter=",", names=True)
    rounds = np.concatenate([[0], np.cumsum(np.diff(table["relative_time"]) < 0.0)])
    angle = np.radians(np.stack([table["thigh_theta21"], table["calf_theta32"]], axis=1))
    pressure = np.stack([table["pressure1_end"], table["pressure2_end"]], axis=1)
    return table["relative_time"] + 2.0 * rounds, angle, pressure


def notebook_score(rig: Rig, folder: Path, seconds: float) -> dict[str, float]:
    """RMS as the notebook takes it, from 28 s on, pressures imposed [rad]."""
    time, angle, pressure = log(folder)
    steps = np.array([pressure[np.searchsorted(time, t)] for t in (4.5, 0.5, 2.5)])
    clock = np.arange(0.0, 100.0, 0.01)
    experiment = Experiment(
        drive="measured",
        command_time=clock,
        command_value=steps[((clock // 2.0) % 3).astype(int)],
        start_pressure=steps[0],
        duration=99.9,
        sample_rate=100.0,
    )
    run = pamsim.simulate(rig, experiment).completed()
    at = SCORED_FROM + np.arange(0.0, seconds, 0.01)
    missed = [
        np.interp(at, time, measured) - np.interp(at, run.time - 2.0, run.signal(channel))
        for channel, measured in zip(CHANNELS, angle.T, strict=True)
    ]
    return by_joint(np.sqrt(np.mean(np.square(missed), axis=1)))


def open_loop(folder: Path) -> dict[str, Any]:
    """The rig as shipped, pressures imposed, against TriStatic."""
    rig = pamsim.load_rig("equimus_leg")
    imposed = triangle(folder, quantity="pressure", drive="measured")
    return {
        "floors": floors(folder),
        "cycles_2_to_10": rms(residuals(rig, imposed)),
        "as_the_notebook_scores": notebook_score(rig, folder, SCORED_FOR),
        "as_the_notebook_simulates": notebook_score(
            rig.with_parameters(UNDAMPED), folder, SCORED_FOR
        ),
        "the_same_while_recorded": notebook_score(
            rig.with_parameters(UNDAMPED), folder, RECORDED - SCORED_FROM
        ),
    }


def static_points(folder: Path) -> dict[str, Any]:
    """The authors' static numbers against the 36 static points, and where the knee stops."""
    points = np.genfromtxt(
        folder / STATIC / "data" / "real_static_state" / "real(all)_StaticPoint_6group.csv",
        delimiter=",",
        skip_header=1,
    )
    rig = pamsim.load_rig("equimus_leg").with_parameters(STATIC_NUMBERS)
    ends = np.array(
        [
            [
                pamsim.simulate(rig, pamsim.pressure_step(p, p, duration=4.0))
                .completed()
                .signal(channel)[-1]
                for channel in CHANNELS
            ]
            for p in (points[:, :2] * 1e3).tolist()
        ]
    )
    miss = np.radians(points[:, 2:4]) - ends
    free = points[:, 3] > AT_STOP
    stopped = np.radians(points[~free, 3])
    return {
        "points": int(free.size),
        "not_at_the_stop": int(free.sum()),
        "rms_not_at_the_stop": rms([miss[free]]),
        "stop": float(stopped.mean()),
        "stop_scatter": float(stopped.std(ddof=1)),
    }


def calibration(folder: Path, workers: int) -> dict[str, Any]:
    """Fit to ToCenter, with the authors' kinds of numbers alone and with the valves'."""
    sources = [released(folder, FITTED, "release"), released(folder, CHECKED, "release_more")]
    results: dict[str, Any] = {"fitted_steps": [*FITTED, *CHECKED]}
    for name in FREES:
        found = pamsim.calibrate(
            sources,
            rig="equimus_leg",
            free=tuple(FREES[name]),
            bounds={n: ends for n, ends in FREES[name].items() if ends is not None},
            channels=["angle"],
            threads=workers,
            out=OUT / name,
        )
        print(found.summary())
        parameters = [
            {"name": p.name, "value": p.value, "interval95": p.interval95, "flags": p.flags}
            for p in found.parameters
        ]
        results[name] = {"parameters": parameters}
    return results


def diagnosis(folder: Path, workers: int) -> dict[str, Any]:
    """What the shipped rig misses in ToCenter, judged on three steps of it."""
    sources = [released(folder, FITTED, "release"), released(folder, CHECKED, "release_check")]
    found = diagnosed(sources, "diagnosis", workers, effects=EFFECTS)
    return {key: found[key] for key in KEPT}


def diagnosed(sources: list[Path], part: str, workers: int, **settings: Any) -> dict[str, Any]:
    """Diagnose recordings; what was found, and which they are without their folders."""
    report = pamsim.diagnose(
        sources, rig="equimus_leg", nuisance=NUISANCE, threads=workers, **settings
    )
    report.save(OUT / part)
    print(report.summary())
    found = report.to_dict()
    found["run"]["data"] = [source.name for source in sources]
    return found


JUDGED = tuple(f"log_{cycle}" for cycle in (1, 3, 5, 7, 9))
"""Cycles of TriStatic that no fit of the diagnosis by repeats sees."""


def by_repeats(folder: Path, workers: int) -> dict[str, Any]:
    """What the shipped rig misses in TriStatic, whose cycles repeat each other."""
    found = diagnosed([triangle(folder)], "repeats", workers, hold_out=JUDGED)
    curves = ("kind", "acts_at", "before", "after")
    shapes = [{key: one[key] for key in curves} for one in found["learned"]]
    return {key: found[key] for key in (*KEPT, "warnings")} | {"learned": shapes}


LEVELS = {"first": 2.0, "second": 4.0, "third": 6.0}
"""Ends of a cycle's levels, from its beginning on [s]."""
LEAST_SET = 5e3
"""Commands below this are taken as no pressure, to see whether the regulators do so [Pa]."""


def judged(folder: Path) -> dict[str, Any]:
    """Every rig against cycles 2 to 10 of TriStatic, which nothing was fitted to."""
    source = triangle(folder)
    rigs = {"as_shipped": pamsim.load_rig("equimus_leg")}
    for name in (*FREES, "diagnosis"):
        if (OUT / name / "rig" / "params.toml").is_file():
            rigs[name] = pamsim.load_rig(OUT / name / "rig")
    results: dict[str, Any] = {"floors": floors(folder), "rigs": {}}
    for name, rig in rigs.items():
        found = residuals(rig, source)
        held = {
            level: by_joint(
                np.mean(
                    [r[int(50 * (end - 0.5)) : int(50 * end)].mean(axis=0) for r in found], axis=0
                )
            )
            for level, end in LEVELS.items()
        }
        cut = rms(residuals(rig, without_small_commands(folder)))
        results["rigs"][name] = {"rms": rms(found), "held": held, "small_commands_as_none": cut}
        print(name, results["rigs"][name])
    results["cycle"] = mean_cycle(source, rigs)
    return results


def mean_cycle(source: Path, rigs: Mapping[str, Rig]) -> dict[str, Any]:
    """Mean over the cycles, measured and simulated, and the range of the measured ones [deg]."""
    time, measured = cycles(source)

    def rounded(values: FloatArray) -> list[float]:
        return np.round(np.degrees(values), 3).tolist()

    found: dict[str, Any] = {
        "time": np.round(time, 4).tolist(),
        "measured": {
            c: {"mean": rounded(m.mean(0)), "low": rounded(m.min(0)), "high": rounded(m.max(0))}
            for c, m in zip(CHANNELS, np.moveaxis(measured, 2, 0), strict=True)
        },
    }
    for name, rig in rigs.items():
        missed = np.stack([miss[: time.size] for miss in residuals(rig, source)])
        mean = (measured - missed).mean(axis=0)
        found[name] = dict(zip(CHANNELS, map(rounded, mean.T), strict=True))
    return found


@styled
def cycle_figure(record: dict[str, Any]) -> Figure:
    """Hip and knee over a cycle of TriStatic."""
    cycle = record["judge"]["cycle"]
    figure, (hip, knee) = new_figure(4.6, rows=2, sharex=True)
    for ax, channel in ((hip, CHANNELS[0]), (knee, CHANNELS[1])):
        measured = cycle["measured"][channel]
        ax.fill_between(
            cycle["time"], measured["low"], measured["high"], color=MUTED, alpha=0.35, linewidth=0
        )
        ax.plot(cycle["time"], measured["mean"], color=INK, label="measured, mean of 9 cycles")
        for name, colour, label in (
            ("as_shipped", VERMILION, "authors' numbers"),
            (CALIBRATED, BLUE, "calibrated on ToCenter"),
        ):
            ax.plot(cycle["time"], cycle[name][channel], color=colour, label=label)
        finish_axes(ax, y=f"{channel.removesuffix('.angle')} [deg]", zero=False)
    hip.legend(loc="upper left")
    finish_axes(knee, y="knee [deg]", x="time in the cycle [s]", zero=False)
    return figure


def without_small_commands(folder: Path) -> Path:
    """TriStatic with commands below `LEAST_SET` replaced by 0: seen after the fact, no fit."""
    made = triangle(folder)
    cut = OUT / "recordings" / "triangle_cut"
    shutil.copytree(made, cut, dirs_exist_ok=True)
    lines = (made / "log.csv").read_text(encoding="utf-8").splitlines()
    names = lines[0].split(",")
    rows = [line.split(",") for line in lines[1:]]
    for column in ("pressure1_end", "pressure2_end"):
        index = names.index(column)
        for row in rows:
            row[index] = row[index] if float(row[index]) >= LEAST_SET else "0.0"
    text = "\n".join([lines[0], *map(",".join, rows)]) + "\n"
    (cut / "log.csv").write_text(text, encoding="utf-8")
    return cut


def main() -> None:
    """Run what is asked for and write the record."""
    options = parser(__doc__, RESULTS / "equimus_leg.json", workers=2)
    options.add_argument("folder", type=Path, help="the authors' repository")
    options.add_argument("--only", choices=PARTS)
    asked = options.parse_args()
    about = {
        "schema": SCHEMA,
        "command": "python scripts/equimus_leg.py FOLDER",
        "data": "github.com/fly-pigTH/EquiMus, commit 095f3a5, MIT",
        "versions": versions("scipy"),
    }
    jobs = {
        "open": lambda: open_loop(asked.folder),
        "static": lambda: static_points(asked.folder),
        "calibrate": lambda: calibration(asked.folder, asked.workers),
        "diagnose": lambda: diagnosis(asked.folder, asked.workers),
        "repeats": lambda: by_repeats(asked.folder, asked.workers),
        "judge": lambda: judged(asked.folder),
    }
    record = run_parts(asked.json, about, jobs, asked.only)
    if asked.only in (None, "pictures"):
        save_small_png(cycle_figure(record), "equimus_leg")


if __name__ == "__main__":
    main()
