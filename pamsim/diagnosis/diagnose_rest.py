"""``pamsim diagnose`` of angles at rest: which effects a rig lacks that misses a static table."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.rest_prediction import RestPredictor, Values
from pamsim.core.errors import InputError, ParameterError
from pamsim.core.progress import Progress
from pamsim.diagnosis.method.row_fit import RowSimulator
from pamsim.diagnosis.method.static_diagnosis import diagnose_rows
from pamsim.diagnosis.rest_effects import effects_at_rest
from pamsim.diagnosis.rest_report import RestReport
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.inference.free_parameter import FreeParameter
from pamsim.store.static_table import StaticTable

FloatArray = NDArray[np.float64]
WHEEL = "wheel radius"
"""Ordinary parameter: one radius for the wheels of all tendons."""

ORDINARY = (WHEEL,)
"""What a table of angles leaves open of any arm whose wheel was not measured: it is refitted with
every effect, so that none is named for what another wheel would do."""

_WHEEL_RANGE = (0.64, 1.6)  # of the rig's own: 8 to 20 mm of the MAS-20 arm's 12.44


def diagnose_rest(
    table: StaticTable,
    rig: Rig,
    *,
    effects: Sequence[str] = (),
    ordinary: Sequence[str] = ORDINARY,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> RestReport:
    """Diagnose a rig by the angles at which the arm came to rest.

    Args:
        table: see `pamsim.store.static_table.read_static_table`.
        rig: its model.
        effects: names of those that may be missing; all that act at rest if left out.
        ordinary: rig parameters that are refitted with every effect; ``wheel radius`` is the radius
            of all tendons' wheels.
        seed: of sign flips and exchanges.
        threads: simulations at a time; None for one per processor.
        progress: called with the number of parameter sets predicted so far.

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
    wheels = [n for n in rig.file.native if n.startswith("tendon.") and n.endswith(".coef")]
    freed = [_ordinary(rig, name, wheels) for name in ordinary if name != WHEEL or wheels]

    def rig_of(values: Values) -> Rig | None:
        named = {name: value for name, value in values.items() if name != WHEEL}
        if WHEEL in values:
            named |= dict.fromkeys(wheels, values[WHEEL])
        try:
            return rig.with_parameters(named)
        except ParameterError:  # an open end of a range
            return None

    predictor = RestPredictor(rig_of, table, threads=threads)
    simulator = RowSimulator(predict=predictor.predict, anchor=predictor.anchor)

    def told(what: str) -> None:
        if progress is not None:
            progress(simulator.evaluations, None, what)

    tried, skipped = effects_at_rest(rig, effects, {p.name for p in freed})
    start = {p.name: p.start for p in freed}
    predictor.anchor(start)
    (as_it_stands,) = simulator.many([start])
    if as_it_stands is None:
        raise InputError(f"{table.name}: the rig has no angle at rest for some row")
    found = diagnose_rows(
        simulator,
        freed,
        tried,
        _quantities(table),
        table.rows,
        along=np.where(table.angle < 0.0, -1.0, 1.0),
        seed=seed,
        told=told,
    )
    skipped |= {
        e.name: "moves no angle at rest" for e in tried if e.name not in found.moving
    }  # fmt: skip
    best = found.best
    increments = rig.sensor.encoder_increments if rig.sensor else 0.0
    return RestReport(
        rig=rig,
        repaired=None if best is None else rig_of(best.fit.values),
        table=table,
        found=found,
        published_rms=float(np.sqrt(np.mean(as_it_stands**2))),
        resolution=2.0 * math.pi / increments / math.sqrt(12.0) if increments else 0.0,
        skipped=skipped,
        notes=(
            *table.notes,
            "the rows hold no repeats, so that no noise floor is known: the resolution of the angle"
            " is a lower bound, and what is left may be more than noise",
        ),
        seed=seed,
        simulations=predictor.simulations,
        balances=predictor.balances,
        seconds=time.perf_counter() - began,
    )


def _quantities(table: StaticTable) -> dict[str, FloatArray]:
    # What all muscles share is what stiffens the arm; the mean would mix it with the difference.
    found = {"common_pressure": table.pressure.min(axis=1), "load": table.load}
    if table.pressure.shape[1] == 2:
        found["pressure_difference"] = np.abs(table.pressure[:, 0] - table.pressure[:, 1])
    found["direction"] = np.where(table.angle < 0.0, -1.0, 1.0)
    return found


def _ordinary(rig: Rig, name: str, wheels: Sequence[str]) -> FreeParameter:
    if name == WHEEL:
        own = rig_parameter(rig, wheels[0]).value
        low, high = (factor * own for factor in _WHEEL_RANGE)
        return FreeParameter(name=WHEEL, unit="m", start=own, low=low, high=high)
    found = rig_parameter(rig, name)
    low, high = sorted((0.7 * found.value, 1.4 * found.value))
    low, high = max(low, found.spec.low), min(high, found.spec.high)
    return FreeParameter(name=name, unit=found.spec.unit, start=found.value, low=low, high=high)
