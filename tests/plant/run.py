"""Run an experiment on a plant and record it as error-free sensors would."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pamsim.core.errors import InputError, SimulationError
from pamsim.core.units import FloatArray
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome, Recording
from tests.plant.compiled import compiled_integrator
from tests.plant.rates import on_teeth
from tests.plant.read_rig import Numbers
from tests.plant.records import (
    AIR_TEMPERATURE,
    JOINT_STATES,
    LINE,
    MUSCLE_STATES,
    PLAYS,
    PRESSURE,
    RESERVOIR,
    SECOND_LINE,
    STRAIN,
    Record,
    state_count,
)

STEP = 1.7e-4
"""Longest step [s]; not a fraction of any step that the engine takes."""

_BAR = 1e5
"""Change of set point that a line's slew rate refers to [Pa]."""

_FASTEST = 4.0
"""Speed of the joint for which bristles are followed [rad/s]."""

_REST_BLOCK = 0.2
"""Time between two checks whether the plant has come to rest [s]."""

_REST = 1e-11
"""Largest relative change of a state over that time in a plant that counts as at rest."""

_CREEPS = tuple(f"creep_{k}" for k in range(5))


@dataclass(frozen=True, kw_only=True)
class Timing:
    """What makes commands arrive late in a run: the dead time of each change of command [s].

    It is drawn evenly between ``delay - spread`` and ``delay + spread``, with the run's seeds.
    """

    delay: float = 0.0
    spread: float = 0.0
    seed: tuple[int, ...] = ()


def run(
    numbers: Numbers,
    experiment: Experiment,
    *,
    rig: str,
    joint: str = "joint",
    muscles: tuple[str, ...],
    timing: Timing | None = None,
    step: float = STEP,
) -> Recording:
    """Run an experiment, from rest at its start pressures.

    The plant first holds the start pressures by its regulator, its relaxing branches free and
    without a dead zone, as a rig that has long been at rest at these pressures. Names are for the
    recording; a timing delays commands beside the rig's own delay.
    """
    if experiment.drive not in ("valve", "pressure_set"):
        raise InputError("the independent plant takes pressures and valve openings, not pulses")
    count = len(numbers.muscles)
    start = np.asarray(experiment.start_pressure, dtype=float)
    states, plays = at_zero(numbers, start)
    integrate = compiled_integrator()
    by_pressure = experiment.drive == "pressure_set"
    numbers = numbers.copy()
    numbers.muscles["slew_scale"] = _BAR if by_pressure else 1.0
    step = min(step, _bristle_step(numbers))
    held = numbers.copy()
    for name in (*_CREEPS, "dead_zone_fill", "dead_zone_exhaust"):
        held.muscles[name] = 0.0
    none, rows, left = np.zeros((0, 3)), np.zeros((2, 2 + 2 * count)), experiment.settle
    while left > 0.0:
        before = states.copy()
        settling = np.array([-left, min(_REST_BLOCK - left, 0.0)])
        integrate(
            held.joint, held.muscles, plays, states, settling, none, True, start.copy(), step, rows
        )
        left -= _REST_BLOCK
        if np.all(np.abs(states - before) <= _REST * (np.abs(states) + 1e-3)):
            break
    before = start.copy() if by_pressure else np.zeros(count)
    for i in range(count):
        first = JOINT_STATES + i * MUSCLE_STATES
        states[first + LINE] = states[first + SECOND_LINE] = before[i]
        states[first + STRAIN : first + MUSCLE_STATES] = 0.0
    rate = experiment.sample_rate
    samples = 1 + round(experiment.duration * rate)
    times = np.arange(samples) / rate
    rows = np.zeros((samples, 2 + 2 * count))
    changes = _arrivals(experiment, before, numbers.muscles, timing or Timing())
    integrate(
        numbers.joint, numbers.muscles, plays, states, times, changes, by_pressure, before, step,
        rows,
    )  # fmt: skip
    if not np.all(np.isfinite(rows)):
        raise SimulationError(f"the independent plant of {rig} broke down")
    return Recording(
        time=times,
        joints={joint: "angle"},
        positions=rows[:, :1].copy(),
        velocities=rows[:, 1:2].copy(),
        pressure=rows[:, 2 : 2 + count] - numbers.muscles["atmosphere"],
        tension=rows[:, 2 + count :].copy(),
        command=experiment.command_at(times),
        drive=experiment.drive,
        load=experiment.load,
        muscles=muscles,
        outcome=Outcome.COMPLETED,
        message="ran to the end",
        final_state=states,
        meta={"rig": rig, "experiment": experiment.name, "timestep_s": step, "sample_hz": rate},
    )


def _bristle_step(numbers: Numbers) -> float:
    """Longest step in which no bristles slip further than the integrator follows stably [s]."""
    j, m = numbers.joint[0], numbers.muscles
    slips = [j.bristle_slip] if j.bristle > 0.0 else []
    rubs = m.rub + m.rub_static + m.rub_share > 0.0
    slips += (m.rub_travel[rubs] / np.abs(m.arm[rubs])).tolist()
    return float(min(slips, default=math.inf)) / _FASTEST


def at_zero(numbers: Numbers, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """States and play operators at angle 0 and the start pressures, without memory."""
    m: Record = numbers.muscles
    states = np.zeros(state_count(len(m)))
    states[RESERVOIR] = m[0].supply + m[0].atmosphere
    plays = np.zeros((len(m), PLAYS))
    for i, pressure in enumerate(start):
        first = JOINT_STATES + i * MUSCLE_STATES
        states[first + PRESSURE] = pressure + m[i].atmosphere
        states[first + AIR_TEMPERATURE] = m[i].temperature
        states[first + LINE] = states[first + SECOND_LINE] = pressure
        plays[i] = 1.0 - (m[i].length_at_zero + on_teeth(m[i], 0.0)[0]) / m[i].nominal_length
    return states, plays


def _arrivals(
    experiment: Experiment, before: FloatArray, muscles: Record, timing: Timing
) -> FloatArray:
    """Changes of command as they reach the valves: (k, 3) time [s], muscle, value."""
    rng = np.random.default_rng([*timing.seed, 5])
    found: list[tuple[float, float, float]] = []
    times, values = experiment.command_time, experiment.command_value
    for i, last in enumerate(before.tolist()):
        latest = 0.0
        for time, value in zip(times.tolist(), values[:, i].tolist(), strict=True):
            if value != last:
                late = muscles[i].delay + timing.delay + timing.spread * rng.uniform(-1.0, 1.0)
                latest = max(time + late, latest)  # none overtakes another
                found.append((latest, float(i), value))
                last = value
    found.sort()
    return np.array(found).reshape(-1, 3)
