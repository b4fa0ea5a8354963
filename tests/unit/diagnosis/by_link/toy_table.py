"""The table of `tests.unit.diagnosis.toy_rows` for the diagnosis link by link."""

from __future__ import annotations

import numpy as np

from pamsim.comparison.candidate import Candidate, Probe
from pamsim.comparison.rest_simulator import RestSimulator, table_blocks
from pamsim.diagnosis.by_link.diagnose_rest import diagnose_rest
from pamsim.effects.effect import Effect, EffectParameter
from pamsim.recordings.static_table import StaticTable
from tests.unit.diagnosis.toy_rows import LIBRARY, NUISANCE, OWN


def candidate(row_effect):
    (free,) = row_effect.parameters
    effect = Effect(
        name=row_effect.name,
        link="muscle",
        family=row_effect.family,
        missing="",
        parameters=(EffectParameter(free.name, free.start, free.low, free.high),),
        look_alikes=(),
        separating="",
    )
    probe = Probe(size=1.0, values={free.name: free.start})
    return Candidate(
        effect=effect, parameters=(free,), neutral=dict(row_effect.neutral), probes=(probe,)
    )


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


def diagnosed(table, angle, effects=LIBRARY, *, nuisance=NUISANCE, seed=0):
    return diagnose_rest(
        lambda variance, _: simulator(table, angle, variance),
        [candidate(effect) for effect in effects],
        [free.name for free in nuisance],
        seed=seed,
    )


def levels(found):
    return {judged.effect.name: judged.level() for judged in found.effects}
