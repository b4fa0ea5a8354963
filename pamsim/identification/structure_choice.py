"""Which structure of a scan describes the records.

Where a linear model leaves nothing but noise, the likelihood of the noise is the most powerful
judge. Where none does (a nonlinear plant), the likelihood would pay for every detail that the noise
model sees one step ahead: there the free run on what was not fitted judges, else AICc.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.identification.model import pooled_fit_percent
from pamsim.identification.records import FEWEST_SAMPLES, SignalRecord
from pamsim.identification.structure_scan import RoughFit, rough_fit
from pamsim.inference.criteria import NO_SUPPORT, TIE, aicc_above_best
from pamsim.inference.trial_noise import WHITE, fit_trial_noise

AICC = "AICc"
LIKELIHOOD = "the Hannan-Quinn criterion"
_LAST = 1.0 / 3.0  # share of a record that judges what the rest was fitted to
_MOVES = 0.2  # spread of the output in that share, over that of the rest, from which it can judge
_FEW_TRIALS = 2  # of more, whole trials are not cut
_LEVEL = 0.05  # p-value below which a simpler model is significantly worse than the best
_MATERIAL = 1.05  # RMS error over the best one's, above which it is materially worse


@dataclass(frozen=True, kw_only=True, eq=False)
class StructureChoice:
    """Fits of a scan, and by what they are judged.

    Attributes:
        fits: simplest first.
        fit_percent: of each on what it was fitted to [%].
        held_out: fit percent of each on what judges, less what its own initial state takes up of
            the noise there; empty where a criterion decides [%].
        errors: of each on every record that judges, enlarged by the same [output unit].
        sample_times: of these records [s].
        scores: criterion of each above the smallest; empty where held-out data decide.
        judged_by: such as ``the last third of each trial`` or ``AICc``.
        basis: of the criterion, in words; empty where held-out data decide.
        material: score from which a fit is materially worse than the best.
    """

    fits: tuple[RoughFit, ...]
    fit_percent: tuple[float, ...]
    judged_by: str
    held_out: tuple[float, ...] = ()
    errors: tuple[list[FloatArray], ...] = ()
    sample_times: tuple[float, ...] = ()
    scores: tuple[float, ...] = ()
    basis: str = ""
    material: float = TIE

    def pick(self, without: Collection[int] = ()) -> tuple[int, str]:
        """Return the place of the simplest fit that is not worse than the best, and the reason.

        Not worse on held-out data: the squared error is not significantly larger (test of Diebold
        and Mariano, 5 %) and the RMS error at most 5 % larger. By a criterion: within 2 of the
        smallest. Fits at the places ``without`` do not count.
        """
        open_to = [i for i in range(len(self.fits)) if i not in without]
        if not self.held_out:
            least = min(self.scores[i] for i in open_to)
            place = next(i for i in open_to if self.scores[i] <= least + TIE)
            return place, (
                f"{self.fits[place].structure.sentence}: the best by {self.judged_by}, or simpler"
                f" and within {TIE:g} of it ({self.basis})"
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

    def materially_worse(self, place: int, without: Collection[int] = ()) -> bool:
        """Whether a fit is materially worse than the best: by 5 % in RMS error, or in its score."""
        open_to = [i for i in range(len(self.fits)) if i not in without]
        if not self.held_out:
            return self.scores[place] > min(self.scores[i] for i in open_to) + self.material
        best = max(self.held_out[i] for i in open_to)
        return 100.0 - self.held_out[place] > _MATERIAL * (100.0 - best)

    def _as_good(self, place: int, best: int) -> bool:
        if 100.0 - self.held_out[place] > _MATERIAL * (100.0 - self.held_out[best]):
            return False
        p_value = p_value_of_improvement(self.errors[place], self.errors[best], self.sample_times)
        return p_value >= _LEVEL


def choice_by_likelihood(
    fits: Sequence[RoughFit], records: Sequence[SignalRecord]
) -> StructureChoice:
    """Judge the fits of a scan, simplest first, by the criterion of Hannan and Quinn.

    That is only right if the residuals of the model that is chosen are noise.
    """
    least = min(fit.criterion for fit in fits)
    samples = sum(record.output.size for record in records)
    return StructureChoice(
        fits=tuple(fits),
        fit_percent=tuple(_percent(fit, records) for fit in fits),
        scores=tuple(fit.criterion - least for fit in fits),
        judged_by=LIKELIHOOD,
        basis=f"{samples} samples; noise predicted from its own past",
        material=NO_SUPPORT,
    )


def choice_by_free_run(
    fits: Sequence[RoughFit],
    records: Sequence[SignalRecord],
    held_out: Sequence[SignalRecord],
) -> StructureChoice:
    """Judge the fits of a scan, simplest first, on held-out data where there are any, else by AICc.

    Without held-out trials one or two trials are judged by their last third, if the output moves
    there: the structures are fitted again to the rest. Each simulates the whole trial; its state
    where the last third begins is fitted to that third.
    """
    judges, judged_by = _judges(records, held_out)
    fitted = [one.fitted for one in judges if one.since] or records
    if fitted is not records:
        fits = [rough_fit(fit.structure, fitted, [fit.x]) for fit in fits]
    percent = tuple(_percent(fit, fitted) for fit in fits)
    if not judges:
        scores, effective = _aicc(fits, fitted)
        return StructureChoice(
            fits=tuple(fits),
            fit_percent=percent,
            scores=scores,
            judged_by=judged_by,
            basis=f"{effective:.0f} effective samples; nothing was held out",
        )
    errors = [[one.output - one.run(fit) for one in judges] for fit in fits]
    errors = _without_own_degrees(fits, errors, judges)
    return StructureChoice(
        fits=tuple(fits),
        fit_percent=percent,
        held_out=tuple(
            pooled_fit_percent(
                [(one.output, one.output - e) for one, e in zip(judges, own, strict=True)]
            )
            for own in errors
        ),
        errors=tuple(errors),
        sample_times=tuple(one.record.sample_time for one in judges),
        judged_by=judged_by,
    )


@dataclass(frozen=True)
class _Judge:
    """A record of which the samples from one on judge; the others are fitted."""

    record: SignalRecord
    since: int = 0

    @property
    def output(self) -> FloatArray:
        return self.record.output[self.since :]

    @property
    def fitted(self) -> SignalRecord:
        return self.record.part(slice(0, self.since))

    def run(self, fit: RoughFit) -> FloatArray:
        return fit.structure.free_run(fit.coordinates, self.record, self.since)[0]

    def own(self, fit: RoughFit) -> int:
        """Number of coefficients that are fitted to what judges."""
        return (fit.structure.moving if self.since else fit.structure).per_trial


def _judges(
    records: Sequence[SignalRecord], held_out: Sequence[SignalRecord]
) -> tuple[list[_Judge], str]:
    """What judges, in records and in words; nothing where AICc does."""
    if held_out:
        return [_Judge(record) for record in held_out], "the held-out trials"
    if len(records) > _FEW_TRIALS:
        return [], AICC
    found: list[_Judge] = []
    for record in records:
        cut = round((1.0 - _LAST) * record.output.size)
        head, tail = record.output[:cut], record.output[cut:]
        few = tail.size < FEWEST_SAMPLES or not np.any(np.ptp(record.inputs[:cut], axis=0))
        if few or np.std(tail) < _MOVES * np.std(head):
            return [], AICC
        found.append(_Judge(record, cut))
    return found, "the last third of each trial"


def _without_own_degrees(
    fits: Sequence[RoughFit], errors: list[list[FloatArray]], judges: Sequence[_Judge]
) -> list[list[FloatArray]]:
    """Errors as large as they were if no initial state were fitted to what judges.

    Every model gets its own initial state there, the more numbers the more poles it has, and takes
    up noise with them: of noise that is slow much, as it has few independent samples.
    """
    best = min(errors, key=lambda own: sum(float(e @ e) for e in own))
    effective = _effective_samples(best, [one.record for one in judges])

    def factor(fit: RoughFit) -> float:
        room = effective - sum(one.own(fit) for one in judges)
        return math.sqrt(effective / max(room, 1.0))

    return [[factor(fit) * e for e in own] for fit, own in zip(fits, errors, strict=True)]


def _effective_samples(residual: Sequence[FloatArray], records: Sequence[SignalRecord]) -> float:
    """Number of independent samples of a residual."""
    noise = fit_trial_noise(residual, [record.sample_time for record in records])
    return noise.independent([part.size for part in residual])


def _percent(fit: RoughFit, records: Sequence[SignalRecord]) -> float:
    return pooled_fit_percent(
        [(r.output, fit.structure.free_run(fit.coordinates, r)[0]) for r in records]
    )


def _aicc(
    fits: Sequence[RoughFit], records: Sequence[SignalRecord]
) -> tuple[tuple[float, ...], float]:
    """AICc of all above the smallest, and the effective number of samples."""
    samples = sum(record.output.size for record in records)
    best = min(fits, key=lambda fit: fit.cost)
    residual = best.structure.problem(records).solved(best.x, WHITE)[1]
    ends = np.cumsum([record.output.size for record in records])[:-1]
    effective = _effective_samples(np.split(residual, ends), records)
    scores = aicc_above_best(
        [fit.cost / samples for fit in fits],
        [fit.structure.unknowns + fit.structure.per_trial * len(records) for fit in fits],
        effective,
    )
    return tuple(scores), effective


def p_value_of_improvement(
    simple: Sequence[FloatArray], rich: Sequence[FloatArray], sample_times: Sequence[float]
) -> float:
    """Probability of so much smaller squared errors if both models were equally good.

    Of errors on the same trials, (n_i,) each; one-sided, 1 where they are the same. The variance of
    the mean difference is that of correlated samples, by an autoregressive model of the
    differences.

    Source: Diebold and Mariano (J. Business & Economic Statistics 1995).
    """
    gains = [a**2 - b**2 for a, b in zip(simple, rich, strict=True)]
    samples = sum(gain.size for gain in gains)
    mean = sum(float(np.sum(gain)) for gain in gains) / samples
    noise = fit_trial_noise([gain - mean for gain in gains], sample_times)
    variance = sum(
        gain.size * own.variance / (1.0 - sum(own.coefficients)) ** 2
        for gain, own in zip(gains, noise.models, strict=True)
    )
    if variance <= 0.0:
        return 1.0 if mean <= 0.0 else 0.0
    return 0.5 * math.erfc(mean * samples / math.sqrt(2.0 * variance))
