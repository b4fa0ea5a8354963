"""``pamsim diagnose`` of angles at rest: which effects a rig lacks that misses a static table."""

from __future__ import annotations

import importlib.metadata
import math
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, ParameterError
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.diagnosis.row_evidence import rms_interval95
from pamsim.diagnosis.row_fit import RowSimulator
from pamsim.diagnosis.row_model import RowEffect, RowModel
from pamsim.diagnosis.row_where import RowMap
from pamsim.diagnosis.static_diagnosis import StaticDiagnosis, diagnose_rows
from pamsim.diagnosis.verdict import Verdict
from pamsim.effects.catalog import EFFECTS, MUSCLE_SHAPE, effect
from pamsim.effects.effect import Effect
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.store.static_table import StaticTable
from pamsim.sysid.free_parameter import FreeParameter
from pamsim.workflows.effect_candidates import at_size, candidate
from pamsim.workflows.rest_prediction import RestPredictor, Values

FloatArray = NDArray[np.float64]
Tell = Callable[[int, str], None]
"""Called as ``tell(parameter sets predicted so far, what is being tried)``."""

SCHEMA = "pamsim-diagnosis/1"
CHANNEL = "angle_at_rest"

WHEEL = "wheel radius"
"""Ordinary parameter: one radius for the wheels of all tendons."""

ORDINARY = (WHEEL,)
"""What a table of angles leaves open of any arm whose wheel was not measured: it is refitted with
every effect, so that none is named for what another wheel would do."""

_WHEEL_RANGE = (0.64, 1.6)  # of the rig's own: 8 to 20 mm of the MAS-20 arm's 12.44

_PATH = (
    "coulomb_friction",
    "stribeck_friction",
    "muscle_hysteresis",
    "viscoelastic_creep",
    "chain_backlash",
)
_PRESSURES = ("air_leak", "supply_sag", "valve_dead_zone", "valve_flow")
_FORCE_PER_PRESSURE = "N/Pa"
_SIZES = (1.0, 3.0, 6.0, -1.0, -3.0)  # of the typical one, at which fits begin
_INSIDE = 1e-3


@dataclass(frozen=True, kw_only=True)
class RestReport:
    """A diagnosis of angles at rest with what it was made from.

    Attributes:
        rig: without effects.
        repaired: with the claimed effects; None if nothing is claimed.
        table: the measurements.
        found: the diagnosis.
        published_rms: of the rig as it stands, nothing refitted [rad].
        resolution: of the angle: what the encoder cannot tell apart, as a standard deviation [rad].
        separating: effect -> the experiment that tells it from its look-alikes.
        skipped: effect -> why it could not be tried.
        notes: what a reader should know, one sentence each.
        seed: of sign flips and exchanges.
        simulations: rows that were simulated in time.
        balances: rows that were solved for their balance of torques.
        seconds: it took.
    """

    rig: Rig
    repaired: Rig | None
    table: StaticTable
    found: StaticDiagnosis
    published_rms: float
    resolution: float
    separating: Mapping[str, str]
    skipped: dict[str, str]
    notes: tuple[str, ...]
    seed: int
    simulations: int
    balances: int
    seconds: float

    def as_dict(self) -> dict[str, Any]:
        """The content of ``diagnosis.json``, units in the key names; parameters in SI."""
        found = self.found
        best = found.best
        return {
            "schema": SCHEMA,
            "kind": "angles_at_rest",
            "rig": self.rig.name,
            "table": self.table.name,
            "verdict": str(found.verdict),
            "sentence": self.sentence(),
            "effects": [] if best is None else self._effects(best),
            "alternatives": [self._alternative(other) for other in found.tied],
            "where": [self._where(m) for m in found.before],
            "where_after": [self._where(m) for m in found.after],
            "gap": self._gap(),
            "rows": self._rows(),
            "tried": [
                {
                    "beside": list(t.beside),
                    "name": t.name,
                    "rms_deg": t.rms * DEG_PER_RAD,
                    "left_out_rms_deg": t.left_out_rms * DEG_PER_RAD,
                    "p_value_unseen": t.p_value,
                    "p_value_luck": t.luck,
                    "earned": t.earned,
                }
                for t in found.tried
            ],
            "ordinary": self._parameters(best or found.base, found.base.fit.parameters),
            "absent": {
                name: {
                    "parameter": parameter,
                    "unit": rig_parameter(self.rig, parameter).spec.unit,
                    "largest_distance_from_neutral": size,
                }
                for name, (parameter, size) in found.absent.items()
            },
            "skipped": dict(self.skipped),
            "next_experiment": self._next(),
            "notes": list(self.notes),
            "seed": self.seed,
            "versions": {
                "python": platform.python_version(),
                **{n: importlib.metadata.version(n) for n in ("pamsim", "mujoco", "numpy")},
            },
            "rollouts": self.simulations,
            "balances": self.balances,
            "seconds": self.seconds,
        }

    def sentence(self) -> str:
        """The verdict for a person."""
        found, best = self.found, self.found.best
        before = f"{found.base.left.rms * DEG_PER_RAD:.2f} deg"
        if found.verdict is Verdict.NO_GAP:
            return (
                f"No effect of the library earns its place on these rows, and what is left of them"
                f" ({before} RMS at rows left out) follows no pressure and no load."
            )
        if best is None:
            return (
                f"The rows are missed by {before} RMS in a way that follows"
                f" {found.before[0].quantity.replace('_', ' ')}, and no effect explains it."
            )
        missing = " and ".join(known(name).missing for name in best.names)
        after = f"{best.left.rms * DEG_PER_RAD:.2f} deg"
        return f"The model lacks {missing}: error at rows left out {before} before, {after} after."

    def repaired_rows(self) -> tuple[str, ...]:
        """Rows off by more than twice the rest's error after the repair before it, not after."""
        best = self.found.best
        if best is None:
            return ()
        before, after = np.abs(self.found.base.left.residual), np.abs(best.left.residual)
        limit = 2.0 * best.left.rms
        return tuple(
            row
            for row, b, a in zip(self.table.rows, before, after, strict=True)
            if b > limit and a < 0.5 * b
        )

    def _effects(self, best: RowModel) -> list[dict[str, Any]]:
        base = self.found.base.left.rms
        found: list[dict[str, Any]] = []
        for number, one in enumerate(best.effects):
            step = next(
                (
                    t
                    for t in self.found.tried
                    if t.name == one.name and set(t.beside) <= set(best.names) and t.earned
                    and len(t.beside) == number
                ),
                None,
            )  # fmt: skip
            found.append(
                {
                    "name": one.name,
                    "family": one.family,
                    "missing": known(one.name).missing,
                    "sure": one.name in self.found.sure,
                    "parameters": self._parameters(best, one.parameters),
                    "explained": self.found.explained,
                    "left_out_rms_before_deg": base * DEG_PER_RAD,
                    "p_value": None if step is None else step.luck,
                    "p_value_unseen": None if step is None else step.p_value,
                }
            )
        return found

    def _parameters(
        self, model: RowModel, parameters: Sequence[FreeParameter]
    ) -> dict[str, dict[str, Any]]:
        intervals = model.intervals
        return {
            p.name: {
                "value": model.fit.values[p.name],
                "unit": p.unit,
                "interval95": list(intervals[p.name]),
                "at_bound": p.name in model.fit.at_bound,
            }
            for p in parameters
        }

    def _alternative(self, other: RowModel) -> dict[str, Any]:
        best = self.found.best
        assert best is not None
        instead = [name for name in best.names if name not in other.names]
        new = next(e for e in other.effects if e.name not in best.names)
        difference = other.left.residual**2 - best.left.residual**2
        error = float(np.std(difference, ddof=1)) / math.sqrt(difference.size)
        return {
            "name": new.name,
            "family": new.family,
            "instead_of": instead[0],
            "left_out_rms_deg": other.left.rms * DEG_PER_RAD,
            "loss_difference_in_standard_errors": float(np.mean(difference)) / error,
            "parameters": self._parameters(other, new.parameters),
        }

    def _where(self, found: RowMap) -> dict[str, Any]:
        scale, unit = _DISPLAY.get(found.quantity, (1.0, "1"))
        return {
            "channel": CHANNEL,
            "protocol": self.table.name,
            "quantity": found.quantity,
            "unit": unit,
            "region": [scale * end for end in found.region],
            "rows": list(found.rows[found.worst]),
            "mean_deg": float(found.mean[found.worst]) * DEG_PER_RAD,
            "p_value": found.p_value,
            "bins": [
                {
                    "from": scale * float(low),
                    "to": scale * float(high),
                    "mean_deg": float(mean) * DEG_PER_RAD,
                    "rms_deg": float(spread) * DEG_PER_RAD,
                    "rows": list(rows),
                }
                for low, high, mean, spread, rows in zip(
                    found.edges[:-1], found.edges[1:], found.mean, found.spread, found.rows,
                    strict=True,
                )
            ],
        }  # fmt: skip

    def _gap(self) -> dict[str, Any]:
        def scored(model: RowModel | None) -> dict[str, Any] | None:
            if model is None:
                return None
            ends = rms_interval95(model.left.residual, seed=self.seed)
            return {
                "value_deg": model.left.rms * DEG_PER_RAD,
                "interval95_deg": [end * DEG_PER_RAD for end in ends],
                "in_sample_deg": model.fit.rms * DEG_PER_RAD,
            }

        return {
            CHANNEL: {
                "held_out": "each row by the fit without it",
                "as_it_stands_deg": self.published_rms * DEG_PER_RAD,
                "floor": {
                    "value_deg": self.resolution * DEG_PER_RAD,
                    "meaning": "a lower bound, the resolution of the angle; there are no repeats",
                },
                "before": scored(self.found.base),
                "after": scored(self.found.best),
            }
        }

    def _rows(self) -> list[dict[str, Any]]:
        best, repaired = self.found.best, self.repaired_rows()
        base = self.found.base.left.residual
        after = base if best is None else best.left.residual
        return [
            {
                "row": row,
                **{
                    f"p{k + 1}_kpa": float(p) / PA_PER_KPA
                    for k, p in enumerate(self.table.pressure[i])
                },
                "load_kg": float(self.table.load[i]),
                "angle_deg": float(self.table.angle[i]) * DEG_PER_RAD,
                "before_deg": float(base[i]) * DEG_PER_RAD,
                "after_deg": None if best is None else float(after[i]) * DEG_PER_RAD,
                "repaired": row in repaired,
            }
            for i, row in enumerate(self.table.rows)
        ]

    def _next(self) -> str | None:
        best = self.found.best
        if best is None:
            return None
        doubtful = [n for other in self.found.tied for n in best.names if n not in other.names]
        return self.separating[doubtful[0] if doubtful else best.names[-1]]


_DISPLAY = {
    "common_pressure": (1.0 / PA_PER_KPA, "kPa"),
    "pressure_difference": (1.0 / PA_PER_KPA, "kPa"),
    "load": (1.0, "kg"),
    "direction": (1.0, "1"),
}


def known(name: str) -> Effect:
    """An effect of the catalogue by its name."""
    return effect(name)


def diagnose_rest(
    table: StaticTable,
    rig: Rig,
    *,
    effects: Sequence[str] = (),
    ordinary: Sequence[str] = ORDINARY,
    seed: int = 0,
    threads: int | None = None,
    progress: Tell | None = None,
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
        progress: see `Tell`.

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
            progress(simulator.evaluations, what)

    tried, skipped = _effects(rig, effects, {p.name for p in freed})
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
        separating={name: e.separating for name, e in {**EFFECTS, **MUSCLE_SHAPE}.items()},
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


def _effects(
    rig: Rig, names: Sequence[str], freed: set[str]
) -> tuple[list[RowEffect], dict[str, str]]:
    """The effects that can be tried on a rig's angles at rest, and why others cannot."""
    found: list[RowEffect] = []
    skipped: dict[str, str] = {}
    for name in names or (*EFFECTS, *MUSCLE_SHAPE):
        one = effect(name)
        if name in _PATH:
            skipped[name] = "acts through the path, which angles at rest do not tell"
        elif name in _PRESSURES:
            skipped[name] = "acts through the pressures, which the table gives as measured"
        else:
            try:
                made = _row_effect(rig, one)
            except InputError as error:
                skipped[name] = str(error)
                continue
            if {p.name for p in made.parameters} & freed:
                skipped[name] = "its parameter is refitted with every effect"
            else:
                found.append(made)
    return found, skipped


def _row_effect(rig: Rig, one: Effect) -> RowEffect:
    for parameter in one.parameters:
        if parameter.name in ("force.a", "force.d"):
            unit = rig_parameter(rig, parameter.name).spec.unit
            if unit != _FORCE_PER_PRESSURE:
                raise InputError(f"{parameter.name} of this rig's force law is another number")
    made = candidate(rig, one)
    starts = [{**at_size(rig, one, size)} for size in _SIZES]
    starts += [
        {**starts[0], made.parameters[k].name: value}
        for k, parameter in enumerate(one.parameters)
        for value in parameter.starts
    ]
    inside: list[dict[str, float]] = []
    for start in starts:
        kept = {
            p.name: min(
                max(start[p.name], p.low + _INSIDE * (p.high - p.low)),
                p.high - _INSIDE * (p.high - p.low),
            )
            for p in made.parameters
        }
        if kept not in inside:
            inside.append(kept)
    return RowEffect(
        name=one.name,
        family=one.family,
        parameters=made.parameters,
        neutral=made.neutral,
        starts=tuple(inside),
    )
