"""Static models compared: which physical terms the printed end positions of the arm support.

Each model frees some terms, is fitted to the 21 distinct printed end positions in the engine, and
is then fitted again without each row in turn, and without each block of rows (a size of step, a
load), to predict what was held out.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.engine.batch import simulate_batch
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.inference.fit_simulator import fit_simulator
from pamsim.inference.free_parameter import FreeParameter, SearchScale
from pamsim.inference.search import Priors
from pamsim.inference.simulator_fit import Blocks, ResidualBlock, Simulate, SimulatorFit, stacked
from pamsim.papers.calibration_record import SMALL_STEPS
from pamsim.papers.numerics import rms
from pamsim.papers.printed_steps import STARTS, printed_experiment
from pamsim.recordings.printed import PrintedStep, distinct_steps
from pamsim.recordings.recording import Outcome, Recording

_SAMPLE_RATE = 20.0
"""Of the simulated steps [Hz]: only their ends are looked at."""
_SETTLED = 1e-3  # change of a parameter, in units of its range, at which a refit is done
_MOST = 8  # iterations of a refit; two or three are usual


@dataclass(frozen=True, kw_only=True)
class Term:
    """A physical term that a model may free; values in SI."""

    name: str  # in words
    parameter: str  # of the rig
    low: float
    high: float
    start: float  # where the fit begins
    neutral: float  # at which the term is absent, or as published or assumed
    also: tuple[str, ...] = ()  # parameters that take the same value


@dataclass(frozen=True, kw_only=True)
class StaticModel:
    """A static model of the arm."""

    name: str  # in words
    terms: tuple[Term, ...]  # that are fitted; all others are at their neutral values
    accepted: bool  # whether it is on the way to the model that is used
    held: Mapping[str, float] = field(default_factory=dict[str, float])
    """Parameters held at another value than their neutral one [SI]."""


@dataclass(frozen=True, kw_only=True)
class StaticModelFit:
    """A fitted static model.

    Attributes:
        model: that was fitted.
        fit: of its free terms; None for a model without a free term.
        residual: simulated minus printed angle of each row, shape (n,) [rad].
        held_out: the same by the fit without that row, shape (n,) [rad].
        blocks: name of a block of rows -> root mean square error there of the fit without it [rad].
    """

    model: StaticModel
    fit: SimulatorFit | None
    residual: FloatArray
    held_out: FloatArray
    blocks: Mapping[str, float]

    @property
    def rms(self) -> float:
        """Root mean square error in sample [rad]."""
        return rms(self.residual)

    @property
    def leave_one_out_rms(self) -> float:
        """Root mean square error at rows held out in turn [rad]."""
        return rms(self.held_out)

    def to_dict(self) -> dict[str, Any]:
        """JSON-safe form, units in the key names; parameters in SI."""
        fitted = self.fit.parameters if self.fit else ()
        # By place in a parameter's range: parameters of all units are of one size.
        jacobian = (
            self.fit.linearisation.jacobian if self.fit else np.empty((self.residual.size, 0))
        )
        return {
            "name": self.model.name,
            "accepted": self.model.accepted,
            "rms_deg": self.rms * DEG_PER_RAD,
            "leave_one_out_rms_deg": self.leave_one_out_rms * DEG_PER_RAD,
            "parameters": [
                {
                    "term": term.name,
                    "name": term.parameter,
                    "unit": parameter.unit,
                    "value": parameter.value,
                    "interval95": list(parameter.interval95) if parameter.interval95 else None,
                    "flags": [str(flag) for flag in parameter.flags],
                }
                for term, parameter in zip(self.model.terms, fitted, strict=True)
            ],
            "left_out_block_rms_deg": {
                name: error * DEG_PER_RAD for name, error in self.blocks.items()
            },
            "jacobian_deg": (jacobian * DEG_PER_RAD).tolist(),
            "residual_deg": (self.residual * DEG_PER_RAD).tolist(),
            "leave_one_out_residual_deg": (self.held_out * DEG_PER_RAD).tolist(),
        }


def fit_static_models(
    rig: Rig,
    models: Sequence[StaticModel],
    terms: Sequence[Term],
    *,
    steps: tuple[PrintedStep, ...] | None = None,
    timestep: float | None = None,
    threads: int | None = None,
    report: Callable[[StaticModelFit], None] | None = None,
) -> tuple[StaticModelFit, ...]:
    """Fit every model to printed end positions.

    Args:
        rig: the arm.
        models: to fit.
        terms: all terms there are; those a model does not free are set to their neutral values.
        steps: printed rows; the distinct ones if left out.
        timestep: [s]; the rig's own if left out.
        threads: see `simulate_batch`.
        report: called with each result as soon as it is there.

    Returns:
        One result per model.
    """
    rows = distinct_steps() if steps is None else steps
    bare = rig.with_parameters(_values(terms, [term.neutral for term in terms]))
    results: list[StaticModelFit] = []
    for model in models:
        engine = _RowSimulator(
            bare.with_parameters(model.held), model.terms, rows, timestep, threads
        )
        results.append(_fitted(engine, model))
        if report:
            report(results[-1])
    return tuple(results)


def leave_one_out(
    simulate: Simulate, parameters: Sequence[FreeParameter], fit: SimulatorFit
) -> FloatArray:
    """Predicted minus measured of each row by the fit to all others, (n,) [SI].

    Every refit is a Gauss-Newton iteration with the Jacobian of the common optimum, which is close
    to its own; all refits are simulated in one call per iteration. Rows must not be ordered in
    time.

    Raises:
        InputError: a block of a time series, fewer rows than parameters, or a refit that diverges.
    """
    linear = fit.linearisation
    for place in linear.places:
        if place.block.sample_interval is not None:
            raise InputError(
                f"trial {place.block.trial}: single samples of a record cannot be left out,"
                " because their neighbours predict them; hold out whole trials"
            )
    count = linear.residual.size
    if count <= len(parameters) + 1:
        raise InputError(f"{count} rows less one do not determine {len(parameters)} parameters")
    scale = SearchScale(parameters)
    optimum = scale.to_unit(fit.values)
    priors = Priors(parameters, scale)
    jacobian = linear.jacobian * linear.weight[:, np.newaxis]
    pull = priors(optimum)[1]

    def step(i: int, residual: FloatArray, place: FloatArray) -> FloatArray:
        keep = np.arange(count) != i
        rows = np.vstack([jacobian[keep], pull])
        miss = np.concatenate([(residual * linear.weight)[keep], priors(place)[0]])
        return np.clip(place - np.linalg.lstsq(rows, miss, rcond=None)[0], 0.0, 1.0)

    at, left = np.tile(optimum, (count, 1)), np.tile(linear.residual, (count, 1))
    for _ in range(_MOST):
        moved = np.stack([step(i, left[i], at[i]) for i in range(count)])
        change = float(np.max(np.abs(moved - at)))
        at = moved
        for i, blocks in enumerate(simulate(scale.from_unit(at))):
            residual = stacked(blocks, linear.places)
            if residual is None:
                raise InputError(
                    f"without row {i + 1} the fit leaves the range that can be simulated"
                )
            left[i] = residual
        if change < _SETTLED:
            break
    return np.diag(left).copy()


def _fitted(simulate: _RowSimulator, model: StaticModel) -> StaticModelFit:
    blocks = row_blocks(simulate.rows)
    if not model.terms:
        (answer,) = simulate(np.empty((1, 0)))
        if answer is None:
            raise InputError(
                f"static model {model.name!r}: a row's simulation breaks down with the terms"
                " at neutral; check the rig's parameters"
            )
        residual = answer[0].residual
        errors = {name: rms(residual[list(rows)]) for name, rows in blocks.items()}
        return StaticModelFit(
            model=model, fit=None, residual=residual, held_out=residual, blocks=errors
        )
    free = [
        FreeParameter(
            name=term.parameter,
            unit=rig_parameter(simulate.rig, term.parameter).spec.unit,
            start=term.start,
            low=term.low,
            high=term.high,
        )
        for term in model.terms
    ]
    fit = fit_simulator(simulate, free)
    at_optimum = [
        dataclasses.replace(parameter, start=value)
        for parameter, value in zip(free, fit.values, strict=True)
    ]
    return StaticModelFit(
        model=model,
        fit=fit,
        residual=fit.linearisation.residual,
        held_out=leave_one_out(simulate, free, fit),
        blocks={
            name: _without_block(simulate, at_optimum, rows)
            for name, rows in blocks.items()
            if (model.accepted or name == SMALL_STEPS)
            and len(simulate.rows) - len(rows) > len(free) + 1
        },
    )


def row_blocks(rows: Sequence[PrintedStep]) -> Mapping[str, tuple[int, ...]]:
    """Numbers of the rows of each size of step and of each load."""
    blocks: dict[str, list[int]] = {}
    for number, row in enumerate(rows):
        for name in (f"{row.size} steps", f"load {row.load:g} kg"):
            blocks.setdefault(name, []).append(number)
    return {name: tuple(numbers) for name, numbers in blocks.items()}


def _without_block(
    simulate: _RowSimulator, free: Sequence[FreeParameter], block: Sequence[int]
) -> float:
    """Root mean square error at rows that a fit did not see [rad]; NaN where it breaks down."""
    rest = tuple(row for number, row in enumerate(simulate.rows) if number not in block)
    seen = dataclasses.replace(simulate, rows=rest)
    unseen = dataclasses.replace(simulate, rows=tuple(simulate.rows[k] for k in block))
    fit = fit_simulator(seen, free, central=False)
    (answer,) = unseen(np.array([fit.values]))
    return math.nan if answer is None else rms(answer[0].residual)


@dataclass(frozen=True)
class _RowSimulator:
    """Values of the terms to residuals of the rows, all in one batch."""

    rig: Rig
    terms: tuple[Term, ...]
    rows: tuple[PrintedStep, ...]
    timestep: float | None
    threads: int | None

    def __call__(self, vectors: FloatArray) -> list[Blocks | None]:
        rigs = [self.rig.with_parameters(_values(self.terms, vector)) for vector in vectors]
        experiments = [
            printed_experiment(step, STARTS["vent"], sample_rate=_SAMPLE_RATE) for step in self.rows
        ]
        runs = simulate_batch(
            [(rig, experiment) for rig in rigs for experiment in experiments],
            timestep=self.timestep,
            threads=self.threads,
        )
        count = len(self.rows)
        return [self._blocks(runs[k : k + count]) for k in range(0, len(runs), count)]

    def _blocks(self, runs: Sequence[Recording]) -> Blocks | None:
        if any(run.outcome is not Outcome.COMPLETED for run in runs):
            return None
        off = np.array([run.angle[-1] for run in runs]) - [step.angle for step in self.rows]
        return [
            ResidualBlock(trial="printed rows", protocol="static", channel="angle", residual=off)
        ]


def _values(terms: Sequence[Term], values: Sequence[float] | FloatArray) -> Mapping[str, float]:
    return {
        name: float(value)
        for term, value in zip(terms, values, strict=True)
        for name in (term.parameter, *term.also)
    }
