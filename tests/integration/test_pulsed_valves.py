"""On/off valves whose pulses were not logged: a schedule, and how much longer they stay open."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest

import pamsim

RATE, SAMPLES = 100.0, 201
PULSES = {  # first sample, samples, muscle, opening
    "one": [(10, 1, 0, 1.0), (30, 2, 1, -1.0), (60, 1, 0, 1.0), (90, 4, 1, -1.0), (120, 3, 0, 1.0)],
    "two": [(20, 3, 1, -1.0), (50, 1, 0, 1.0), (80, 6, 0, 1.0), (110, 2, 1, -1.0)],
}


def recorded(rig, name, rng):
    """Readings of a rig whose valves pulse, with noise."""
    command = np.zeros((SAMPLES, 2))
    for first, count, muscle, opening in PULSES[name]:
        command[first : first + count, muscle] = opening
    run = pamsim.simulate(
        rig,
        pamsim.Experiment(
            drive="valve",
            command_time=np.arange(SAMPLES) / RATE,
            command_value=command,
            start_pressure=np.array([2.5e5, 2.5e5]),
            duration=(SAMPLES - 1) / RATE,
            sample_rate=RATE,
        ),
    ).completed()
    return replace(
        run.with_angle(run.angle + 1e-3 * rng.standard_normal(run.angle.shape)),
        pressure=run.pressure + 400.0 * rng.standard_normal(run.pressure.shape),
    )


def schedule(name):
    """Rows of time and openings at which the pulses begin and end."""
    rows = [(0.0, 0.0, 0.0)]
    for first, count, muscle, opening in PULSES[name]:
        rows.append((first / RATE, *(opening * (muscle == k) for k in range(2))))
        rows.append(((first + count) / RATE, 0.0, 0.0))
    return rows


def test_a_schedule_and_pressures_show_how_late_valves_close(tmp_path):
    rig, rng = pamsim.load_rig("mas20_arm"), np.random.default_rng(0)
    planted = rig.with_parameters({"valve.closing_delay": 0.018})
    logs, schedules = [], []
    for name in PULSES:
        for repeat in (1, 2):
            run = recorded(planted, name, rng)
            logs.append(tmp_path / f"{name}_{repeat}.csv")
            with logs[-1].open("w", newline="") as file:
                table = csv.writer(file)
                table.writerow(["time_s", "p1_kpa", "p2_kpa", "angle_deg"])
                pressures, angle = 1e-3 * run.pressure, np.degrees(run.angle)
                table.writerows(np.column_stack([run.time, pressures, angle]).tolist())
            schedules.append(tmp_path / f"{name}_{repeat}_pulses.csv")
            with schedules[-1].open("w", newline="") as file:
                csv.writer(file).writerows([("time_s", "u1", "u2"), *schedule(name)])
    found = pamsim.import_log(logs, rig=rig, out=tmp_path / "data", schedule=schedules)
    assert found.drive == "valve"
    free = ["valve.closing_delay", "valve.conductance_fill", "valve.conductance_exhaust"]
    closing, *flows = pamsim.calibrate(
        [tmp_path / "data"],
        rig=rig,
        free=free,
        bounds={"valve.closing_delay": (0.0, 0.05)},
        channels=["angle", "pressure"],
    ).parameters
    assert closing.value == pytest.approx(0.018, abs=3e-4)
    assert closing.interval95[0] < 0.018 < closing.interval95[1]
    for flow in flows:
        assert flow.value == pytest.approx(4.92e-10, rel=0.01)
