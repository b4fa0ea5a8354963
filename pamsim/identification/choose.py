"""Which of several models describes the data: one way to judge them, and how sure the choice is.

Where a linear model leaves nothing but noise, the likelihood of the noise is the most powerful
judge. Where none does (a nonlinear plant), the likelihood would pay for every detail that the noise
model sees one step ahead: there the free run on what was not fitted judges, else AICc.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.model import FitStatus, IdentifiedModel
from pamsim.identification.records import FEWEST_SAMPLES, SignalRecord, pooled_fit_percent
from pamsim.identification.structure_scan import RoughFit, rough_fit
from pamsim.inference.criteria import NO_SUPPORT, TIE, aicc_above_best
from pamsim.inference.estimate import Interval
from pamsim.inference.trial_noise import fit_trial_noise

AICC = "AICc"
HELD_OUT = "the held-out trials"
LIKELIHOOD = "the Hannan-Quinn criterion"
_LAST = 1.0 / 3.0  # share of a record that judges what the rest was fitted to
_MOVES = 0.2  # spread of the output in that share, over that of the rest, from which it can judge
_FEW_TRIALS = 2  # of more, whole trials are not cut
_LEVEL = 0.05  # p-value below which a simpler model is significantly worse than the best
_MATERIAL = 1.05  # RMS error over the best one's, above which it is materially worse


Fit = RoughFit | IdentifiedModel
R = TypeVar("R", bound=Fit)
Part = tuple[SignalRecord, int]
"""A record, and the first of its samples that judge; those before are fitted."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Choice(Generic[R]):
    """Models, simplest first, and by what they are judged."""

    fits: tuple[R, ...]
    fit_percent: tuple[float, ...]  # of each on what it was fitted to [%]
    judged_by: str  # such as ``the last third of each trial`` or ``AICc``
    # fit percent of each on what judges, less what its own initial state takes up of the noise
    # there; empty where a criterion decides [%]
    held_out: tuple[float, ...] = ()
    # of each on every record that judges, enlarged by the same [output unit]
    errors: tuple[list[FloatArray], ...] = ()
    sample_times: tuple[float, ...] = ()  # of these records [s]
    # criterion of each above the smallest; empty where held-out data decide
    scores: tuple[float, ...] = ()
    basis: str = ""  # of the criterion, in words; empty where held-out data decide
    material: float = TIE  # score from which a fit is materially worse than the best
    effective: float = 0.0  # number of independent samples that AICc counts

    def pick(self, without: Collection[int] = ()) -> tuple[int, str]:
        """Return the place of the simplest fit that is not worse than the best, and the reason.

        Not worse on held-out data: the squared error is not significantly larger (test of Diebold
        and Mariano, 5 %) and the RMS error at most 5 % larger. By a criterion: within 2 of the
        smallest. Models at the places ``without`` do not count.
        """
        open_to = [i for i in range(len(self.fits)) if i not in without]
        if len(open_to) == 1:
            return open_to[0], "the only model whose parameters the data determine"
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

    def not_rejected(self, place: int) -> list[R]:
        """The fits that the data do not reject in favour of the one at a place.

        By a criterion those that are less than 10 above it, by held-out data those not worse there.
        """
        if not self.held_out:
            most = self.scores[place] + NO_SUPPORT
            return [f for f, score in zip(self.fits, self.scores, strict=True) if score < most]
        return [fit for i, fit in enumerate(self.fits) if self._as_good(i, place)]

    def _as_good(self, place: int, best: int) -> bool:
        if 100.0 - self.held_out[place] > _MATERIAL * (100.0 - self.held_out[best]):
            return False
        p_value = p_value_of_improvement(self.errors[place], self.errors[best], self.sample_times)
        return p_value >= _LEVEL


def pick_trusted(choice: Choice[IdentifiedModel], names: Sequence[str]) -> tuple[int | None, str]:
    """Place and reason, of the models that converged; no place where none did."""
    lost = {i for i, fit in enumerate(choice.fits) if fit.status is not FitStatus.CONVERGED}
    if len(lost) < len(choice.fits):
        return choice.pick(lost)
    each = (f"{name}: {fit.sentence}" for name, fit in zip(names, choice.fits, strict=True))
    return None, f"no model can be trusted ({'; '.join(each)})"


def by_likelihood(fits: Sequence[RoughFit], records: Sequence[SignalRecord]) -> Choice[RoughFit]:
    """Judge the fits of a scan, simplest first, by the criterion of Hannan and Quinn.

    That is only right if the residuals of the model that is chosen are noise.
    """
    least = min(fit.criterion for fit in fits)
    samples = sum(record.output.size for record in records)
    return Choice(
        fits=tuple(fits),
        fit_percent=_fit_percent(fits, records),
        scores=tuple(fit.criterion - least for fit in fits),
        judged_by=LIKELIHOOD,
        basis=f"{samples} samples; noise predicted from its own past",
        material=NO_SUPPORT,
    )


def by_free_run(
    fits: Sequence[RoughFit],
    records: Sequence[SignalRecord],
    held_out: Sequence[SignalRecord],
) -> Choice[RoughFit]:
    """Judge the fits of a scan, simplest first, on held-out data where there are any, else by AICc.

    Without held-out trials one or two trials are judged by their last third, if the output moves
    there: the structures are fitted again to the rest. Each simulates the whole trial; its state
    where the last third begins is fitted to that third.
    """
    if held_out:
        return by_held_out(fits, records, held_out)
    judges = _last_thirds(records)
    if not judges:
        return by_aicc(fits, records)
    heads = [record.part(slice(0, first)) for record, first in judges]
    fits = [rough_fit(fit.structure, heads, [fit.x]) for fit in fits]
    return _by_errors(fits, heads, judges, "the last third of each trial")


def by_held_out(
    fits: Sequence[R], records: Sequence[SignalRecord], held_out: Sequence[SignalRecord]
) -> Choice[R]:
    """Judge fits, simplest first, by their free run on trials that were not fitted."""
    return _by_errors(fits, records, _whole(held_out), HELD_OUT)


def by_aicc(fits: Sequence[R], records: Sequence[SignalRecord]) -> Choice[R]:
    """Judge fits, simplest first, by AICc, of the independent samples that the best leaves.

    The residuals of a mechanism are correlated and would otherwise favour every added parameter.

    Source: Hurvich and Tsai (Biometrika 1989); rule of 2 of Burnham and Anderson, Model Selection
    (2002).
    """
    parts = _whole(records)
    errors = [_errors(fit, parts) for fit in fits]
    squares = [_square(own) for own in errors]
    place = squares.index(min(squares))
    best = fits[place]
    if isinstance(best, IdentifiedModel):
        effective = best.noise.independent([record.output.size for record in records])
    else:
        effective = _effective_samples(errors[place], parts)
    samples = sum(record.output.size for record in records)
    scores = aicc_above_best(
        [square / samples for square in squares],
        [fit.structure.counted(len(records)) for fit in fits],
        effective,
    )
    return Choice(
        fits=tuple(fits),
        fit_percent=_percent(errors, parts),
        scores=tuple(scores),
        judged_by=AICC,
        basis=f"{effective:.0f} effective samples; nothing was held out",
        effective=effective,
    )


def _by_errors(
    fits: Sequence[R], fitted: Sequence[SignalRecord], judges: Sequence[Part], judged_by: str
) -> Choice[R]:
    """Errors count as large as they were if no initial state were fitted to what judges.

    Every model gets its own initial state there, the more numbers the more poles it has, and takes
    up noise with them: of noise that is slow much, as it has few independent samples.
    """
    errors = [_errors(fit, judges) for fit in fits]
    effective = _effective_samples(min(errors, key=_square), judges)

    def factor(fit: R) -> float:
        structure = _continuous(fit)
        own = sum((structure.moving if first else structure).per_trial for _, first in judges)
        return math.sqrt(effective / max(effective - own, 1.0))

    errors = [[factor(fit) * e for e in own] for fit, own in zip(fits, errors, strict=True)]
    return Choice(
        fits=tuple(fits),
        fit_percent=_fit_percent(fits, fitted),
        held_out=_percent(errors, judges),
        errors=tuple(errors),
        sample_times=tuple(record.sample_time for record, _ in judges),
        judged_by=judged_by,
    )


def _whole(records: Sequence[SignalRecord]) -> list[Part]:
    return [(record, 0) for record in records]


def _last_thirds(records: Sequence[SignalRecord]) -> list[Part]:
    """The ends of one or two trials; nothing where one of them cannot judge."""
    if len(records) > _FEW_TRIALS:
        return []
    found: list[Part] = []
    for record in records:
        cut = round((1.0 - _LAST) * record.output.size)
        tail = record.output[cut:]
        try:
            head = record.part(slice(0, cut)).output
        except InputError:  # its input or output never moves
            return []
        if tail.size < FEWEST_SAMPLES or np.std(tail) < _MOVES * np.std(head):
            return []
        found.append((record, cut))
    return found


def _effective_samples(residual: Sequence[FloatArray], parts: Sequence[Part]) -> float:
    """Number of independent samples of a residual."""
    noise = fit_trial_noise(residual, [record.sample_time for record, _ in parts])
    return noise.independent([part.size for part in residual])


def _errors(fit: Fit, parts: Sequence[Part]) -> list[FloatArray]:
    """Measured minus free run where each record judges."""
    structure, x = _continuous(fit), fit.coordinates
    return [r.output[first:] - structure.free_run(x, r, first)[0] for r, first in parts]


def _fit_percent(fits: Sequence[Fit], records: Sequence[SignalRecord]) -> tuple[float, ...]:
    parts = _whole(records)
    return _percent([_errors(fit, parts) for fit in fits], parts)


def _continuous(fit: Fit) -> ContinuousStructure:
    """The structure: discrete models stand beside what is judged, for comparison."""
    assert isinstance(fit.structure, ContinuousStructure)
    return fit.structure


def _square(errors: Sequence[FloatArray]) -> float:
    return sum(float(error @ error) for error in errors)


def _percent(errors: Sequence[Sequence[FloatArray]], parts: Sequence[Part]) -> tuple[float, ...]:
    """Fit of each model by its errors where the records judge [%]."""
    outputs = [record.output[first:] for record, first in parts]
    return tuple(
        pooled_fit_percent([(y, y - e) for y, e in zip(outputs, own, strict=True)])
        for own in errors
    )


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


def spanning_structures(
    fit: IdentifiedModel, choice: Choice[RoughFit], records: Sequence[SignalRecord]
) -> IdentifiedModel:
    """The chosen fit, its gains' and dead times' intervals as wide as the choice leaves them.

    With another number of poles or zeros, or with a drift, a gain or dead time still means the
    same, and its interval of the chosen structure alone is too narrow: a fast pole that noise hides
    delays the output as a dead time does. Of the structures that are not rejected, those are fitted
    whose rough gain or dead time lies outside its interval; what the data do not determine in one
    does not count.
    """
    same = replace(fit.structure, real_lags=False)
    place = next((i for i, one in enumerate(choice.fits) if one.structure == same), None)
    if place is None:
        return fit
    sides = {e.name: e.interval95 for e in fit.estimates if e.name[0] in "KL" and e.interval95}
    spanned = dict(sides)
    for other in choice.not_rejected(place):
        if other.structure.integrators != fit.structure.integrators:
            continue
        rough = _gains_and_delays(other)
        if all(low <= rough[name] <= high for name, (low, high) in sides.items()):
            continue
        found = _determined(other, records)
        found |= {name: (0.0, 0.0) for name in sides if name[0] == "L" and rough[name] == 0.0}
        for name in sides.keys() & found.keys():
            (low, high), (least, most) = spanned[name], found[name]
            spanned[name] = min(low, least), max(high, most)
    if spanned == sides:
        return fit
    return replace(
        fit,
        estimates=tuple(
            replace(one, interval95=spanned.get(one.name, one.interval95)) for one in fit.estimates
        ),
        sentence=f"{fit.sentence}; intervals of gains and dead times span other structures that the"
        " records do not reject",
    )


def _gains_and_delays(rough: RoughFit) -> dict[str, float]:
    """Gains and dead times of a rough fit, by the names of estimates; 0 of none."""
    structure, at = rough.structure, rough.coordinates
    values = {"K": structure.static_gains(at), "L": structure.delays(at)}
    return {
        name + mark: float(value)
        for name, each in values.items()
        for mark, value in zip(structure.marks, each, strict=True)
    }


def _determined(rough: RoughFit, records: Sequence[SignalRecord]) -> dict[str, Interval]:
    """Intervals of gains that cannot be 0, and values of dead times, of a structure fitted well.

    Beside zeros the intervals of dead times may have no end.
    """
    try:
        fit = fit_model(records, rough.structure, starts=[rough.x])
    except InputError:
        return {}
    if fit.status is not FitStatus.CONVERGED:
        return {}
    found: dict[str, Interval] = {}
    for one in fit.estimates:
        if one.name[0] == "L":
            found[one.name] = one.value, one.value
        elif one.name[0] == "K" and one.interval95 and one.interval95[0] * one.interval95[1] > 0.0:
            found[one.name] = one.interval95
    return found
