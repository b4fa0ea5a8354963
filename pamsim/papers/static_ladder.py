"""A ladder of static models of the printed arm: which physical term earns its place.

Each rung frees one term more than the one it stands on, is fitted to the 21 distinct printed end
positions in the engine, and is judged by the rows it has not seen. A term that only lowers the
in-sample error is not climbed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.recording import Outcome, Recording
from pamsim.core.units import DEG_PER_RAD
from pamsim.engine.batch import simulate_batch
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.inference.fit_simulator import fit_simulator
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.leave_one_out import LeftOut, leave_one_out
from pamsim.inference.residual_block import Blocks, ResidualBlock
from pamsim.inference.simulator_fit import SimulatorFit
from pamsim.papers.printed_steps import STARTS, printed_experiment
from pamsim.store.printed import PrintedStep, distinct_steps

FloatArray = NDArray[np.float64]

_SAMPLE_RATE = 20.0
"""Of the simulated steps [Hz]: only their ends are looked at."""


@dataclass(frozen=True, kw_only=True)
class Term:
    """A physical term that a rung may free.

    Attributes:
        name: in words.
        parameter: name of its parameter in the rig.
        also: parameters that take the same value.
        low: smallest value [SI].
        high: largest value [SI].
        start: where the fit begins [SI].
        neutral: value at which the term is absent, or as published or assumed [SI].
    """

    name: str
    parameter: str
    low: float
    high: float
    start: float
    neutral: float
    also: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Rung:
    """A model of the ladder.

    Attributes:
        name: in words.
        terms: that are fitted; all others are at their neutral values.
        climbed: whether it is on the way to the model that is used.
        held: parameters held at another value than their neutral one [SI].
    """

    name: str
    terms: tuple[Term, ...]
    climbed: bool
    held: Mapping[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True, kw_only=True)
class RungResult:
    """A fitted rung.

    Attributes:
        rung: the model.
        residual: simulated minus printed angle of each row, shape (n,) [rad].
        fit: of its free terms; None for a rung without a free term.
        left_out: errors at unseen rows; None for a rung without a free term, where they are the
            residual itself.
    """

    rung: Rung
    residual: FloatArray
    fit: SimulatorFit | None
    left_out: LeftOut | None

    @property
    def rms(self) -> float:
        """Root mean square error in sample [rad]."""
        return math.sqrt(float(np.mean(self.residual**2)))

    @property
    def left_out_rms(self) -> float:
        """Root mean square error at rows not seen [rad]."""
        return self.rms if self.left_out is None else self.left_out.rms

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe form, units in the key names; parameters in SI."""
        fitted = self.fit.parameters if self.fit else ()
        unseen = self.residual if self.left_out is None else self.left_out.residual
        return {
            "name": self.rung.name,
            "climbed": self.rung.climbed,
            "rms_deg": self.rms * DEG_PER_RAD,
            "loo_rms_deg": self.left_out_rms * DEG_PER_RAD,
            "parameters": [
                {
                    "term": term.name,
                    "name": term.parameter,
                    "unit": found.unit,
                    "value": found.value,
                    "interval95": list(found.interval95) if found.interval95 else None,
                    "flags": [str(flag) for flag in found.flags],
                }
                for term, found in zip(self.rung.terms, fitted, strict=True)
            ],
            "residual_deg": (self.residual * DEG_PER_RAD).tolist(),
            "loo_residual_deg": (unseen * DEG_PER_RAD).tolist(),
        }


def climb(
    rig: Rig,
    rungs: Sequence[Rung],
    terms: Sequence[Term],
    *,
    steps: tuple[PrintedStep, ...] | None = None,
    timestep: float | None = None,
    threads: int | None = None,
    done: Callable[[RungResult], None] | None = None,
) -> tuple[RungResult, ...]:
    """Fit every rung to printed end positions.

    Args:
        rig: the arm.
        rungs: models.
        terms: all terms there are; those a rung does not free are set to their neutral values.
        steps: printed rows; the distinct ones if left out.
        timestep: [s]; the rig's own if left out.
        threads: see `simulate_batch`.
        done: told of each rung as soon as it is fitted.

    Returns:
        One result per rung.
    """
    rows = distinct_steps() if steps is None else steps
    bare = rig.with_parameters(_values(terms, [term.neutral for term in terms]))
    results: list[RungResult] = []
    for rung in rungs:
        engine = _RowSimulator(bare.with_parameters(rung.held), rung.terms, rows, timestep, threads)
        results.append(_fitted(engine, rung))
        if done:
            done(results[-1])
    return tuple(results)


def _fitted(simulate: _RowSimulator, rung: Rung) -> RungResult:
    if not rung.terms:
        (blocks,) = simulate(np.empty((1, 0)))
        if blocks is None:
            raise InputError(
                f"rung {rung.name!r}: a row's simulation breaks down with the terms at neutral;"
                " check the rig's parameters"
            )
        return RungResult(rung=rung, residual=blocks[0].residual, fit=None, left_out=None)
    free = [
        FreeParameter(
            name=term.parameter,
            unit=rig_parameter(simulate.rig, term.parameter).spec.unit,
            start=term.start,
            low=term.low,
            high=term.high,
        )
        for term in rung.terms
    ]
    found = fit_simulator(simulate, free)
    return RungResult(
        rung=rung,
        residual=found.linearisation.residual,
        fit=found,
        left_out=leave_one_out(simulate, free, found),
    )


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
        ends = np.array([run.angle[-1] for run in runs])
        return [_block(ends - np.array([step.angle for step in self.rows]))]


def _block(residual: FloatArray) -> ResidualBlock:
    return ResidualBlock(
        trial="printed rows", protocol="static", channel="angle", residual=residual
    )


def _values(terms: Sequence[Term], values: Sequence[float] | FloatArray) -> Mapping[str, float]:
    return {
        name: float(value)
        for term, value in zip(terms, values, strict=True)
        for name in (term.parameter, *term.also)
    }
