"""A table of angles at rest in closed form, quick enough to diagnose hundreds of times."""

from __future__ import annotations

import numpy as np

from pamsim.diagnosis.method.row_diagnosis import diagnose_rows
from pamsim.diagnosis.method.row_fit import RowSimulator
from pamsim.diagnosis.method.row_model import RowEffect
from pamsim.inference.free_parameter import FreeParameter

OWN = {"gain": 0.12, "lock": 0.0, "soften": 0.0, "tilt": 0.0, "bias": 0.0, "copy": 0.0, "wave": 0.0}


class Table:
    """Rows that differ in both pressures [bar] and in load [kg]."""

    def __init__(self, rows=24, seed=3):
        rng = np.random.default_rng(seed)
        self.low = np.where(np.arange(rows) % 2, rng.uniform(0.0, 4.0, rows), 0.0)
        self.step = rng.uniform(0.4, 4.5, rows) * np.where(np.arange(rows) % 4 < 2, 1.0, -1.0)
        self.step[self.low > 0] *= 0.4
        self.load = rng.choice([0.0, 1.2, 2.1], rows)
        self.names = tuple(f"row {k}" for k in range(rows))

    def angle(self, values):
        v = {**OWN, **values}
        own = v["gain"] * self.step * (1.0 + (v["soften"] + v["copy"]) * self.low)
        turned = own / (1.0 + v["lock"] * own**2)
        wave = v["wave"] * np.sin(40.0 * self.step)
        return turned + v["tilt"] * self.load * 0.01 + v["bias"] + wave

    def taken(self, order):
        other = object.__new__(Table)
        for name in ("low", "step", "load"):
            setattr(other, name, getattr(self, name)[order])
        other.names = tuple(self.names[i] for i in order)
        return other


def effect(name, typical, low, high, family=None):
    free = FreeParameter(name=name, unit="1", start=typical, low=low, high=high)
    sizes = (1.0, -1.0) if low < 0.0 else (1.0, 3.0)
    return RowEffect(
        name=name,
        family=family or name,
        parameters=(free,),
        neutral={name: 0.0},
        starts=tuple({name: size * typical} for size in sizes),
    )


LOCK = effect("lock", 0.5, 0.0, 8.0)
SOFTEN = effect("soften", 0.03, -0.3, 0.3)
TILT = effect("tilt", 0.5, -5.0, 5.0)
BIAS = effect("bias", 0.01, -0.1, 0.1)
LIBRARY = (LOCK, SOFTEN, TILT, BIAS)
NUISANCE = (FreeParameter(name="gain", unit="1", start=0.12, low=0.06, high=0.2),)
NOISE = 0.01


def measured(table, hidden, *, noise=NOISE, seed=0):
    return table.angle(hidden) + noise * np.random.default_rng([seed, 7]).standard_normal(
        table.step.size
    )


def diagnosed(table, angle, effects=LIBRARY, *, simulator=None, nuisance=NUISANCE, progress=None):
    simulator = simulator or RowSimulator(
        predict=lambda sets: [table.angle(values) - angle for values in sets]
    )
    return diagnose_rows(
        simulator,
        nuisance,
        effects,
        {"low": table.low, "step": np.abs(table.step), "load": table.load},
        table.names,
        along=np.sign(table.step),
        progress=progress,
    )
