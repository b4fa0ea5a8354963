"""The result of a sweep: its table, what came out, and which factors matter.

Rank correlations tell it of any sweep, Sobol' indices of Saltelli's design.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from pamsim.core.computation import versions
from pamsim.core.encoding import NOT_IN_JSON, fields_to_dict, write_json
from pamsim.core.units import FloatArray
from pamsim.recordings.array_files import read_arrays
from pamsim.sweeps.design import Design
from pamsim.sweeps.study import Study

SCHEMA = "pamsim-sweep-result/1"
FILE = "sweep.json"
_SHOWN = 3  # factors of each output in the summary
_COMPLETED = "completed"

_stats: Any = scipy.stats

_FEWEST = 4

_CONSTANT = 1e-4
"""Range of an output, relative to its largest value, below which it does not vary."""

_RESAMPLES = 500


@dataclass(frozen=True, kw_only=True)
class OutputSummary:
    """One output over all runs that have it; NaN where none has.

    Attributes:
        unit: of the numbers.
        runs: that have it.
        low: least value.
        median: of the values.
        high: largest.
    """

    unit: str
    runs: int
    low: float
    median: float
    high: float


@dataclass(frozen=True, kw_only=True)
class SobolIndex:
    """Share of an output's variance that a factor makes.

    Attributes:
        first: by itself.
        first_interval95: bootstrap interval.
        total: with all interactions.
        total_interval95: bootstrap interval.
    """

    first: float
    first_interval95: tuple[float, float]
    total: float
    total_interval95: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class SweepResult:
    """A finished sweep.

    Attributes:
        study: as it was given.
        factors: name -> unit; empty where values are text, such as names of rigs.
        runs: in the table.
        failed: of these, with another outcome than ``completed``.
        first_failure: message of the first of them; empty if none failed.
        kept: that a run before had finished.
        outputs: name -> summary.
        rank_correlations: output -> factor -> Spearman's correlation.
        sobol: output -> factor -> index; of a sensitivity design.
        seconds: wall time of this run.
        table: the Parquet file with a row for every run.
    """

    study: Mapping[str, Any]
    factors: Mapping[str, str]
    runs: int
    failed: int
    first_failure: str
    kept: int
    outputs: Mapping[str, OutputSummary]
    rank_correlations: Mapping[str, Mapping[str, float]]
    sobol: Mapping[str, Mapping[str, SobolIndex]] = field(
        default_factory=dict[str, Mapping[str, SobolIndex]]
    )
    seconds: float
    table: Path = field(metadata=NOT_IN_JSON)

    def columns(self) -> Mapping[str, NDArray[Any]]:
        """Column -> (runs,) of the table, in the units of `factors` and `outputs`."""
        return read_arrays(self.table)

    def summary(self) -> str:
        """What came out, and which factors matter most for it."""
        why = f"; the first: {self.first_failure}" if self.failed else ""
        lines = [f"{self.runs} runs, {self.failed} of them failed{why}"]
        for name, one in self.outputs.items():
            if not one.runs:
                lines.append(f"{name}: missing in all runs")
                continue
            unit = "" if one.unit == "1" else f" {one.unit}"
            text = f"{name}: {one.low:.4g} to {one.high:.4g}{unit}, median {one.median:.4g}"
            lines.append(f"{text}{self._matters(name)}")
        return "\n".join(lines)

    def _matters(self, output: str) -> str:
        sobol, ranks = self.sobol.get(output, {}), self.rank_correlations.get(output, {})
        if sobol:
            first = sorted(sobol.items(), key=lambda pair: -pair[1].total)[:_SHOWN]
            shares = ", ".join(
                "{} {:.2f} [{:.2f}, {:.2f}]".format(name, index.total, *index.total_interval95)
                for name, index in first
            )
            return f"; share of its variance (total index, 95 % interval): {shares}"
        most = sorted(ranks.items(), key=lambda pair: -abs(pair[1]))[:_SHOWN]
        if not most:
            return ""
        return f"; rank correlation: {', '.join(f'{name} {value:+.2f}' for name, value in most)}"

    def to_dict(self) -> dict[str, Any]:
        """The content of ``sweep.json``, schema ``pamsim-sweep-result/1``."""
        return {
            "schema": SCHEMA,
            **fields_to_dict(self),
            "table": self.table.name,
            "versions": versions("scipy"),
        }

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``sweep.json`` into a folder."""
        path = Path(folder) / FILE
        write_json(path, self.to_dict())
        return [path]


def result_of(plan: Study, table: Path, *, kept: int, seconds: float) -> SweepResult:
    """Sum up the finished table of a sweep, of which some runs were kept from before."""
    columns = read_arrays(table)
    failures = columns["message"][columns["outcome"] != _COMPLETED].tolist()
    numbers = {name: unit for name, unit in plan.job.columns.items() if unit != "text"}
    outputs = {name: columns[name].astype(float) for name in numbers}
    numeric = [f.name for f in plan.factors if plan.units[f.name]]
    factors = {name: columns[name].astype(float) for name in numeric}
    sobol: dict[str, dict[str, SobolIndex]] = {}
    if plan.design is Design.SENSITIVITY:
        sobol = sobol_indices(list(factors), outputs, plan.base, plan.seed)
    return SweepResult(
        study=plan.stated,
        factors=plan.units,
        runs=len(plan.runs),
        failed=len(failures),
        first_failure=failures[0] if failures else "",
        kept=kept,
        outputs={name: _summed(outputs[name], unit) for name, unit in numbers.items()},
        rank_correlations=rank_correlations(factors, outputs),
        sobol=sobol,
        seconds=seconds,
        table=table,
    )


def _summed(values: FloatArray, unit: str) -> OutputSummary:
    known = values[np.isfinite(values)]
    low, median, high = (
        float(of(known)) if known.size else np.nan for of in (np.min, np.median, np.max)
    )
    return OutputSummary(unit=unit, runs=known.size, low=low, median=median, high=high)


def rank_correlations(
    factors: Mapping[str, FloatArray], outputs: Mapping[str, FloatArray]
) -> dict[str, dict[str, float]]:
    """Spearman's correlation of each output with each factor.

    Both are name -> (n,), outputs NaN where a run failed.

    Returns:
        Output -> factor -> correlation in [-1, 1], over the runs that have the output. Without
        outputs that do not vary, or that fewer than four runs have.
    """
    found: dict[str, dict[str, float]] = {}
    for output, values in outputs.items():
        known = np.isfinite(values)
        if known.sum() < _FEWEST or _constant(values[known]):
            continue
        found[output] = {
            name: float(_stats.spearmanr(own[known], values[known]).statistic)
            for name, own in factors.items()
            if np.ptp(own[known]) > 0.0
        }
    return found


def sobol_indices(
    factors: Sequence[str], outputs: Mapping[str, FloatArray], runs: int, seed: int
) -> dict[str, dict[str, SobolIndex]]:
    """Sobol' indices from the runs of a sensitivity design (Saltelli et al. 2010).

    Args:
        factors: names, in the design's order.
        outputs: name -> (runs x (factors + 2),), in the design's order, NaN where a run failed.
        runs: base sample of the design.
        seed: of the bootstrap; that of scipy takes none.

    Returns:
        Output -> factor -> index. Without outputs that do not vary or that some run does not have:
        the design needs every run.
    """
    drawn = np.random.default_rng(seed).integers(0, runs, (_RESAMPLES, runs))
    found: dict[str, dict[str, SobolIndex]] = {}
    for output, values in outputs.items():
        if not np.all(np.isfinite(values)) or _constant(values):
            continue
        parts = values.reshape(len(factors) + 2, runs)
        first, total = _indices(parts)
        spread = np.array([_indices(parts[:, places]) for places in drawn])
        low, high = np.nanquantile(spread, (0.025, 0.975), axis=0)
        found[output] = {
            name: SobolIndex(
                first=float(first[i]),
                first_interval95=(float(low[0, i]), float(high[0, i])),
                total=float(total[i]),
                total_interval95=(float(low[1, i]), float(high[1, i])),
            )
            for i, name in enumerate(factors)
        }
    return found


def _indices(parts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First and total indices, each (factors,), of outputs (factors + 2, n)."""
    one = parts[:, np.newaxis]
    found = _stats.sobol_indices(
        func={"f_A": one[0], "f_B": one[1], "f_AB": one[2:]}, n=parts.shape[1]
    )
    return np.atleast_1d(found.first_order), np.atleast_1d(found.total_order)


def _constant(values: FloatArray) -> bool:
    return float(np.ptp(values)) <= _CONSTANT * float(np.max(np.abs(values)))
