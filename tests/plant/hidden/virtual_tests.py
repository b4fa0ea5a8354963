"""Sizes of hidden effects by tests on the plant's parts, in terms that no formula defines.

The conditions are those under which a diagnosis states its sizes.
"""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.diagnosis.bench import FAST, PRESSURE, SLOW, STRAIN, TURN
from tests.plant.hidden.hidden_effect import Quantities, Quantity
from tests.plant.joint import bristle_rate, dry_level, free_torque
from tests.plant.muscle import (
    duhem_rate,
    loop_pull,
    played,
    pull_per_pressure,
    reach_of,
    steady_pull,
)
from tests.plant.read_rig import Numbers
from tests.plant.records import PLAYS, Record


def cycle(amplitude: float, steps: int) -> FloatArray:
    """A path from 0 to the amplitude and through one closed cycle; 5 ``steps`` and a point."""
    corners = amplitude * np.array([0.0, 1.0, 0.0, -1.0, 0.0, 1.0])
    return np.interp(np.arange(5 * steps + 1) / steps, np.arange(6), corners)


def _plain(record: Record) -> Record:
    """The same numbers in an object that Python reads faster than a record."""
    return SimpleNamespace(**{name: float(record[name]) for name in record.dtype.names})


def muscle_loop(there: Numbers, _: Numbers, __: float) -> Quantities:
    """Half-width and energy of the first muscle's hidden hysteresis at a held pressure."""
    m = _plain(there.muscles[0])
    path = cycle(STRAIN, 300)
    plays, duhem = np.zeros(PLAYS), 0.0
    forces: list[float] = []
    for before, kappa in zip(np.r_[0.0, path[:-1]].tolist(), path.tolist(), strict=True):
        for k in range(PLAYS):
            plays[k] = played(plays[k], kappa, reach_of(m, k))
        if m.duhem_per_pressure > 0.0:
            duhem += duhem_rate(m, duhem, kappa - before)
        forces.append(loop_pull(m, plays, 0.0, duhem, kappa, PRESSURE, 0.0))
    energy = float(np.trapezoid(forces[300:], path[300:]))
    falling, rising = np.array(forces[300:901]), np.array(forces[900:1501])
    return {
        "loop_half_width": Quantity(0.5 * float(np.max(rising - falling[::-1])), "N"),
        "energy_per_cycle": Quantity(energy * m.nominal_length, "J"),
        "at_pressure": Quantity(PRESSURE, "Pa"),
        "contraction_amplitude": Quantity(STRAIN, "1"),
    }


def _friction(there: Numbers, without: Numbers, speed: float) -> FloatArray:
    """Torque that hidden friction takes along a cycle at one speed [N m]."""
    j, bare = _plain(there.joint[0]), _plain(without.joint[0])
    carried = sum(steady_pull(m, m.length_at_zero, PRESSURE) for m in there.muscles)
    path = cycle(TURN, 1000)
    deflection = 0.0
    found: list[float] = []
    for before, angle in zip(path[:-1].tolist(), path[1:].tolist(), strict=True):
        rate = math.copysign(speed, angle - before)
        if j.bristle > 0.0:
            deflection += bristle_rate(j, deflection, rate) * abs(angle - before) / speed
        taken = free_torque(bare, angle, rate, 0.0) - free_torque(j, angle, rate, deflection)
        more = dry_level(j, speed, carried) - dry_level(bare, speed, carried)
        found.append(taken + math.copysign(more, rate))
    return np.array(found)


def joint_friction(there: Numbers, without: Numbers, _: float) -> Quantities:
    """Breakaway torque, torque in sliding and energy of a slow cycle of the hidden friction."""
    slow, fast = _friction(there, without, SLOW), _friction(there, without, FAST)
    moved = np.diff(cycle(TURN, 1000))
    return {
        "breakaway_torque": Quantity(float(np.max(np.abs(slow))), "N*m"),
        "sliding_torque": Quantity(float(fast[999]), "N*m"),
        "at_speed": Quantity(FAST, "rad/s"),
        "energy_per_cycle": Quantity(float(slow[1000:] @ moved[1000:]), "J"),
        "angle_amplitude": Quantity(TURN, "rad"),
    }


def creep(there: Numbers, _: Numbers, __: float) -> Quantities:
    """Force per sudden contraction, the share that relaxes within 4 s, and the time to half."""
    m = there.muscles[0]
    branches = [(m[f"creep_{k}"], m[f"creep_time_{k}"]) for k in range(1, 5)]
    time = np.geomspace(1e-3, 1e3, 4000)
    left = sum(stiffness * np.exp(-time / tau) for stiffness, tau in branches)
    whole = float(sum(stiffness for stiffness, _ in branches))
    return {
        "force_per_sudden_contraction": Quantity(whole, "N"),
        "relaxed_within_4_s": Quantity(1.0 - float(np.interp(4.0, time, left)) / whole, "1"),
        "half_relaxed_after": Quantity(float(time[int(np.argmax(left < 0.5 * whole))]), "s"),
    }


def pull_change(there: Numbers, without: Numbers, _: float) -> Quantities:
    """Change of the last muscle's pull at nominal length, and 2 % contracted and stretched."""
    found: dict[str, Quantity] = {}
    for name, kappa in (("contracted", 0.02), ("nominal", 0.0), ("stretched", -0.02)):
        one, other = (
            steady_pull(m, m.nominal_length * (1.0 - kappa), PRESSURE)
            for m in (there.muscles[-1], without.muscles[-1])
        )
        found[f"force_change_{name}"] = Quantity(one - other, "N")
    one, other = there.muscles[-1], without.muscles[-1]
    ratio = pull_per_pressure(one, 0.0) / pull_per_pressure(other, 0.0)
    found["force_per_pressure_ratio"] = Quantity(ratio, "1")
    return {**found, "at_pressure": Quantity(PRESSURE, "Pa")}
