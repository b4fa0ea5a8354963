"""A scan over poles, zeros, integrators, dead time and drift: rough fits to choose among."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.identification.continuous import (
    HIGHEST_ORDER,
    MOST_INTEGRATORS,
    ContinuousStructure,
)
from pamsim.identification.records import SignalRecord, growing_parts, shows, time_range
from pamsim.identification.separable import Solution, rough_minimum
from pamsim.identification.starts import (
    delay_starts,
    instrumental_variable_starts,
    matching_delays,
    pole_coordinates,
)
from pamsim.inference.criteria import NO_SUPPORT, TIE, hannan_quinn

_ADDED = 3  # time constants at which a pole is added to a smaller model
_IN_VAIN = 2  # orders one after the other that are no better: more poles are not tried
_DELAYS = 6  # dead times that a search is begun with
_DELAYED_POLES = 3  # process models have so many
_INTEGRATED_POLES = 4  # beside integrators: as many as six poles in all
_ROUNDING = 1e-9  # residual over output, RMS: below it there is only rounding


@dataclass(frozen=True, kw_only=True, eq=False)
class RoughFit(Solution):
    """One structure, roughly fitted: x is poles and dead times, theta the other coordinates."""

    structure: ContinuousStructure
    criterion: float  # of Hannan and Quinn; smaller is better


@dataclass(frozen=True, kw_only=True, eq=False)
class StructureScan:
    """Fits structures to records, each from instrumental variables and from its neighbours."""

    records: Sequence[SignalRecord]
    start: str  # of every trial: ``rest`` or ``free``
    report: Callable[[ContinuousStructure], None]  # called with a structure before it is fitted
    # structure -> its fit; filled as the scan goes on
    fits: dict[ContinuousStructure, RoughFit] = field(default_factory=dict)

    def fit(
        self, structure: ContinuousStructure, near: Sequence[FloatArray] = ()
    ) -> RoughFit | None:
        """Fit one structure, from starts nearby; None where there are too few samples.

        That with all zeros but the direct path starts from instrumental variables, too; they allow
        for a drift, so that the starts of models with and without are the same.
        """
        samples = sum(record.output.size for record in self.records)
        if samples < 3 * structure.counted(len(self.records)):
            return None
        starts = list(near)
        all_zeros = max(structure.order + structure.integrators - 1, 0)
        if structure.zeros == all_zeros and not (structure.dead_time or structure.drift):
            starts += instrumental_variable_starts(structure, self.records)
        return self._add(structure, starts)

    def _add(self, structure: ContinuousStructure, starts: Sequence[FloatArray]) -> RoughFit:
        self.report(structure)
        self.fits[structure] = rough_fit(structure, self.records, starts)
        return self.fits[structure]

    def every_kind(self) -> None:
        """Fit poles one after the other, without and with integrators, and what is beside each."""
        least: dict[int, float] = {}
        for integrators in range(MOST_INTEGRATORS + 1):
            supported = False
            if integrators:
                chain = list(self.poles(integrators, _INTEGRATED_POLES))
            else:
                chain = self.stable()
            best = min(chain, key=lambda fit: fit.criterion, default=None)
            for fit in chain:
                poles = fit.structure.order + integrators
                least[poles] = min(fit.criterion, least.get(poles, fit.criterion))
                if best is not None and fit.structure.order > best.structure.order:
                    least[poles] = min(least[poles], best.criterion)
                if fit.criterion > least[poles] + NO_SUPPORT:
                    continue
                supported = True
                self.fewer_zeros(fit)
                if poles > 0:  # a gain is a direct path already
                    self.fit(replace(fit.structure, zeros=fit.structure.zeros + 1), [fit.x])
            if not supported:
                break

    def continued(self, records: Sequence[SignalRecord]) -> StructureScan:
        """Return a scan of other records that begins with what may be chosen by these."""
        other = replace(self, records=records, fits={})
        for fit in self._may_be_chosen():
            other._beside(fit.structure, fit.x)
        return other

    def poles(
        self, integrators: int, most: int, beside: Sequence[RoughFit] | None = None
    ) -> Iterator[RoughFit]:
        """One pole more at a time, with as many zeros as leave no direct path.

        Until two orders in a row are no better. The outputs drift if the same without drift are
        given ``beside``, where the searches begin.
        """
        before: RoughFit | None = None
        least, in_vain = np.inf, 0
        for order in range(most + 1):
            near = [] if before is None else self._one_pole_more(before)
            if beside is not None:
                near += [fit.x for fit in beside if fit.structure.order == order]
            structure = ContinuousStructure(
                order=order,
                zeros=max(order + integrators - 1, 0),
                real_lags=False,
                start=self.start,
                integrators=integrators,
                drift=beside is not None,
                inputs=len(self.records[0].units_input),
            )
            before = self.fit(structure, near)
            if before is None:
                return
            yield before
            in_vain = 0 if before.criterion < least else in_vain + 1
            least = min(least, before.criterion)
            if in_vain == _IN_VAIN:
                return

    def _one_pole_more(self, fit: RoughFit) -> list[FloatArray]:
        shortest, longest = time_range(self.records)
        constants = fit.structure.constants(fit.x)
        return [
            pole_coordinates(np.append(constants, added))
            for added in np.geomspace(2.0 * shortest, 0.3 * longest, _ADDED)
        ]

    def fewer_zeros(self, fit: RoughFit) -> None:
        """One zero less at a time, without and with dead time, until both are decisively worse."""
        late = self._delayed(fit)
        while fit.structure.zeros > 0:
            fewer = self.fit(replace(fit.structure, zeros=fit.structure.zeros - 1), [fit.x])
            if fewer is None:
                return
            fewer_late = self._delayed(fewer, late)
            worse = fewer.criterion > fit.criterion + NO_SUPPORT
            if late is not None and fewer_late is not None:
                worse = worse and fewer_late.criterion > late.criterion + NO_SUPPORT
            if worse:
                return
            fit, late = fewer, fewer_late

    def _delayed(self, fit: RoughFit, near: RoughFit | None = None) -> RoughFit | None:
        """The same with a dead time; None for more poles than process models have."""
        if fit.structure.order > _DELAYED_POLES:
            return None
        shortest, _ = time_range(self.records)
        most = 0.25 * min(record.duration for record in self.records)
        delays = [0.5 * shortest, *np.geomspace(1.5 * shortest, most, _DELAYS)]
        late = delay_starts(delays, fit.structure.inputs)
        structure = replace(fit.structure, dead_time=True)
        if structure.order + structure.integrators == 0:
            late = [*matching_delays(structure, self.records, most), *late]
        starts = [np.append(fit.x, delay) for delay in late]
        starts = starts if near is None else [near.x, *starts]
        return self.fit(structure, starts)

    def near_the_best(self) -> None:
        """Fit what the way of the scan may have missed, beside every fit that may be chosen.

        The same with drifting outputs, or without, also beside the best of every number of poles: a
        drift may have been taken for poles. And the same with an integrator in the place of a pole
        that is slower than the longest record: with fewer poles or without the dead time an
        integrator may have looked hopeless.
        """
        falling = sorted(self.fits.values(), key=lambda fit: fit.criterion, reverse=True)
        best = {fit.structure.order: fit for fit in falling if not fit.structure.integrators}
        for fit in best.values():
            self._other_drift(fit)
        _, longest = time_range(self.records)
        for fit in self._may_be_chosen():
            constants = fit.structure.constants(fit.x)
            slow = np.abs(constants) > longest
            if np.sum(slow) == 1 and fit.structure.integrators < MOST_INTEGRATORS:
                after = fit.x[fit.structure.order :]
                self._beside(
                    replace(
                        fit.structure,
                        order=fit.structure.order - 1,
                        integrators=fit.structure.integrators + 1,
                        drift=False,
                    ),
                    np.append(pole_coordinates(constants[~slow]), after),
                )
        for fit in self._may_be_chosen():
            self._other_drift(fit)
        for fit in self._may_be_chosen():
            self._less_of_each_input(fit)

    def _less_of_each_input(self, fit: RoughFit) -> None:
        """Drop zeros and dead times of single inputs, one at a time, as long as that is better."""
        better = fit if fit.structure.inputs > 1 else None
        while better is not None:
            fit, better = better, None
            for structure, start in _one_less(fit):
                self._beside(structure, start)
                less = self.fits[structure]
                if less.criterion < (fit if better is None else better).criterion:
                    better = less

    def _may_be_chosen(self) -> list[RoughFit]:
        least = min((fit.criterion for fit in self.fits.values()), default=0.0)
        return [fit for fit in self.fits.values() if fit.criterion < least + NO_SUPPORT]

    def _other_drift(self, fit: RoughFit) -> None:
        structure = fit.structure
        if structure.start == "free" and not structure.integrators:
            self._beside(replace(structure, drift=not structure.drift), fit.x)

    def _beside(self, structure: ContinuousStructure, start: FloatArray) -> None:
        if structure not in self.fits:
            self._add(structure, [start])

    def stable(self) -> list[RoughFit]:
        """One pole more at a time without integrators, with drifting outputs if that is better.

        A drift that no structure has is taken for slow poles. A trial at rest at first does not
        drift; of one that integrates the input's bias describes a drift.
        """
        plain = list(self.poles(0, HIGHEST_ORDER))
        if self.start == "rest":
            return plain
        drifting = list(self.poles(0, HIGHEST_ORDER, beside=plain))
        least = [min((fit.criterion for fit in fits), default=0.0) for fits in (plain, drifting)]
        kept, dropped = plain, drifting
        if least[1] < least[0] - TIE:
            kept, dropped = drifting, plain
        for fit in dropped:
            del self.fits[fit.structure]
        return kept


def _one_less(fit: RoughFit) -> Iterator[tuple[ContinuousStructure, FloatArray]]:
    """Structures with a zero or a dead time less of one input, and where their search begins."""
    structure = fit.structure
    for i, zeros in enumerate(structure.numerator_zeros):
        if zeros > 0:
            each = list(structure.numerator_zeros)
            each[i] = zeros - 1
            yield replace(structure, zeros=max(each), zeros_each=tuple(each)), fit.x
    for place, i in structure.delay_places.items():
        undelayed = tuple(sorted([*structure.undelayed, i]))
        if len(undelayed) < structure.inputs:
            yield replace(structure, undelayed=undelayed), np.delete(fit.x, place)


def rough_fit(
    structure: ContinuousStructure, records: Sequence[SignalRecord], starts: Sequence[FloatArray]
) -> RoughFit:
    """Fit one structure until little is gained, from starts of shape ``(searched,)``."""
    problem = structure.problem(records)
    found, residual = rough_minimum(problem, starts)
    lower = np.append(problem.lower[: structure.order], np.zeros(len(structure.delayed)))
    if np.any(found.x < lower):
        # No full fit keeps a dead time below 0: none may win the scan by one.
        start = np.maximum(found.x, lower)
        found, residual = rough_minimum(replace(problem, lower=lower), [start])
    samples = np.cumsum([record.output.size for record in records])
    moves = sum(float(np.var(record.output)) * record.output.size for record in records)
    return RoughFit(
        **vars(found),
        structure=structure,
        criterion=hannan_quinn(
            np.split(residual, samples[:-1]),
            [record.sample_time for record in records],
            structure.counted(len(records)),
            rounding=_ROUNDING**2 * moves / float(samples[-1]),
        ),
    )


def scan_structures(
    records: Sequence[SignalRecord],
    *,
    start: str,
    report: Callable[[ContinuousStructure], None] = lambda structure: None,
) -> list[RoughFit]:
    """Fit every structure that may describe the records, roughly.

    First 0 to 6 poles, no integrator, then one, then two, as long as the records support that; each
    with the direct path, with fewer zeros, with a dead time. From a free start the outputs of
    models without integrators may drift, if that is better without a dead time. Of long records all
    are fitted to a part, and those that may be chosen by it to the whole. ``report`` is called with
    each structure before it is fitted.

    Returns:
        The fits, simplest first.
    """
    scan = StructureScan(records=records, start=start, report=report)
    for part in growing_parts(records):
        scan = StructureScan(records=part, start=start, report=report)
        scan.every_kind()
        best = min(scan.fits.values(), key=lambda fit: fit.criterion, default=None)
        if best is None or shows(part, best.structure.slowest(best.coordinates)):
            break
    if scan.records is not records:
        scan = scan.continued(records)
    scan.near_the_best()
    return sorted(scan.fits.values(), key=lambda fit: (fit.structure.unknowns, fit.structure.drift))
