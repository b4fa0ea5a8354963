"""Diagnose a rig by a table of the angles at which it came to rest."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np

from pamsim.comparison.rest_prediction import RestPredictor, Values
from pamsim.comparison.trial_prediction import AT_REST
from pamsim.core.computation import Progress
from pamsim.core.errors import InputError, ParameterError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.effects_at_rest import effects_at_rest
from pamsim.diagnosis.method.row_diagnosis import diagnose_rows
from pamsim.diagnosis.method.row_fit import RowSimulator
from pamsim.diagnosis.pulley_radius import PULLEY, pulleys, with_fitted
from pamsim.diagnosis.result import Diagnosis
from pamsim.diagnosis.table_at_rest_result import result_of
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.inference.free_parameter import FreeParameter
from pamsim.recordings.static_table import StaticTable

NUISANCE = (PULLEY,)
"""What a table of angles leaves open of any arm whose pulley was not measured: it is refitted with
every effect, so that none is named for what another pulley would do."""

_PULLEY_RANGE = (0.64, 1.6)  # of the rig's own: 8 to 19 mm of the MAS-20 arm's 12.13
_NUISANCE_RANGE = (0.7, 1.4)  # of the rig's own value


def diagnose_table(
    table: StaticTable,
    rig: Rig,
    *,
    effects: Sequence[str] = (),
    nuisance: Sequence[str] = NUISANCE,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose a rig by the angles at which the arm came to rest.

    Args:
        table: see `pamsim.recordings.static_table.read_static_table`.
        rig: without effects.
        effects: names of those that may be missing; all that act at rest if left out.
        nuisance: rig parameters that are refitted with every effect; ``pulley radius`` is the
            radius of all tendons' pulleys.
        seed: random seed of sign flips and exchanges.
        threads: simulations at a time; None for one per processor.
        progress: called as each round of fits begins; how many there will be is an upper estimate.

    Raises:
        InputError: for an unknown effect or parameter, rows that the rig does not fit, too few
            rows, or a rig of several joints.
    """
    began = time.perf_counter()
    if table.pressure.shape[1] != len(rig.muscles):
        raise InputError(
            f"{table.name!r} is of {table.pressure.shape[1]} muscles, rig {rig.name!r} has"
            f" {len(rig.muscles)}"
        )
    _ = rig.only_joint
    radii = pulleys(rig)
    freed = [_nuisance(rig, name, radii) for name in nuisance if name != PULLEY or radii]
    predictor = RestPredictor(lambda values: rig_with(rig, values), table, threads=threads)
    simulator = RowSimulator(predict=predictor.predict, anchor=predictor.anchor)
    tried, skipped = effects_at_rest(rig, effects, {p.name for p in freed})
    start = {p.name: p.start for p in freed}
    predictor.anchor(start)
    (as_it_stands,) = simulator.many([start])
    if as_it_stands is None:
        raise InputError(f"{table.name}: the rig has no angle at rest for some row")
    method = diagnose_rows(
        simulator,
        freed,
        tried,
        _quantities(table),
        table.rows,
        channel=AT_REST,
        along=np.where(table.angle < 0.0, -1.0, 1.0),
        seed=seed,
        progress=progress,
    )
    still = {e.name: "moves no angle at rest" for e in tried if e.name not in method.moving}
    increments = rig.sensor.encoder_increments if rig.sensor else 0.0
    return result_of(
        rig,
        table,
        method,
        as_it_stands=float(np.sqrt(np.mean(as_it_stands**2))),
        resolution=2.0 * math.pi / increments / math.sqrt(12.0) if increments else 0.0,
        skipped={**skipped, **still},
        seed=seed,
        rollouts=predictor.simulations,
        balances=predictor.balances,
        seconds=time.perf_counter() - began,
    )


def rig_with(rig: Rig, values: Values) -> Rig | None:
    """The rig with fitted parameters.

    Args:
        rig: without effects.
        values: name -> value [SI], ``pulley radius`` among them.

    Returns:
        The rig; None where a value lies at an open end of its range.
    """
    try:
        return with_fitted(rig, values)
    except ParameterError:
        return None


def _quantities(table: StaticTable) -> dict[str, FloatArray]:
    # What all muscles share is what stiffens the arm; the mean would mix it with the difference.
    quantities = {"common_pressure": table.pressure.min(axis=1), "load": table.load}
    if table.pressure.shape[1] == 2:
        quantities["pressure_difference"] = np.abs(table.pressure[:, 0] - table.pressure[:, 1])
    quantities["direction"] = np.where(table.angle < 0.0, -1.0, 1.0)
    return quantities


def _nuisance(rig: Rig, name: str, radii: Sequence[str]) -> FreeParameter:
    if name == PULLEY:
        own = rig_parameter(rig, radii[0]).value
        low, high = (factor * own for factor in _PULLEY_RANGE)
        return FreeParameter(name=PULLEY, unit="m", start=own, low=low, high=high)
    parameter = rig_parameter(rig, name)
    low, high = sorted(factor * parameter.value for factor in _NUISANCE_RANGE)
    low, high = max(low, parameter.spec.low), min(high, parameter.spec.high)
    return FreeParameter(
        name=name, unit=parameter.spec.unit, start=parameter.value, low=low, high=high
    )
