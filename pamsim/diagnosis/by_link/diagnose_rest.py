"""Diagnosis of rows at rest with the fits, the search and the names of recordings.

Many predictions cost little there, and one start does not find the best fit. A braid that locks
moves an arm with the exponential of its number times a stiffness: along the valley of the two a fit
from one start ends early.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_runs import Values, plain
from pamsim.comparison.links import Link
from pamsim.comparison.rest_simulator import LinkSimulator, RestSimulator
from pamsim.core.computation import Progress, Steps, one_blas_thread
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.diagnose_links import FITS, LinkDiagnosis
from pamsim.diagnosis.by_link.judge import claimed, judge
from pamsim.diagnosis.by_link.left_out import LeftOut
from pamsim.diagnosis.by_link.limits import ALPHA, USUAL, Limits
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.search import Searched, search
from pamsim.diagnosis.by_link.sizes import sizes
from pamsim.diagnosis.by_link.units import whole_trials
from pamsim.diagnosis.by_link.whole_chain import ChannelGap
from pamsim.inference.model_comparison import fewest_units
from pamsim.inference.row_tests import nearest_units

SimulatorAt = Callable[[float, Mapping[str, float]], RestSimulator]
"""Variance of the noise of every row [SI], and parameters [SI] near which predictions have to be
exact, to a simulator of the rows."""


@dataclass(frozen=True, kw_only=True)
class RestDiagnosis(LinkDiagnosis):
    """What was found in rows at rest."""

    # Simulated minus measured of each row by a fit to the others, without effects, (n,) [SI]
    errors_before: FloatArray
    errors_after: FloatArray  # the same with those that were found

    def gap(self, unit: str, scale: float, floor: float | None) -> ChannelGap:
        """How far readings lie off what the others predict, in a unit of some scale per SI unit.

        ``floor`` is their noise in this unit; None if it is not known.
        """
        before, after = (
            float(np.sqrt(np.mean(errors**2))) * scale
            for errors in (self.errors_before, self.errors_after)
        )
        return ChannelGap(
            unit=unit, floor=floor, before=before, after=after if self.effects else None
        )


_PASSES = 4  # searches, each with the noise that the one before leaves

_FINER = 0.01
"""Steps of finite differences beside those of recordings: balances are solved to 1e-9 rad."""

_FACTORS = (1 / 3, 1.0, 2.0)
"""On the size at which an effect's signature is taken: further starts of effects of several
numbers, the same that tables at rest were fitted from before."""


class RestFitter(LinkFitter):
    """Fits to all units."""

    def __init__(
        self, simulator: LinkSimulator, nuisance: Sequence[str], limits: Limits = USUAL
    ) -> None:
        units = whole_trials(simulator, (), limits=limits)
        super().__init__(simulator, nuisance, units, finer=_FINER)

    def fit(
        self,
        begin: LinkModel,
        effects: Sequence[Candidate],
        start: Values,
        links: Collection[Link],
    ) -> LinkModel | None:
        """The best fit from several starts of each effect of several numbers, see `LinkFitter`."""
        starts = [start]
        for own in effects:
            if len(own.parameters) > 1:
                sizes = [own.moved(own.probes[0], factor) for factor in _FACTORS]
                starts += [{**start, **size} for size in sizes]
        fits = [super(RestFitter, self).fit(begin, effects, one, links) for one in starts]
        if all(fit is None for fit in fits):
            # Nuisance parameters fitted with an effect may have no prediction without it.
            stated = {**self.nuisance, **start}
            fits = [super().fit(begin, effects, stated, links)]
        return min((fit for fit in fits if fit is not None), key=lambda f: f.cost, default=None)


@one_blas_thread()
def diagnose_rest(
    simulator_at: SimulatorAt,
    candidates: Sequence[Candidate],
    nuisance: Sequence[str],
    *,
    alpha: float = ALPHA,
    seed: int = 0,
    progress: Progress | None = None,
) -> RestDiagnosis:
    """Find the effects, in all of their forms, that a model of rows at rest is missing.

    Rows have no repeats, so that their noise is not known. The search takes for it what its model
    leaves per degree of freedom, and is repeated until that finds nothing more; it proposes an
    effect if noise alone would promise as much with probability ``alpha``. Nothing is decided by
    that: judgement is by exchanges and sign flips, which are free of scale. The nuisance parameters
    are refitted with every effect.

    Raises:
        InputError: if the rig has no position at rest for some row, or the rows are too few to
            decide anything, or no more than the parameters that are refitted with every effect.
    """
    steps = Steps(progress, FITS)
    steps.begin("the rows, with the rig as it is")
    stated, fewest = simulator_at(1.0, {}).stated, fewest_units(alpha)
    if stated.size < fewest:
        raise InputError(
            f"{stated.size} rows: {fewest} or more are needed, since fewer decide nothing at"
            f" {100.0 * alpha:g} %; give more rows at rest, or levels of both branches of a loop"
        )
    limits = Limits(alpha=alpha, material=float(chi2.isf(alpha, 1)) / stated.size)
    variance = float(np.mean(stated**2))
    fitter = RestFitter(simulator_at(variance, {}), nuisance, limits)
    base = fitter.fit(fitter.stated, (), {}, fitter.simulator.links) or fitter.stated
    variance *= _left(base)
    exact_at: dict[str, float] = {}
    names: frozenset[str] | None = None
    searched: Searched | None = None
    for _ in range(_PASSES):
        fitter = RestFitter(simulator_at(variance, exact_at), nuisance, limits)
        # All that promise much, for the model decides how large the noise is taken to be.
        searched = search(fitter, candidates, steps=steps, most=len(candidates))
        if searched.model.names == names:
            break
        names = searched.model.names
        best = searched.model if searched.model.effects else searched.base
        variance *= _left(best)
        exact_at = {plain(name): value for name, value in best.values.items()}
    assert searched is not None
    near = nearest_units(fitter.simulator.inputs)
    unseen = LeftOut(fitter, searched.tried.known, near, seed=seed)
    model, effects = judge(searched, unseen)
    sure = claimed(searched, model, effects)
    before, after = unseen.losses(searched.base), unseen.losses(sure)
    return RestDiagnosis(
        links=fitter.simulator.links,
        before={link: float(np.mean(loss)) for link, loss in before.items()},
        after={link: float(np.mean(loss)) for link, loss in after.items()},
        effects=effects,
        sizes=sizes(fitter, model),
        remainders=unseen.remainders(model),
        unexplained=unseen.remainders(sure),
        base=searched.base,
        model=model,
        errors_before=unseen.errors(searched.base),
        errors_after=unseen.errors(model),
        limits=limits,
    )


def _left(model: LinkModel) -> float:
    """Mean square of the whitened rows that a model leaves, per degree of freedom."""
    rows, parameters = model.jacobian().shape
    if rows <= parameters:
        raise InputError(f"{rows} rows do not determine {parameters} parameters")
    return model.cost / (rows - parameters)
