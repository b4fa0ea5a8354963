"""A table of angles at rest in closed form, quick enough to diagnose hundreds of times."""

import numpy as np

from pamsim.comparison.candidate import Candidate, Probe
from pamsim.comparison.rest_simulator import RestSimulator, table_blocks
from pamsim.diagnosis.by_link.diagnose_rest import diagnose_rest
from pamsim.effects.effect import Effect, EffectParameter
from pamsim.inference.free_parameter import FreeParameter
from pamsim.recordings.static_table import StaticTable

OWN = {"gain": 0.12, "lock": 0.0, "soften": 0.0, "tilt": 0.0, "bias": 0.0, "copy": 0.0, "wave": 0.0}
NOISE = 0.01


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


def candidate(name, typical, low, high, family=None):
    free = FreeParameter(name=name, unit="1", start=typical, low=low, high=high)
    effect = Effect(
        name=name,
        link="muscle",
        family=family or name,
        missing="",
        parameters=(EffectParameter(name, typical, low, high),),
        look_alikes=(),
        separating="",
    )
    probe = Probe(size=1.0, values={name: typical})
    return Candidate(effect=effect, parameters=(free,), neutral={name: 0.0}, probes=(probe,))


LOCK = candidate("lock", 0.5, 0.0, 8.0)
SOFTEN = candidate("soften", 0.03, -0.3, 0.3)
TILT = candidate("tilt", 0.5, -5.0, 5.0)
BIAS = candidate("bias", 0.01, -0.1, 0.1)
LIBRARY = (LOCK, SOFTEN, TILT, BIAS)


def measured(table, hidden, *, noise=NOISE, seed=0):
    scatter = np.random.default_rng([seed, 7]).standard_normal(table.step.size)
    return table.angle(hidden) + noise * scatter


def simulator(table, angle, variance=1e-4):
    static = StaticTable(
        name="toy", rows=table.names, pressure=table.low, load=table.load, angle=angle
    )
    return RestSimulator(
        lambda sets: [table.angle(values) - angle for values in sets],
        table_blocks(static, variance),
        np.stack([table.low, table.step, table.load], axis=1),
        OWN,
    )


def diagnosed(table, angle, effects=LIBRARY, *, nuisance=("gain",), **options):
    return diagnose_rest(
        lambda variance, _: simulator(table, angle, variance), effects, nuisance, **options
    )


def levels(found):
    return {judged.effect.name: judged.level() for judged in found.effects}
