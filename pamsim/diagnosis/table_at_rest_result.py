"""The result of a diagnosis of a table at rest, in the units of the rig's file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pamsim.comparison.effects_on_rig import rig_effect
from pamsim.comparison.readable_unit import readable, readable_unit
from pamsim.comparison.trial_prediction import AT_REST
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.diagnosis.method.evidence import compare_rows
from pamsim.diagnosis.method.rivals import shared_names
from pamsim.diagnosis.method.row_diagnosis import RowDiagnosis
from pamsim.diagnosis.method.row_model import RowModel
from pamsim.diagnosis.method.row_search import Attempt
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.verdict_thresholds import FEWEST_ROWS
from pamsim.diagnosis.method.where import ResidualMap
from pamsim.diagnosis.physical_size import physical_sizes
from pamsim.diagnosis.pulley_radius import PULLEY
from pamsim.diagnosis.result import (
    Details,
    Diagnosis,
    FoundEffect,
    GapEntry,
    NextStep,
    NuisanceEntry,
    Place,
    Resemblance,
    RmsLevel,
    TriedModel,
)
from pamsim.diagnosis.rig_estimates import absent_entry, estimates
from pamsim.diagnosis.where_entries import map_entry, region
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.inference.permutation import rms_interval95
from pamsim.recordings.static_table import StaticTable

MM_PER_M = 1e3


def result_of(
    rig: Rig,
    table: StaticTable,
    method: RowDiagnosis,
    *,
    as_it_stands: float,
    resolution: float,
    skipped: Mapping[str, str],
    seed: int,
    rollouts: int,
    balances: int,
    seconds: float,
) -> Diagnosis:
    """Write the method's result in the units of the rig's file.

    Args:
        rig: without effects.
        table: the measurements.
        method: result of the method.
        as_it_stands: root mean square residual of the rig as it was given [rad].
        resolution: of the angle, as a standard deviation [rad].
        skipped: effect -> why it was not tried.
        seed: random seed.
        rollouts: rows that were simulated in time.
        balances: rows that were solved for their balance of torques.
        seconds: wall time.
    """
    best, verdict = method.best, method.verdict
    claimed = best if verdict.claims else None
    repairs = best if verdict.repairs else None
    models = [] if repairs is None else [repairs, *method.tied]
    certain = shared_names([m.names for m in models])
    return Diagnosis(
        kind="table",
        rig=rig.name,
        data=(table.name,),
        verdict=verdict,
        effects=() if claimed is None else _effects(rig, method, claimed),
        certain=certain,
        resembles=_resemblance(rig, method),
        alternatives=tuple(
            _alternative(rig, method, model, seed) for model in models if model is not claimed
        ),
        where=_places(table, method.before),
        maps=tuple(map_entry(m, "deg", DEG_PER_RAD) for m in method.before),
        maps_after=tuple(map_entry(m, "deg", DEG_PER_RAD) for m in method.after),
        gap={
            AT_REST: GapEntry(
                unit="deg",
                floor=RmsLevel.scaled(resolution, DEG_PER_RAD),
                before=_left_out_level(method.base, seed),
                after=None if repairs is None else _left_out_level(repairs, seed),
                as_it_stands=RmsLevel.scaled(as_it_stands, DEG_PER_RAD),
            )
        },
        absent={limit.effect: absent_entry(rig, limit) for limit in method.absent},
        warnings=(
            *table.notes,
            "the rows have no repeats, so that no noise floor is known: the resolution of the angle"
            " is a lower bound, and what is left may be more than noise",
        ),
        next_experiment=_next_step(rig, method, certain),
        explained=method.explained.value,
        explained_interval95=method.explained.interval95,
        inconclusive=f"a table needs {FEWEST_ROWS} rows for a verdict, and this has"
        f" {len(table.rows)}"
        if verdict is Verdict.NOT_IDENTIFIABLE
        else None,
        effects_tried=len(method.moving),
        tried=tuple(_tried(attempt) for attempt in method.attempts),
        nuisance=_nuisance(rig, method),
        held_out=table.rows,
        held_out_method="each row is predicted by a fit that has not seen it",
        skipped=dict(skipped),
        details=Details(
            floor_is="a lower bound, the resolution of the angle; there are no repeats",
            in_sample={
                "before": RmsLevel.scaled(method.base.fit.rms, DEG_PER_RAD),
                "after": None if best is None else RmsLevel.scaled(best.fit.rms, DEG_PER_RAD),
            },
            rows=_rows(table, method),
            balances=balances,
        ),
        seed=seed,
        rollouts=rollouts,
        parameter_sets=method.evaluations,
        seconds=seconds,
        method=method,
    )


def repaired_rows(rows: Sequence[str], method: RowDiagnosis) -> tuple[str, ...]:
    """Rows that the base model misses by twice the repaired model's error, and the repair halves.

    Args:
        rows: names of all rows.
        method: result of the method.
    """
    best = method.best
    if best is None:
        return ()
    before = np.abs(method.base.left_out.residual)
    after = np.abs(best.left_out.residual)
    limit = 2.0 * best.left_out.rms
    return tuple(
        row for row, b, a in zip(rows, before, after, strict=True) if b > limit and a < 0.5 * b
    )


def _left_out_level(model: RowModel, seed: int) -> RmsLevel:
    left = model.left_out
    return RmsLevel.scaled(left.rms, DEG_PER_RAD, rms_interval95(left.residual, seed=seed))


def _effects(rig: Rig, method: RowDiagnosis, best: RowModel) -> tuple[FoundEffect, ...]:
    """The claimed effects; of several, each with what it explained when it was added."""
    effects: list[FoundEffect] = []
    for number, row_effect in enumerate(best.effects):
        step = _step(method, row_effect.name, best.names[:number])
        explained = method.explained.value
        if len(best.effects) > 1:
            explained = None if step is None else _share_of_step(method, step)
        effects.append(
            FoundEffect(
                members={row_effect.name: rig_effect(rig, row_effect.name).missing},
                family=row_effect.family,
                parameters=estimates(rig, best, [p.name for p in row_effect.parameters]),
                physical=physical_sizes(rig, best, [row_effect]),
                explained=explained,
                p_value=None if step is None else step.p_value,
            )
        )
    return tuple(effects)


def _step(method: RowDiagnosis, name: str, beside: Sequence[str]) -> Attempt | None:
    """The attempt in which an effect was accepted."""
    for attempt in method.attempts:
        if attempt.name == name and set(attempt.beside) == set(beside) and attempt.accepted:
            return attempt
    return None


def _share_of_step(method: RowDiagnosis, step: Attempt) -> float | None:
    """Share of the base model's mean square at unseen rows that an attempt removed."""
    base = method.base.left_out.rms
    parent = base if not step.beside else None
    if step.beside:
        earlier = _step(method, step.beside[-1], step.beside[:-1])
        parent = None if earlier is None else earlier.left_out_rms
    return None if parent is None else (parent**2 - step.left_out_rms**2) / base**2


def _alternative(rig: Rig, method: RowDiagnosis, model: RowModel, seed: int) -> FoundEffect:
    best = method.best
    assert best is not None
    behind = compare_rows(model.left_out.residual, best.left_out.residual, seed=seed)
    variance = method.base.left_out.rms**2
    return FoundEffect(
        members={e.name: rig_effect(rig, e.name).missing for e in model.effects},
        family=model.family,
        parameters=estimates(rig, model, [p.name for e in model.effects for p in e.parameters]),
        physical=physical_sizes(rig, model, model.effects),
        explained=1.0 - model.left_out.rms**2 / variance,
        p_value=model.p_value,
        loss_difference=behind.gain / variance,
        standard_errors_behind=0.0 if model is best else behind.standard_errors,
    )


def _resemblance(rig: Rig, method: RowDiagnosis) -> Resemblance | None:
    """The best model, or else the effect that comes nearest."""
    if method.verdict is Verdict.NO_GAP:
        return None
    if method.best is not None:
        return Resemblance(
            name="+".join(method.best.names),
            family=method.best.family,
            explained=method.explained.value,
            p_value=method.best.p_value,
        )
    if not method.attempts:
        return None
    near = min(method.attempts, key=lambda a: a.left_out_rms)
    return Resemblance(
        name=near.name,
        family=rig_effect(rig, near.name).family,
        explained=max(1.0 - (near.left_out_rms / method.base.left_out.rms) ** 2, 0.0),
        p_value=near.p_value,
    )


def _places(table: StaticTable, maps: Sequence[ResidualMap]) -> tuple[Place, ...]:
    """The region of each map, the most significant first; p-values are Bonferroni-corrected."""
    return tuple(
        Place(
            channel=AT_REST,
            protocol=table.name,
            excess=None,
            p_value=min(residual_map.p_value * len(maps), 1.0),
            region=region(residual_map),
        )
        for residual_map in maps
    )


def _next_step(rig: Rig, method: RowDiagnosis, certain: Sequence[str]) -> NextStep | None:
    """What separates the first effect that is not certain, or confirms the last, in words."""
    if method.best is None:
        return None
    uncertain = [name for name in method.best.names if name not in certain]
    name = uncertain[0] if uncertain else method.best.names[-1]
    return NextStep(protocol=None, advice=rig_effect(rig, name).separating)


def _tried(attempt: Attempt) -> TriedModel:
    return TriedModel(
        effects=(*attempt.beside, attempt.name),
        held_out=attempt.left_out_rms * DEG_PER_RAD,
        unit="deg",
        in_sample=attempt.rms * DEG_PER_RAD,
        p_value=attempt.p_value,
        p_value_unseen=attempt.p_value_unseen,
        accepted=attempt.accepted,
    )


def _nuisance(rig: Rig, method: RowDiagnosis) -> tuple[NuisanceEntry, ...]:
    entries: list[NuisanceEntry] = []
    for free in method.base.fit.parameters:
        unit, scale = "mm", MM_PER_M
        if free.name != PULLEY:
            parameter = rig_parameter(rig, free.name)
            unit, scale = readable_unit(parameter), readable(parameter, 1.0)
        best = None if method.best is None else method.best.fit.values[free.name]
        low, high = (method.best or method.base).intervals[free.name]
        entries.append(
            NuisanceEntry(
                parameter=free.name,
                unit=unit,
                before=free.start * scale,
                refitted=method.base.fit.values[free.name] * scale,
                with_effects=None if best is None else best * scale,
                interval95=(low * scale, high * scale),
                at_bound=free.name in (method.best or method.base).fit.at_bound,
            )
        )
    return tuple(entries)


def _rows(table: StaticTable, method: RowDiagnosis) -> tuple[dict[str, Any], ...]:
    best, repaired = method.best, repaired_rows(table.rows, method)
    before = method.base.left_out.residual
    after = None if best is None else best.left_out.residual
    return tuple(
        {
            "row": row,
            **{
                f"p{k + 1}_kpa": pressure / PA_PER_KPA
                for k, pressure in enumerate(table.pressure[i])
            },
            "load_kg": table.load[i],
            "angle_deg": table.angle[i] * DEG_PER_RAD,
            "before_deg": before[i] * DEG_PER_RAD,
            "after_deg": None if after is None else after[i] * DEG_PER_RAD,
            "repaired": row in repaired,
        }
        for i, row in enumerate(table.rows)
    )
