"""Intervals after a choice of structure: they span the structures that the data do not reject.

With another number of poles or zeros, or with a drift, a gain or dead time still means the same,
and its interval of the chosen structure alone is too narrow: a fast pole that noise hides delays
the output as a dead time does. What the data do not determine in a structure does not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pamsim.core.errors import InputError
from pamsim.identification.choose import Choice
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.model import FitStatus, IdentifiedModel
from pamsim.identification.records import SignalRecord
from pamsim.identification.structure_scan import RoughFit
from pamsim.inference.estimate import Interval


def spanning_structures(
    fit: IdentifiedModel, choice: Choice[RoughFit], records: Sequence[SignalRecord]
) -> IdentifiedModel:
    """The chosen fit, its gains' and dead times' intervals as wide as the choice leaves them.

    With another number of poles or zeros, or with a drift, a gain or dead time still means the
    same, and its interval of the chosen structure alone is too narrow: a fast pole that noise hides
    delays the output as a dead time does. What the data do not determine in a structure does not
    count.

    Of the structures that are not rejected, with as many integrators, those are fitted whose rough
    gain or dead time lies outside its interval.
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
