"""Diagnosis of recordings link by link: the whole of the method in one function."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.links import Link
from pamsim.comparison.repeats import Repeats, repeats
from pamsim.core.computation import Progress, Steps, one_blas_thread
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.held_out import HeldOut
from pamsim.diagnosis.by_link.judge import ALPHA, Judged, judge
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.remainder import Remainder
from pamsim.diagnosis.by_link.search import MATERIAL, search
from pamsim.diagnosis.by_link.sizes import Size, sizes
from pamsim.engine.rig import Rig
from pamsim.inference.model_comparison import fewest_units
from pamsim.recordings.trial import Trial

_FITS = 30  # that a diagnosis of a few effects makes, for the progress bar


@dataclass(frozen=True, kw_only=True)
class LinkDiagnosis:
    """What was found in each link.

    Attributes:
        links: from the command on.
        before: mean square of the whitened rows of each link in the held-out trials, nuisance
            parameters refitted; 1 is noise.
        after: the same with all effects that were found.
        effects: that are there, the largest gain first.
        sizes: parameter of an effect -> value and interval.
        remainders: what is left in every link.
        base: the rig without effects, its nuisance parameters fitted.
        model: with these effects, as fitted.
    """

    links: tuple[Link, ...]
    before: Mapping[Link, float]
    after: Mapping[Link, float]
    effects: tuple[Judged, ...]
    sizes: Mapping[str, Size]
    remainders: Mapping[Link, Remainder]
    base: LinkModel
    model: LinkModel


@one_blas_thread()
def diagnose_links(
    rig: Rig,
    trials: Sequence[Trial],
    candidates: Sequence[Candidate],
    *,
    held_out: Collection[str],
    nuisance: Sequence[str],
    material: float = MATERIAL,
    alpha: float = ALPHA,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> LinkDiagnosis:
    """Find the effects that a rig's model is missing, each in the link where it acts.

    1. Every link that the measured signals separate is simulated with its measured inputs. Its
       residual, in units of what repeats differ by, is white noise where nothing is missing.
    2. Effects are added one at a time, the nuisance parameters of each link refitted, as long as
       one promises more than the other forms of those already found.
    3. On the held-out trials each effect is compared with none and with its rivals.

    Args:
        rig: as it is.
        trials: of it, with channels as it names them; every input recorded twice or more.
        candidates: effects to try, in all of their forms.
        held_out: names of the trials to judge by.
        nuisance: rig parameters that are refitted with every effect, in each link by itself.
        material: see `pamsim.diagnosis.by_link.search.MATERIAL`.
        alpha: see `pamsim.diagnosis.by_link.judge.ALPHA`.
        seed: random seed of the sign flips, where they are drawn.
        threads: simulations at a time; None for one per processor.
        progress: called as each fit begins.

    Raises:
        InputError: for trials that do not fit the rig, inputs that were not repeated, nothing to
            fit, or too few trials to judge by.
    """
    steps = Steps(progress, _FITS)
    steps.begin("the links of the rig as it is")
    simulator = ChainSimulator(rig, _groups(trials, held_out, alpha), threads=threads)
    fitter = LinkFitter(simulator, nuisance, held_out)
    searched = search(fitter, candidates, material=material, steps=steps)
    unseen = HeldOut(fitter, held_out, seed=seed)
    model, effects = judge(fitter, searched, unseen, alpha=alpha, steps=steps)
    before, after = unseen.losses(searched.base), unseen.losses(model)
    return LinkDiagnosis(
        links=simulator.links,
        before={link: float(np.mean(loss)) for link, loss in before.items()},
        after={link: float(np.mean(loss)) for link, loss in after.items()},
        effects=effects,
        sizes=sizes(fitter, model),
        remainders=unseen.remainders(model),
        base=searched.base,
        model=model,
    )


def _groups(
    trials: Sequence[Trial], held_out: Collection[str], alpha: float
) -> tuple[Repeats, ...]:
    """Repeats among the fitted trials, and among those held out."""
    fitted = [trial for trial in trials if trial.name not in held_out]
    judged = [trial for trial in trials if trial.name in held_out]
    fewest = fewest_units(alpha, two_sided=False)
    if not fitted or len(judged) < fewest:
        raise InputError(
            f"{len(fitted)} trials to fit and {len(judged)} to judge by: {fewest} trials or more"
            f" have to be held out, since fewer decide nothing at a level of {100.0 * alpha:g} %;"
            " record every input more often, or name trials with `hold_out`"
        )
    return (*repeats(fitted), *repeats(judged))
