"""Operating points of trials: steps that are held long enough, with a local linear model each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamsim.core.computation import Progress
from pamsim.core.errors import InputError
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.local_models import (
    LocalModel,
    LocalModelMap,
    OperatingPoint,
    local_model_map,
)
from pamsim.identification.model import IdentifiedModel
from pamsim.identification.records import FEWEST_SAMPLES, SignalRecord
from pamsim.identification.signals import SignalTable, UsedTrial

_LONG_ENOUGH = 2.0  # slowest time constants that a held input must last to show a gain
_LEAD = 0.2  # share of the plateau before a step that shows where it starts from
_LEVEL_GRID = 2e3  # [Pa]: levels of one step differ by less, from sensor noise
_SETTLED = 0.05  # change over that share, against the step's own, from which it had not settled
_MOST = 100  # points with a model of their own: enough for how they depend on four quantities

Piece = tuple[SignalRecord, OperatingPoint]


def fit_operating_points(
    trials: Sequence[UsedTrial],
    fit: IdentifiedModel,
    progress: Progress | None = None,
) -> tuple[LocalModelMap | None, list[str]]:
    """Fit the structure of a model of one input again at every operating point.

    A trial whose input is held long enough to settle is cut into its steps, others stay whole.
    The same step of trials that repeat each other (same protocol and load) is one point. Of more
    than a hundred points some are drawn.

    Returns:
        The map, or None for fewer than two points; and notes on steps that were not used.
    """
    structure = fit.structure
    assert isinstance(structure, ContinuousStructure)
    if structure.integrators:
        return None, ["no model for each operating point: the output integrates"]
    slowest = max((abs(1.0 / pole) for pole in fit.poles), default=0.0)
    groups: dict[tuple[str, float, int, int], list[Piece]] = {}
    notes: list[str] = []
    for trial in trials:
        pieces, remarks = _pieces(trial, slowest)
        notes += remarks
        for index, piece in pieces:
            key = (trial.table.protocol, trial.table.load, index, piece[1].direction)
            groups.setdefault(key, []).append(piece)
    if len(groups) < 2:
        return None, notes
    points = list(groups.values())
    if len(points) > _MOST:
        notes.append(f"of {len(points)} operating points {_MOST}, drawn at random, have a model")
        # Not every tenth: in a record of steps to and fro all of those may go one way.
        drawn = np.random.default_rng(0).choice(len(points), _MOST, replace=False)
        points = [points[k] for k in np.sort(drawn)]
    models: list[LocalModel] = []
    for done, group in enumerate(points):
        if progress is not None:
            progress(done, len(points), "operating points")
        try:
            local = fit_model([record for record, _ in group], structure)
        except InputError as error:
            notes.append(f"{group[0][0].name}: no model of its own: {error}")
            continue
        models.append(LocalModel(_mean(group), local))
    return (local_model_map(models) if len(models) > 1 else None), notes


def _pieces(trial: UsedTrial, slowest: float) -> tuple[list[tuple[int, Piece]], list[str]]:
    """Steps of a record with their index, or the record itself with index 0."""
    table, record = trial.table, trial.record
    into = record.input
    changes = np.flatnonzero(np.diff(into) != 0.0) + 1
    if record.holds != ("zoh",) or changes.size < 2:
        # Of a single step; 0 for an input that goes both ways.
        direction = int(np.sign(into[-1] - into[0])) if changes.size == 1 else 0
        return [(0, (record, _point(table, record, direction)))], []
    whole = [(0, (record, _point(table, record, 0)))]
    ends = np.append(changes[1:], into.size)
    if np.min(ends - changes) * record.sample_time < _LONG_ENOUGH * slowest:
        return whole, []
    pieces: list[tuple[int, Piece]] = []
    notes: list[str] = []
    for index, (change, end) in enumerate(zip(changes, ends, strict=True)):
        before = changes[index - 1] if index else 0
        first = change - max(1, round(_LEAD * (change - before)))
        part = slice(int(first), int(end))
        if end - first < FEWEST_SAMPLES:
            notes.append(f"{table.name}: step {index + 1} is too short for a model of its own")
            continue
        lead = record.output[first:change]
        moved = record.output[end - 1] - record.output[change]
        # Means of the two halves, so that noise is not taken for drift.
        halves = np.array_split(lead, 2) if lead.size > 1 else [lead, lead]
        if abs(np.mean(halves[1]) - np.mean(halves[0])) > _SETTLED * abs(moved):
            notes.append(f"{table.name}: before step {index + 1} the output had not settled")
        try:
            cut = record.part(part, name=f"{table.name} step {index + 1}")
        except InputError as error:
            notes.append(f"{table.name}: step {index + 1} is not used: {error}")
            continue
        direction = int(np.sign(into[change] - into[change - 1]))
        pieces.append((index, (cut, _point(table, cut, direction))))
    return pieces or whole, notes


def _point(table: SignalTable, record: SignalRecord, direction: int) -> OperatingPoint:
    inside = (table.time >= record.time[0]) & (table.time <= record.time[-1])
    level = 0.0 if table.level is None else float(np.mean(table.level[inside]))
    return OperatingPoint(
        # Rounded, so that sensor noise does not make levels differ.
        pressure=_LEVEL_GRID * round(level / _LEVEL_GRID),
        load=table.load,
        direction=direction,
        amplitude=0.5 * float(np.ptp(record.input)),
    )


def _mean(group: Sequence[Piece]) -> OperatingPoint:
    points = [point for _, point in group]
    return OperatingPoint(
        pressure=float(np.mean([point.pressure for point in points])),
        load=points[0].load,
        direction=points[0].direction,
        amplitude=float(np.mean([point.amplitude for point in points])),
    )
