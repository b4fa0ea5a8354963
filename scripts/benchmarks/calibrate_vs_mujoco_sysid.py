"""``pamsim calibrate`` beside ``mujoco.sysid``: the same planted rig from the same recordings.

    python scripts/benchmarks/calibrate_vs_mujoco_sysid.py [--json FILE] [--seeds 3]

Eight parameters of ``mas20_arm`` are planted 10 to 30 % off and identified from ten recordings of
angle and pressures. Both tools simulate with `pamsim.simulate_batch` on one thread, start at the
shipped rig's values and search the same ranges. They differ in what each is made for:

- pamsim estimates the noise itself and corrects each start pressure, read from one noisy sample,
  along the signals' linear sensitivity.
- mujoco.sysid is handed the true standard deviations. Its ``optimize`` takes any residual callable;
  here rig parameters are in units of their start, because its differences take an absolute step,
  and the start pressures (in bar) are parameters too. Simulations that a moved start pressure does
  not touch are not repeated.

Seconds are of the whole call, reading the recordings and judging the result included.
"""

from __future__ import annotations

import io
import logging
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from timing import finish, noise, parser

import pamsim
from pamsim.calibration.calibrate import calibrate
from pamsim.comparison.experiments import at_times, experiment_of
from pamsim.comparison.measurements import read_calibration_data
from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.engine.batch import simulate_batch
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.recordings.recording import Outcome, Recording, write_recording
from pamsim.recordings.trial import Trial

try:
    from absl import logging as absl_logging  # pyright: ignore[reportMissingImports]
    from mujoco.sysid import Parameter, ParameterDict, calculate_intervals, optimize
except ImportError:
    sys.exit(f'mujoco.sysid is not installed: pip install "mujoco[sysid]=={version("mujoco")}"')


PLANTED = {
    "valve.conductance_fill": 1.25,
    "valve.conductance_exhaust": 0.8,
    "joint.shaft.damping": 1.3,
    "force.scale": 0.9,
    "passive.stiffness": 0.8,
    "passive.locking": 1.1,
    "hysteresis.force_per_pressure": 1.3,
    "body.rig.tilt": 1.3,
}
"""Truth over start."""
FILLING = ("valve.conductance_fill", "valve.conductance_exhaust", "joint.shaft.damping")
REACH = 3.0  # ranges: this factor either way
NOISE = {"angle": 0.05 / DEG_PER_RAD, "pressure_1": 400.0, "pressure_2": 400.0}
BAR = 1e5
OPTIONS: dict[str, Any] = {"eps": 1e-5, "xtol": 1e-6, "max_iters": 30}
"""Of mujoco.sysid: differences with a step like pamsim's; what is not named is its default."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """Recordings on disk and what is wanted of them."""

    rig: Rig
    folder: Path
    names: tuple[str, ...]
    truth: FloatArray
    start: FloatArray


def staircase(load: float, start: tuple[float, float], *openings: tuple[float, float]):
    """Valve openings held for 0.25 s each, from rest at gauge pressures [bar]."""
    return pamsim.Experiment(
        drive="valve",
        command_time=0.25 * np.arange(len(openings), dtype=np.float64),
        command_value=np.array(openings),
        start_pressure=BAR * np.array(start),
        duration=0.25 * len(openings),
        sample_rate=100.0,
        load=load,
    )


SHUT = (0.0, 0.0)
EXPERIMENTS = {
    "stairs_a": staircase(0.0, (2.5, 2.5), (0.4, -0.5), SHUT, (-0.6, 0.5), (0.0, 0.2)),
    "stairs_b": staircase(1.2, (2.5, 2.5), (0.5, 0.3), (-0.2, 0.0), (0.0, -0.6), (0.2, 0.2)),
    "stairs_c": staircase(0.0, (1, 4), (0.6, -0.3), (0.3, -0.3), SHUT, (-0.5, 0.4), (0.2, 0.0)),
    "stairs_d": staircase(1.2, (4, 1), (-0.4, 0.6), (-0.2, 0.3), SHUT, (0.5, -0.5), SHUT),
    "vent": staircase(1.2, (4.5, 4.5), (-0.8, -0.8), (-0.4, -0.4), (-0.2, -0.2), (-0.1, -0.1)),
    "swing_a": staircase(1.2, (3, 2), (-1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, -1.0)),
    "swing_b": staircase(0.0, (2, 3), (0.3, -0.3), (-0.3, 0.3), (0.6, -0.6), SHUT),
    "fill_a": staircase(0.0, (0.5, 0.5), (0.8, 0.3), (0.4, 0.4), (0.2, 0.2), (0.1, 0.1)),
    "fill_b": staircase(0.0, (1.5, 1.5), (1.0, 0.0), SHUT, SHUT, SHUT, SHUT),
    "fill_c": staircase(1.2, (1.5, 1.5), (0.0, 1.0), SHUT, SHUT, SHUT, SHUT),
}


def noisy(run: Recording, rng: np.random.Generator, correlation: float) -> Recording:
    """A recording with noise of `NOISE`, whose correlation time is in samples."""
    e = noise(rng, (run.angle.size, 3), correlation, 200) * list(NOISE.values())
    return replace(run.with_angle(run.angle + e[:, 0]), pressure=run.pressure + e[:, 1:])


def case(folder: Path, seed: int, correlation: float = 0.0, filling: bool = False) -> Case:
    """Simulate the planted rig and write noisy recordings."""
    rig = pamsim.load_rig("mas20_arm")
    start = {name: rig_parameter(rig, name).value for name in PLANTED}
    planted = rig.with_parameters({name: start[name] * f for name, f in PLANTED.items()})
    rng = np.random.default_rng(seed)
    wanted = {n: e for n, e in EXPERIMENTS.items() if n.startswith("fill") or not filling}
    runs = simulate_batch([(planted, e) for e in wanted.values()], threads=1)
    trials = {n: noisy(r.completed(), rng, correlation) for n, r in zip(wanted, runs, strict=True)}
    write_recording(folder, "mas20_arm", trials, {name: name for name in trials})
    names = FILLING if filling else tuple(PLANTED)
    if filling:  # what is not asked for is known
        rig = planted.with_parameters({name: start[name] for name in names})
    begin = np.array([start[name] for name in names])
    truth = begin * [PLANTED[name] for name in names]
    return Case(rig=rig, folder=folder, names=names, truth=truth, start=begin)


def judged(given: Case, values: FloatArray, low: FloatArray, high: FloatArray) -> dict[str, Any]:
    """Errors and intervals in per cent of the planted value."""
    rows = {}
    off = 100.0 * (np.array([values, low, high]) / given.truth - 1.0)
    for i, name in enumerate(given.names):
        ends = sorted(off[1:, i].tolist()) if np.isfinite(off[:, i]).all() else None
        rows[name] = {
            "value_si": float(values[i]),
            "truth_si": float(given.truth[i]),
            "error_percent": float(off[0, i]),
            "interval95_percent_of_planted": ends,
            "truth_inside": None if ends is None else ends[0] <= 0.0 <= ends[1],
        }
    return rows


def by_pamsim(given: Case) -> dict[str, Any]:
    """Calibrate with pamsim."""
    bounds = {}
    for name, value in zip(given.names, given.start.tolist(), strict=True):
        low, high = sorted((value / REACH, value * REACH))
        bounds[name] = low, high
    wanted: dict[str, Any] = {"free": given.names, "bounds": bounds, "threads": 1}
    calibration = calibrate([given.folder], rig=given.rig, channels=("angle", "pressure"), **wanted)
    found = calibration.fit
    ends = np.array([p.interval95 or (np.nan, np.nan) for p in found.parameters])
    return {
        "seconds": calibration.seconds,
        "simulations": calibration.simulations,
        "iterations": found.iterations,
        "parameters": judged(given, found.values, ends[:, 0], ends[:, 1]),
        "status": found.sentence,
        "said": [p.sentence for p in found.parameters if p.sentence],
        "determined": list(found.determined),
    }


class Residual:
    """What mujoco.sysid minimises: (x, parameters) to residuals of every trial in units of noise.

    Args:
        given: the rig and its free parameters.
        trials: as read from disk.
    """

    def __init__(self, given: Case, trials: tuple[Trial, ...]) -> None:
        self.given, self.trials, self.simulations = given, trials, 0
        self.experiments = [experiment_of(trial) for trial in trials]
        self.known: dict[bytes, FloatArray] = {}

    def __call__(self, x: FloatArray, params: Any) -> tuple[list[FloatArray], None, None]:
        """Residuals at one point (n,), or at the columns of (n, k)."""
        columns = np.atleast_2d(x.T)
        count = len(self.given.names)
        wanted: list[list[bytes]] = []
        jobs: dict[bytes, tuple[int, Any]] = {}
        for column in columns:
            values = (column[:count] * self.given.start).tolist()
            rig = self.given.rig.with_parameters(dict(zip(self.given.names, values, strict=True)))
            moved = column[count:].reshape(-1, 2)
            wanted.append([])
            for i, e in enumerate(self.experiments):
                key = column[:count].tobytes() + moved[i].tobytes() + bytes([i])
                wanted[-1].append(key)
                if key not in self.known:
                    jobs[key] = i, (rig, replace(e, start_pressure=BAR * moved[i]))
        self.simulations += len(jobs)
        runs = simulate_batch([job for _, job in jobs.values()], threads=1)
        for (key, (i, _)), run in zip(jobs.items(), runs, strict=True):
            self.known[key] = self.missed(self.trials[i], run)
        found = [np.concatenate([self.known[key] for key in keys]) for keys in wanted]
        return [np.stack(found, axis=1) if x.ndim == 2 else found[0]], None, None

    def missed(self, trial: Trial, run: Recording) -> FloatArray:
        """Residual of one trial; infinite where the run broke down, which its search rejects."""
        if run.outcome is not Outcome.COMPLETED:
            return np.full(trial.time.size * len(NOISE), np.inf)
        found = at_times(run, trial)
        return np.concatenate([(found[n] - trial.measured[n]) / sd for n, sd in NOISE.items()])


def by_sysid(given: Case) -> dict[str, Any]:
    """Identify with mujoco.sysid."""
    heard = io.StringIO()
    absl_logging.get_absl_logger().handlers = [logging.StreamHandler(heard)]
    began = time.perf_counter()
    residual = Residual(given, read_calibration_data([given.folder]).trials)
    params = ParameterDict()
    for name in given.names:
        params.add(Parameter(name, 1.0, 1.0 / REACH, REACH))
    read = np.ravel([e.start_pressure / BAR for e in residual.experiments])
    reach = 5.0 * NOISE["pressure_1"] / BAR
    params.add(Parameter("start_pressure", read, read - reach, read + reach))
    log = io.StringIO()
    check = given.names == FILLING  # costs a Jacobian, so not where time counts
    _, result = optimize(
        params, residual, verbose=False, check_conditioning=check, output=log, **OPTIONS
    )
    _, half = calculate_intervals(residual(result.x, params)[0], result.jac)
    seconds = time.perf_counter() - began
    count = len(given.names)
    value, half = result.x[:count] * given.start, half[:count] * given.start
    lines = log.getvalue().splitlines()
    return {
        "seconds": seconds,
        "simulations": residual.simulations,
        "iterations": sum(line.startswith("iter:") for line in lines),
        "parameters": judged(given, value, value - half, value + half),
        "status": next(line for line in lines if line.startswith("Terminated")),
        "said": heard.getvalue().splitlines(),
        "infinite_intervals": [n for n, h in zip(given.names, half, strict=True) if np.isinf(h)],
    }


def medians(runs: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    """Medians over the seeds, and how often the intervals hold the planted values."""
    summary: dict[str, Any] = {}
    for tool, found in runs.items():
        rows = [row for run in found for row in run["parameters"].values()]
        held = [row["truth_inside"] for row in rows if row["truth_inside"] is not None]
        summary[tool] = {
            key: statistics.median(run[key] for run in found)
            for key in ("seconds", "simulations", "iterations")
        }
        summary[tool]["largest_error_percent"] = max(abs(row["error_percent"]) for row in rows)
        summary[tool]["truth_inside"] = f"{sum(held)} of {len(held)}"
    one, other = (summary[tool]["seconds"] for tool in ("pamsim", "mujoco.sysid"))
    return {**summary, "seconds_pamsim_over_sysid": one / other}


def main() -> None:
    """Run both tools on every case and print what they find."""
    options = parser(__doc__, seeds=3).parse_args()
    tools = {"pamsim": by_pamsim, "mujoco.sysid": by_sysid}
    white: dict[str, list[dict[str, Any]]] = {tool: [] for tool in tools}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for seed in range(options.seeds):
            given = case(place / str(seed), seed)
            for tool, run in tools.items():
                white[tool].append(run(given))
        others = (
            case(place / "coloured", 0, correlation=10.0),
            case(place / "filling", 0, filling=True),
        )
        coloured, deficient = (
            {tool: run(given) for tool, run in tools.items()} for given in others
        )
    result = {
        "summary": medians(white),
        "white_noise": white,
        "coloured_noise_ar1_0.1_s": coloured,
        "only_filling": deficient,
        "sysid_options": OPTIONS,
    }
    finish("calibrate_vs_mujoco_sysid.py", result, options.json, "scipy")


if __name__ == "__main__":
    main()
