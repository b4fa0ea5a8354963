"""Muscles in random states, evaluated by Python and by the kernels in Warp."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pamsim.gpu.muscle_kernels import launch, muscle_kernels
from pamsim.gpu.port import port, warp
from pamsim.physics.muscle import Muscle
from pamsim.physics.muscle_valves import cross_flow
from pamsim.physics.record import SIZE, STATE_NAMES, pack, slot, view
from pamsim.physics.supply import VALVE
from tests.unit.physics.flat import (
    chamber_pressure,
    fill_valve_of,
    kernel,
    sensed_pressure,
    supply_sag,
)
from tests.unit.physics.muscles import charged

TIMESTEP = 0.0005
PARTNER = slot("partner")
RESISTANCE, LINE = slot("valve.supply_resistance"), slot("valve.supply_line")


class Batch(NamedTuple):
    """n worlds of m muscles."""

    rows: np.ndarray  # (n, m, SIZE) parameters
    act: np.ndarray  # (n, na) states
    place: np.ndarray  # (m, 2) first state and number of states of each muscle
    length: np.ndarray  # (n, m) of tendons [m]
    speed: np.ndarray  # (n, m) [m/s]
    command: np.ndarray  # (n, m) signed openings
    time: float = 0.0123  # [s]

    def muscle(self, world: int, muscle: int) -> tuple[list[float], list[float]]:
        first, count = self.place[muscle]
        row = self.rows[world, muscle].tolist()
        return row, self.act[world, first : first + count].tolist()


class Results(NamedTuple):
    """Rates (n, na), the engine's forces, gauge pressures and tensions (n, m)."""

    rates: np.ndarray
    force: np.ndarray
    pressure: np.ndarray
    tension: np.ndarray


def batch(muscles: Sequence[Muscle], worlds: int, precision: str, seed: int) -> Batch:
    """Muscles on random paths, one world for each time step, with all numbers in a precision.

    Every muscle is led by random commands to random lengths, so that its memory is filled.
    """
    rng = np.random.default_rng(seed)
    size = worlds, len(muscles)
    nominal = np.array([(m.braid or m.stroke).nominal_length for m in muscles])
    contracted = nominal * (1.0 - rng.uniform(0.01, 0.1, size))
    length = _rounded(contracted - [m.mounting.length_at_zero for m in muscles], "float32")
    speed = _rounded(rng.uniform(-0.2, 0.2, size), "float32")
    command = _rounded(rng.uniform(-1.0, 1.0, size), "float32")
    start = rng.uniform(3e5, 5e5, len(muscles))
    rows = np.array([_rounded(pack(m), precision) for m in muscles])
    if precision == "float32":
        rows[:, RESISTANCE] = 0.0
    rows = np.tile(rows, (worlds, 1, 1))
    states = [charged(m, length[0, i], start[i]) for i, m in enumerate(muscles)]
    counts = [len(one) for one in states]
    place = np.stack([np.cumsum([0, *counts[:-1]]), counts], axis=1)
    act = np.empty((worlds, sum(counts)))
    act[0] = _rounded(np.concatenate(states), precision)
    made = Batch(rows, act, place, length, speed, command)
    for world in range(worlds - 1):
        rates = python_results(made, [world]).rates[0]
        act[world + 1] = _rounded(act[world] + TIMESTEP * rates, precision)
    return made


def _rounded(values, precision):
    return np.asarray(values, dtype=precision).astype(float)


def python_results(given: Batch, worlds: Sequence[int] | None = None) -> Results:
    """The kernel as plain Python in double precision."""
    worlds = range(len(given.rows)) if worlds is None else worlds
    count = len(given.place)
    rates = np.empty((len(worlds), given.act.shape[1]))
    force, pressure, tension = (np.empty((len(worlds), count)) for _ in range(3))
    for number, world in enumerate(worlds):
        muscles = [given.muscle(world, i) for i in range(count)]
        at, speed, sent = (v[world].tolist() for v in (given.length, given.speed, given.command))
        for i, (row, act) in enumerate(muscles):
            opposing = sag = crossing = 0.0
            if row[PARTNER] > 0.0:
                other = int(row[PARTNER]) - 1
                opposing = kernel.tension(*muscles[other], at[other], speed[other])
                rows, inside = (row, muscles[other][0]), chamber_pressure(row, act, at[i])
                beyond = chamber_pressure(*muscles[other], at[other])
                crossing = cross_flow(*map(view, rows), inside, beyond)
            if row[RESISTANCE] > 0.0:
                valves = []
                for j, (fed, states) in enumerate(muscles):
                    if fed[LINE] == row[LINE]:
                        valves.append([0.0] * VALVE)
                        inside = chamber_pressure(fed, states, at[j])
                        fill_valve_of(
                            fed, states, inside, sent[j], given.time, TIMESTEP, valves[-1]
                        )
                sag = supply_sag(row, act, valves, TIMESTEP)
            own = [0.0] * len(act)
            motion = at[i], speed[i]
            pull = kernel.state_rates(
                row, act, own, *motion, sent[i], given.time, TIMESTEP, opposing, sag, crossing
            )
            first = given.place[i, 0]
            rates[number, first : first + len(own)] = own
            force[number, i] = -kernel.tendon_force(row, act, pull, *motion, TIMESTEP)
            pressure[number, i] = sensed_pressure(row, act, at[i])
            tension[number, i] = kernel.tension(row, act, *motion)
    return Results(rates, force, pressure, tension)


def warp_results(given: Batch, precision: str) -> Results:
    """The kernels in Warp, on its CPU device."""
    wp, kernels, scalar = warp(), muscle_kernels(precision), port(precision).scalar
    worlds, count, _ = given.rows.shape
    assert given.rows.shape[2] == SIZE

    def array(values, kind):
        return wp.array(np.ascontiguousarray(values, dtype=kind), device="cpu")

    first, states = given.place.T
    shape = worlds, count
    arrays = {
        **{"par": array(given.rows, precision), "act": array(given.act, precision)},
        **{"length": array(given.length, "float32"), "speed": array(given.speed, "float32")},
        "ctrl": array(given.command, "float32"),
        "time": array([given.time] * worlds, "float64"),
        "timestep": scalar(TIMESTEP),
        "place": array(np.stack([first, first + states - len(STATE_NAMES)], axis=1), "int32"),
        "valves": array(np.zeros((worlds, count, count, VALVE)), precision),
        "rates": array(np.zeros(given.act.shape), precision),
        "force": array(np.zeros(shape), "float32"),
        **{name: array(np.zeros(shape), precision) for name in ("pressure", "pull")},
    }
    launch(kernels.step, shape, arrays, "cpu")
    launch(kernels.read, shape, arrays, "cpu")
    written = (arrays[name] for name in ("rates", "force", "pressure", "pull"))
    return Results(*(one.numpy().astype(float) for one in written))
