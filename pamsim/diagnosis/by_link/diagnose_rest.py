"""Diagnosis of rows at rest with the fits, the search and the names of recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_runs import plain
from pamsim.comparison.rest_simulator import RestSimulator
from pamsim.core.computation import Progress, Steps, one_blas_thread
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.diagnose_links import FITS, LinkDiagnosis
from pamsim.diagnosis.by_link.judge import claimed, judge
from pamsim.diagnosis.by_link.judged import ALPHA
from pamsim.diagnosis.by_link.left_out import LeftOut
from pamsim.diagnosis.by_link.link_model import LinkModel
from pamsim.diagnosis.by_link.rest_fit import RestFitter
from pamsim.diagnosis.by_link.search import Searched, search
from pamsim.diagnosis.by_link.sizes import sizes
from pamsim.diagnosis.by_link.whole_chain import ChannelGap
from pamsim.inference.model_comparison import fewest_units
from pamsim.inference.near_units import nearest_units

SimulatorAt = Callable[[float, Mapping[str, float]], RestSimulator]
"""Variance of the noise of every row [SI], and parameters [SI] near which predictions have to be
exact, to a simulator of the rows."""


@dataclass(frozen=True, kw_only=True)
class RestDiagnosis(LinkDiagnosis):
    """What was found in rows at rest.

    Attributes:
        errors_before: simulated minus measured of each row by a fit to the others, without effects,
            (n,) [SI].
        errors_after: the same with those that were found.
    """

    errors_before: FloatArray
    errors_after: FloatArray

    def gap(self, unit: str, scale: float, floor: float | None) -> ChannelGap:
        """How far readings lie off what the others predict.

        Args:
            unit: in which they are shown.
            scale: of it, per SI unit.
            floor: their noise in this unit; None if it is not known.
        """
        before, after = (
            float(np.sqrt(np.mean(errors**2))) * scale
            for errors in (self.errors_before, self.errors_after)
        )
        return ChannelGap(
            unit=unit, floor=floor, before=before, after=after if self.effects else None
        )


_PASSES = 4  # searches, each with the noise that the one before leaves


@one_blas_thread()
def diagnose_rest(
    simulator_at: SimulatorAt,
    candidates: Sequence[Candidate],
    nuisance: Sequence[str],
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> RestDiagnosis:
    """Find the effects that a model of rows at rest is missing.

    Rows have no repeats, so that their noise is not known. The search takes for it what its model
    leaves per degree of freedom, and is repeated until that finds nothing more; it proposes an
    effect if noise alone would promise as much with probability `ALPHA`. Nothing is decided by
    that: judgement is by exchanges and sign flips, which are free of scale.

    Args:
        simulator_at: see `SimulatorAt`.
        candidates: effects to try, in all of their forms.
        nuisance: names of what is refitted with every effect.
        seed: random seed of exchanges and sign flips.
        progress: called as each fit begins.

    Raises:
        InputError: if the rig has no position at rest for some row, or the rows are too few to
            decide anything, or no more than the parameters that are refitted with every effect.
    """
    steps = Steps(progress, FITS)
    steps.begin("the rows, with the rig as it is")
    stated, fewest = simulator_at(1.0, {}).stated, fewest_units(ALPHA)
    if stated.size < fewest:
        raise InputError(
            f"{stated.size} rows: {fewest} or more are needed, since fewer decide nothing at"
            f" {100.0 * ALPHA:g} %; give more rows at rest, or levels of both branches of a loop"
        )
    variance = float(np.mean(stated**2))
    fitter = RestFitter(simulator_at(variance, {}), nuisance)
    base = fitter.fit(fitter.stated, (), {}, fitter.simulator.links) or fitter.stated
    variance *= _left(base)
    exact_at: dict[str, float] = {}
    names: frozenset[str] | None = None
    searched: Searched | None = None
    for _ in range(_PASSES):
        fitter = RestFitter(simulator_at(variance, exact_at), nuisance)
        material = float(chi2.isf(ALPHA, 1)) / base.rows.size
        searched = search(fitter, candidates, material=material, steps=steps)
        if searched.model.names == names:
            break
        names = searched.model.names
        best = searched.model if searched.model.effects else searched.base
        variance *= _left(best)
        exact_at = {plain(name): value for name, value in best.values.items()}
    assert searched is not None
    near = nearest_units(fitter.simulator.inputs)
    unseen = LeftOut(fitter, searched.known, near, seed=seed)
    model, effects = judge(fitter, searched, unseen, steps=steps)
    sure = claimed(fitter, searched, model, effects)
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
    )


def _left(model: LinkModel) -> float:
    """Mean square of the whitened rows that a model leaves, per degree of freedom."""
    rows, parameters = model.jacobian().shape
    if rows <= parameters:
        raise InputError(f"{rows} rows do not determine {parameters} parameters")
    return model.cost / (rows - parameters)
