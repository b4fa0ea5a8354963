"""Diagnosis of rows at rest with the fits, the search and the names of recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.stats import chi2

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_simulator import plain
from pamsim.comparison.link_simulator import LinkSimulator
from pamsim.core.computation import Progress, Steps, one_blas_thread
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis
from pamsim.diagnosis.by_link.judge import ALPHA
from pamsim.diagnosis.by_link.judge_left_out import judge_left_out, losses_left_out
from pamsim.diagnosis.by_link.link_fit import LinkModel
from pamsim.diagnosis.by_link.remainder import Remainder
from pamsim.diagnosis.by_link.rest_fit import RestFitter
from pamsim.diagnosis.by_link.search import Searched, search
from pamsim.diagnosis.by_link.sizes import sizes

SimulatorAt = Callable[[float, Mapping[str, float]], LinkSimulator]
"""Variance of the noise of every row [SI], and parameters [SI] near which predictions have to be
exact, to a simulator of the rows."""

_PASSES = 4  # searches, each with the noise that the one before leaves
_FITS = 30  # that a diagnosis of a few effects makes, for the progress bar


@one_blas_thread()
def diagnose_rest(
    simulator_at: SimulatorAt,
    candidates: Sequence[Candidate],
    nuisance: Sequence[str],
    *,
    alpha: float = ALPHA,
    seed: int = 0,
    progress: Progress | None = None,
) -> LinkDiagnosis:
    """Find the effects that a model of rows at rest is missing.

    Rows have no repeats, so that their noise is not known. The search takes for it what its model
    leaves per degree of freedom, and is repeated until that finds nothing more; it proposes an
    effect if noise alone would promise as much with probability alpha. Nothing is decided by that:
    judgement is by exchanges and sign flips, which are free of scale.

    Args:
        simulator_at: see `SimulatorAt`.
        candidates: effects to try, in all of their forms.
        nuisance: names of what is refitted with every effect.
        alpha: see `pamsim.diagnosis.by_link.judge.ALPHA`.
        seed: random seed of exchanges and sign flips.
        progress: called as each fit begins.

    Raises:
        InputError: if the rig has no position at rest for some row, or the rows are no more than
            the parameters that are refitted with every effect.
    """
    steps = Steps(progress, _FITS)
    steps.begin("the rows, with the rig as it is")
    stated = simulator_at(1.0, {}).stated
    variance = float(np.mean(stated**2))
    fitter = RestFitter(simulator_at(variance, {}), nuisance)
    base = fitter.fit(fitter.stated, (), {}, fitter.simulator.links) or fitter.stated
    variance *= _left(base)
    near: dict[str, float] = {}
    names: frozenset[str] | None = None
    searched: Searched | None = None
    for _ in range(_PASSES):
        fitter = RestFitter(simulator_at(variance, near), nuisance)
        material = float(chi2.isf(alpha, 1)) / base.rows.size
        searched = search(fitter, candidates, material=material, steps=steps)
        if searched.model.names == names:
            break
        names = searched.model.names
        best = searched.model if searched.model.effects else searched.base
        variance *= _left(best)
        near = {plain(name): value for name, value in best.values.items()}
    assert searched is not None
    model, effects = judge_left_out(fitter, searched, alpha=alpha, seed=seed, steps=steps)
    if not effects:
        model = searched.base
    before, after = (losses_left_out(fitter, one) for one in (searched.base, model))
    return LinkDiagnosis(
        links=fitter.simulator.links,
        before={link: float(np.mean(loss)) for link, loss in before.items()},
        after={link: float(np.mean(loss)) for link, loss in after.items()},
        effects=effects,
        sizes=sizes(fitter, model),
        # Without repeats it is not known what a perfect model would leave.
        remainders={link: Remainder(excess=0.0, p_value=1.0, known=False) for link in before},
        model=model,
    )


def _left(model: LinkModel) -> float:
    """Mean square of the whitened rows that a model leaves, per degree of freedom."""
    rows, parameters = model.jacobian().shape
    if rows <= parameters:
        raise InputError(f"{rows} rows do not determine {parameters} parameters")
    return model.cost / (rows - parameters)
