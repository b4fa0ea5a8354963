"""Diagnose a rig by a table of the angles at which it came to rest."""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from pamsim.comparison.candidate import Candidate, Probe, inside
from pamsim.comparison.chain_runs import Values
from pamsim.comparison.effects_on_rig import at_size, candidates
from pamsim.comparison.rest_simulator import RestPredictor, RestSimulator, table_blocks
from pamsim.comparison.trial_prediction import AT_REST, check_table
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.diagnosis.by_link.diagnose_rest import diagnose_rest
from pamsim.diagnosis.by_link.entries import effect_entries, link_entries, nuisance_entries
from pamsim.diagnosis.by_link.next_experiment import next_reading
from pamsim.diagnosis.by_link.result import LinkReport, RowEntry, Run
from pamsim.diagnosis.fitted_rig import PULLEY, possible_rig, pulleys, stated
from pamsim.diagnosis.options import AS_USUAL, Options, refuse_zero
from pamsim.effects.catalog import ROW_EFFECTS
from pamsim.engine.rig import Rig, load_rig
from pamsim.physics.force_laws.published import PUBLISHED
from pamsim.recordings.static_table import StaticTable

NUISANCE = (PULLEY,)
"""What a table of angles leaves open of any arm whose pulley was not measured: it is refitted with
every effect, so that none is named for what another pulley would do."""

_PRINTED = 1e-2 / DEG_PER_RAD / math.sqrt(12.0)
"""Standard deviation [rad] of an angle that is printed to a hundredth of a degree: no table is
known better, and a model that fits it exactly leaves noise all the same."""

_INVISIBLE = 1e-7  # rad, change of a row that counts as none

_SIZE = 3.0
"""Size at which signatures are taken, in units of the typical one: the middle of those that tables
were fitted from before. Where a rig comes to rest depends on the whole of an effect and not on its
beginning, as of a braid that locks. Each further size would be free beside a further effect, and
leave few rows to show it."""


def diagnose_table(table: StaticTable, rig: Rig, options: Options = AS_USUAL) -> LinkReport:
    """Diagnose a rig by the angles at which the arm came to rest.

    Of the nuisance parameters, ``pulley radius`` is the radius of all tendons' pulleys.

    Raises:
        InputError: for an unknown effect or parameter, a nuisance parameter that is 0, rows that
            the rig does not fit, too few rows, or a rig of several joints.
    """
    began = time.perf_counter()
    check_table(rig, table)
    nuisance = options.nuisance or (NUISANCE if pulleys(rig) else ())
    own = {name: stated(rig, name).value for name in nuisance}
    refuse_zero(own)
    predictor = RestPredictor(partial(possible_rig, rig), table, threads=options.threads)
    inputs = np.column_stack([table.pressure, table.load])
    least = max(_resolution(rig), _PRINTED) ** 2

    def simulator_at(variance: float, exact_at: Values) -> RestSimulator:
        predictor.anchor(exact_at)
        blocks = table_blocks(table, max(variance, least))
        return RestSimulator(predictor.predict, blocks, inputs, own)

    tried, skipped = candidates_at_rest(rig, options.effects, set(nuisance))
    still = _still(predictor, tried)
    found = diagnose_rest(
        simulator_at,
        [one for one in tried if one.name not in still],
        nuisance,
        alpha=options.alpha,
        seed=options.seed,
        progress=options.progress,
    )
    return LinkReport(
        rig=rig.name,
        links=link_entries(found),
        effects=effect_entries(rig, found),
        gap={AT_REST: found.gap("deg", DEG_PER_RAD, _resolution(rig) * DEG_PER_RAD or None)},
        nuisance=nuisance_entries(rig, found, nuisance),
        next_experiment=next_reading(found),
        warnings=(
            *table.notes,
            "the rows have no repeats: their noise is what the best model leaves, and the floor in"
            " degrees is the resolution of the angle",
        ),
        alpha=found.limits.alpha,
        material=found.limits.material,
        run=Run(
            data=(table.name,),
            held_out=table.rows,
            effects_tried=len(tried) - len(still),
            skipped={**skipped, **dict.fromkeys(still, "moves no angle at rest")},
            seed=options.seed,
            seconds=time.perf_counter() - began,
        ),
        rows=tuple(
            RowEntry(
                row=row,
                pressure_kpa=tuple((table.pressure[i] / PA_PER_KPA).tolist()),
                load_kg=float(table.load[i]),
                angle_deg=float(table.angle[i]) * DEG_PER_RAD,
                before_deg=float(found.errors_before[i]) * DEG_PER_RAD,
                after_deg=float(found.errors_after[i]) * DEG_PER_RAD if found.effects else None,
            )
            for i, row in enumerate(table.rows)
        ),
    )


def _still(predictor: RestPredictor, tried: Sequence[Candidate]) -> list[str]:
    """Effects that move no row at any size at which they are tried."""
    (as_it_is,) = predictor.predict([{}])
    if as_it_is is None:
        return []
    still: list[str] = []
    for one in tried:
        moved = predictor.predict([probe.values for probe in one.probes])
        changes = [0.0 if r is None else np.max(np.abs(r - as_it_is)) for r in moved]
        if all(r is not None for r in moved) and max(changes) < _INVISIBLE:
            still.append(one.name)
    return still


def _resolution(rig: Rig) -> float:
    """Standard deviation of an angle by the steps of the rig's encoder [rad]; 0 without one."""
    increments = rig.sensor.encoder_increments if rig.sensor else 0.0
    return 2.0 * math.pi / increments / math.sqrt(12.0) if increments else 0.0


def candidates_at_rest(
    rig: Rig, names: Sequence[str], freed: Collection[str]
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """The effects that can be tried on a rig's rows at rest, and why others cannot.

    All are, if none are named; parameters that are ``freed`` are refitted with every effect.

    Raises:
        InputError: for an unknown effect, or if nothing is left to try.
    """
    own = [effect.name for effect in rig.file.own.effects]
    tried, skipped = candidates(rig, list(names or dict.fromkeys((*ROW_EFFECTS, *own))))
    acting: list[Candidate] = []
    for one in tried:
        if one.effect.invisible_at_rest:
            skipped[one.effect.name] = one.effect.invisible_at_rest
        elif {p.name for p in one.parameters} & set(freed):
            skipped[one.effect.name] = (
                "its parameter is a nuisance parameter, refitted with every effect"
            )
        else:
            probes = tuple({p.shape: p for p in _probes(rig, one)}.values())
            acting.append(replace(one, probes=probes))
    return tuple(acting), skipped


def _probes(rig: Rig, one: Candidate) -> Iterator[Probe]:
    """Every shape at the size at which rows at rest show an effect."""
    for probe in one.probes:
        shapes = {p.name: probe.values[p.name] for p in one.parameters if p.name not in one.neutral}
        values = inside(one.parameters, {**at_size(rig, one.effect, _SIZE), **shapes})
        yield Probe(size=_SIZE, values=values, shape=probe.shape)


def published_rig() -> Rig:
    """The MAS-20 arm with the published force map and without what was identified from its rows.

    The force law is the published one whole, its pressure-free part in place of the passive spring;
    no braid locks, pressure does not lengthen the muscle, and the load does not turn the arm. The
    sprocket's radius, which the paper does not print, stays at the assumed one.
    """
    law = PUBLISHED["DMSP-20-200"]  # successor of the MAS-20 whose constants are published
    return load_rig("mas20_arm").with_parameters(
        {
            "force.a": law.a,
            "force.b": law.b,
            "force.c": law.c,
            "force.d": law.d,
            "force.e": law.e,
            "force.f": law.f,
            "passive.stiffness": 0.0,
            "passive.softening": -law.c,
            "passive.locking": 0.0,
            "braid.extensibility": 0.0,
            "body.rig.tilt": 0.0,
        }
    )
