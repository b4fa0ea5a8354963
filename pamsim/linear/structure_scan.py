"""A scan over poles, zeros, integrators and dead time: rough fits that a choice is made among."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pamsim.linear.continuous_structure import HIGHEST_ORDER, ContinuousStructure
from pamsim.linear.instrumental_variables import instrumental_variable_starts
from pamsim.linear.pole_coordinates import pole_coordinates
from pamsim.linear.separable_fit import rough_minimum
from pamsim.linear.signal_record import SignalRecord

FloatArray = NDArray[np.float64]

_ADDED = 3  # time constants at which a pole is added to a smaller model
_HOPELESS = 2.0  # cost over that of as many poles without integrators: not followed up
_WORTH = 1.05  # cost over that of one zero more, above which no further zero is taken away
_DELAYS = 6
_DELAYED_POLES = 3  # process models have so many
_INTEGRATED_POLES = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class RoughFit:
    """One structure, roughly fitted.

    Attributes:
        structure: which.
        x: poles and dead time, shape ``(searched,)``.
        theta: numerator and, of an integrating model with a free start, ``-b0 u0``, shape
            ``(unknowns - searched,)``.
        cost: sum of squares of the residual [output unit^2].
    """

    structure: ContinuousStructure
    x: FloatArray
    theta: FloatArray
    cost: float

    @property
    def coordinates(self) -> FloatArray:
        """Those of the structure, shape ``(unknowns,)``."""
        return np.append(self.x, self.theta)


@dataclass(frozen=True, kw_only=True, eq=False)
class StructureScan:
    """Fits structures to records, each from instrumental variables and from its neighbours.

    Attributes:
        records: the trials.
        start: of every trial: ``rest`` or ``free``.
        report: called with a structure before it is fitted.
        fits: structure -> its fit; filled as the scan goes on.
    """

    records: Sequence[SignalRecord]
    start: str
    report: Callable[[ContinuousStructure], None]
    fits: dict[ContinuousStructure, RoughFit] = field(default_factory=dict)

    def fit(
        self, order: int, zeros: int, near: Sequence[FloatArray] = (), **more: int
    ) -> RoughFit | None:
        """Fit one structure, from starts nearby.

        That with all zeros but the direct path starts from instrumental variables, too.

        Args:
            order: poles that are no integrators.
            zeros: of all poles.
            near: starts, shape ``(searched,)``.
            more: ``integrators``, ``dead_time``.

        Returns:
            None where there are too few samples.
        """
        structure = ContinuousStructure(
            order=order,
            zeros=zeros,
            real_lags=False,
            start=self.start,
            integrators=more.get("integrators", 0),
            dead_time=bool(more.get("dead_time", 0)),
        )
        unknowns = structure.unknowns + structure.per_trial * len(self.records)
        if sum(record.output.size for record in self.records) < 3 * unknowns:
            return None
        self.report(structure)
        starts = list(near)
        if zeros == max(order + structure.integrators - 1, 0) and not structure.dead_time:
            starts += instrumental_variable_starts(structure, self.records)
        found = rough_minimum(structure.problem(self.records), starts)
        result = RoughFit(structure=structure, x=found.x, theta=found.theta, cost=found.cost)
        self.fits[structure] = result
        return result

    def poles(self, integrators: int, most: int) -> Iterator[RoughFit]:
        """One pole more at a time, with as many zeros as leave no direct path."""
        before: RoughFit | None = None
        for order in range(0 if integrators else 1, most + 1):
            near = [] if before is None else self._one_pole_more(before)
            before = self.fit(order, max(order + integrators - 1, 0), near, integrators=integrators)
            if before is None:
                return
            yield before

    def _one_pole_more(self, fit: RoughFit) -> list[FloatArray]:
        shortest = min(record.sample_time for record in self.records)
        longest = max(record.duration for record in self.records)
        constants = fit.structure.constants(fit.x)
        return [
            pole_coordinates(np.append(constants, added))
            for added in np.geomspace(2.0 * shortest, 0.3 * longest, _ADDED)
        ]

    def fewer_zeros(self, fit: RoughFit) -> Iterator[RoughFit]:
        """One zero less at a time, as long as that costs little."""
        structure = fit.structure
        while fit.structure.zeros > 0:
            fewer = self.fit(
                structure.order,
                fit.structure.zeros - 1,
                [fit.x],
                integrators=structure.integrators,
                dead_time=structure.dead_time,
            )
            if fewer is None:
                return
            yield fewer
            if fewer.cost > _WORTH * fit.cost:
                return
            fit = fewer

    def delayed(self, fit: RoughFit) -> RoughFit | None:
        """The same with a dead time."""
        shortest = min(record.sample_time for record in self.records)
        most = 0.25 * min(record.duration for record in self.records)
        delays = [0.5 * shortest, *np.geomspace(1.5 * shortest, most, _DELAYS)]
        return self.fit(
            fit.structure.order,
            fit.structure.zeros,
            [np.append(fit.x, delay) for delay in delays],
            integrators=fit.structure.integrators,
            dead_time=1,
        )


def scan_structures(
    records: Sequence[SignalRecord],
    *,
    start: str,
    report: Callable[[ContinuousStructure], None] = lambda structure: None,
) -> list[RoughFit]:
    """Fit every structure that may describe the records, roughly.

    First 1 to 6 poles, no integrator, then one, then two; then the best with the direct path, with
    fewer zeros, with a dead time.

    Args:
        records: the trials.
        start: of every trial: ``rest`` or ``free``.
        report: called with each structure before it is fitted.

    Returns:
        The fits, simplest first.
    """
    scan = StructureScan(records=records, start=start, report=report)
    least: dict[int, float] = {}
    for integrators, most in ((0, HIGHEST_ORDER), (1, _INTEGRATED_POLES), (2, _INTEGRATED_POLES)):
        for fit in scan.poles(integrators, most):
            poles = fit.structure.order + integrators
            least[poles] = min(fit.cost, least.get(poles, fit.cost))
            if fit.cost > _HOPELESS * least[poles]:
                continue
            for other in (fit, *scan.fewer_zeros(fit)):
                if other.structure.order <= _DELAYED_POLES:
                    scan.delayed(other)
            scan.fit(fit.structure.order, fit.structure.zeros + 1, [fit.x], integrators=integrators)
    return sorted(scan.fits.values(), key=lambda fit: fit.structure.unknowns)
