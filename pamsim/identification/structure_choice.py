"""Which structure describes the records: a scan, judged on what was not fitted, else by AICc."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.identification.improvement import p_value_of_improvement
from pamsim.inference.aicc import aicc_above_best
from pamsim.inference.coloured_noise import fit_ar_noise
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.identified_model import pooled_fit_percent
from pamsim.linear.separable_fit import WHITE
from pamsim.linear.signal_record import FEWEST_SAMPLES, SignalRecord
from pamsim.linear.structure_scan import RoughFit, scan_structures

FloatArray = NDArray[np.float64]

_LAST = 1.0 / 3.0  # share of a record that judges what the rest was fitted to
_MOVES = 0.2  # spread of the output in that share, over that of the rest, from which it can judge
_FEW_TRIALS = 2  # of more, whole trials are not cut
_LEVEL = 0.05  # p-value below which a simpler model is significantly worse than the best
_MATERIAL = 1.05  # RMS error over the best one's, above which it is materially worse
_TIE = 2.0  # difference of AICc below which two models are equally supported


@dataclass(frozen=True, kw_only=True, eq=False)
class StructureChoice:
    """Fits of a scan, and by what they are judged.

    Attributes:
        fits: simplest first.
        fit_percent: of each on what it was fitted to [%].
        held_out: fit percent of each on what judges, less what its own initial state takes up of
            the noise there; empty where AICc decides [%].
        errors: of each on every record that judges, enlarged by the same [output unit].
        aicc: of each, by effective samples; empty where held-out data decide.
        effective: number of independent samples, of AICc.
        judged_by: such as ``the last third of each trial``.
    """

    fits: tuple[RoughFit, ...]
    fit_percent: tuple[float, ...]
    held_out: tuple[float, ...]
    errors: tuple[list[FloatArray], ...]
    aicc: tuple[float, ...]
    effective: float
    judged_by: str

    def pick(self, without: Collection[int] = ()) -> tuple[int, str]:
        """Return the place of the simplest fit that is not worse than the best, and the reason.

        Not worse on held-out data: the squared error is not significantly larger (test of Diebold
        and Mariano, 5 %) and the RMS error at most 5 % larger. By AICc: within 2 of the smallest.

        Args:
            without: places of fits that do not count; not of all.
        """
        open_to = [i for i in range(len(self.fits)) if i not in without]
        if not self.held_out:
            least = min(self.aicc[i] for i in open_to)
            place = next(i for i in open_to if self.aicc[i] <= least + _TIE)
            return place, (
                f"{self.fits[place].structure.sentence}: the smallest AICc, or simpler and within"
                f" {_TIE:g} of it ({self.effective:.0f} effective samples; nothing was held out)"
            )
        best = max(open_to, key=lambda i: self.held_out[i])
        place = next(i for i in open_to if i == best or self._as_good(i, best))
        words, best_words = (self.fits[i].structure.sentence for i in (place, best))
        if place == best:
            return place, f"{words}: the best on {self.judged_by}, all simpler ones are worse"
        return place, (
            f"{words}: the simplest that is not worse on {self.judged_by} than {best_words}, the"
            " best there"
        )

    def material(self, place: int, without: Collection[int] = ()) -> bool:
        """Whether a fit is materially worse than the best: by 5 % in RMS error, by 2 in AICc.

        Args:
            place: of the fit.
            without: places of fits that do not count.
        """
        open_to = [i for i in range(len(self.fits)) if i not in without]
        if not self.held_out:
            return self.aicc[place] > min(self.aicc[i] for i in open_to) + _TIE
        best = max(self.held_out[i] for i in open_to)
        return 100.0 - self.held_out[place] > _MATERIAL * (100.0 - best)

    def _as_good(self, place: int, best: int) -> bool:
        if 100.0 - self.held_out[place] > _MATERIAL * (100.0 - self.held_out[best]):
            return False
        return p_value_of_improvement(self.errors[place], self.errors[best]) >= _LEVEL


def scan_and_judge(
    records: Sequence[SignalRecord],
    held_out: Sequence[SignalRecord],
    *,
    start: str,
    report: Callable[[ContinuousStructure], None],
) -> StructureChoice:
    """Scan structures and judge them on held-out data where there are any, else by AICc.

    Without held-out trials one or two trials are judged by their last third, if the output moves
    there: the scan fits the rest.

    Args:
        records: the trials.
        held_out: trials that judge; may be none.
        start: of every trial: ``rest`` or ``free``.
        report: called with each structure before it is fitted.
    """
    fitted, judges, judged_by = _parts(records, held_out)
    fits = scan_structures(fitted, start=start, report=report)
    errors = [
        [record.output - y for record, y in zip(judges, _runs(fit, judges), strict=True)]
        for fit in fits
    ]
    errors = _without_own_degrees(fits, errors, judges)
    scores, effective = ((), 0.0) if judges else _aicc(fits, fitted)
    return StructureChoice(
        fits=tuple(fits),
        fit_percent=tuple(_percent(fitted, _runs(fit, fitted)) for fit in fits),
        held_out=tuple(
            _percent(judges, [r.output - e for r, e in zip(judges, own, strict=True)])
            for own in errors
        )
        if judges
        else (),
        errors=tuple(errors),
        aicc=scores,
        effective=effective,
        judged_by=judged_by,
    )


def _parts(
    records: Sequence[SignalRecord], held_out: Sequence[SignalRecord]
) -> tuple[Sequence[SignalRecord], Sequence[SignalRecord], str]:
    """Records to fit, those that judge, and what these are."""
    if held_out:
        return records, held_out, "the held-out trials"
    if len(records) > _FEW_TRIALS:
        return records, (), "AICc"
    first: list[SignalRecord] = []
    last: list[SignalRecord] = []
    for record in records:
        cut = round((1.0 - _LAST) * record.output.size)
        head, tail = record.output[:cut], record.output[cut:]
        few = tail.size < FEWEST_SAMPLES or np.ptp(record.input[:cut]) == 0.0
        if few or np.std(tail) < _MOVES * np.std(head):
            return records, (), "AICc"
        first.append(record.part(slice(0, cut)))
        last.append(record.part(slice(cut, None), held_out=True))
    return first, last, "the last third of each trial"


def _without_own_degrees(
    fits: Sequence[RoughFit], errors: list[list[FloatArray]], judges: Sequence[SignalRecord]
) -> list[list[FloatArray]]:
    """Errors as large as they were if no initial state were fitted to what judges.

    Every model gets its own initial state there, the more numbers the more poles it has, and takes
    up noise with them: of noise that is slow much, as it has few independent samples.
    """
    if not judges:
        return errors
    best = min(errors, key=lambda own: sum(float(e @ e) for e in own))
    effective = _effective_samples(best, judges)

    def factor(fit: RoughFit) -> float:
        room = effective - fit.structure.per_trial * len(judges)
        return math.sqrt(effective / max(room, 1.0))

    return [[factor(fit) * e for e in own] for fit, own in zip(fits, errors, strict=True)]


def _effective_samples(residual: Sequence[FloatArray], records: Sequence[SignalRecord]) -> float:
    """Number of independent samples of a residual."""
    samples = sum(record.output.size for record in records)
    interval = float(np.median([record.sample_time for record in records]))
    noise = fit_ar_noise(residual)
    return min(samples * interval / (2.0 * noise.correlation_time(interval)), samples)


def _runs(fit: RoughFit, records: Sequence[SignalRecord]) -> list[FloatArray]:
    return [fit.structure.free_run(fit.coordinates, record)[0] for record in records]


def _percent(records: Sequence[SignalRecord], runs: Sequence[FloatArray]) -> float:
    return pooled_fit_percent(
        [(record.output, run) for record, run in zip(records, runs, strict=True)]
    )


def _aicc(
    fits: Sequence[RoughFit], records: Sequence[SignalRecord]
) -> tuple[tuple[float, ...], float]:
    """AICc of all above the smallest, and the effective number of samples."""
    samples = sum(record.output.size for record in records)
    best = min(fits, key=lambda fit: fit.cost)
    residual = best.structure.problem(records).solved(best.x, WHITE)[1]
    effective = _effective_samples([residual], records)
    scores = aicc_above_best(
        [fit.cost / samples for fit in fits],
        [fit.structure.unknowns + fit.structure.per_trial * len(records) for fit in fits],
        effective,
    )
    return tuple(scores), effective
