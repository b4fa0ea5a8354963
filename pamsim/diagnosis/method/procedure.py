"""The workflow: floor, base fit, where, screen, refit, judge, sets of effects, verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.noise_floor import NoiseFloor, noise_floor
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.core.errors import InputError
from pamsim.diagnosis.method.absent import AbsentBound, absent_bounds
from pamsim.diagnosis.method.effect_sets import PAIRS, TRIPLES, SetSearch, Told
from pamsim.diagnosis.method.evidence import losses
from pamsim.diagnosis.method.judge import EFFECT_FLOOR, Trialled, polished
from pamsim.diagnosis.method.lack_of_fit import LackOfFit, lack_of_fit
from pamsim.diagnosis.method.next_experiment import NextExperiment, SimulateMenu, next_experiment
from pamsim.diagnosis.method.refit import Fitter, Refit, Remembered
from pamsim.diagnosis.method.regimes import Regime, regimes
from pamsim.diagnosis.method.screen import Screened, alike, screen, shortlist
from pamsim.diagnosis.method.signature import TangentSpace
from pamsim.diagnosis.method.verdict import Named, Verdict, floor_loss, name
from pamsim.diagnosis.method.where import Cell, Map, Regressors, cells, maps
from pamsim.inference.free_parameter import FreeParameter

SHORTLIST = 8
"""Most effects that are refitted for what they promise."""

PROMISE, RIVAL = 0.1, 0.3
"""Shares of the best promise that an effect must reach to be refitted: as long as the gap is not
closed, and once it is."""

OPEN = 0.1
"""Share of what an effect explains that another must promise beside it for the gap to be open."""

_SURE_MAP = 0.005  # p-value of a where-map that shows a gap by itself


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """All that a diagnosis found.

    Attributes:
        named: the verdict.
        floor: of the noise.
        base: fit of the base model.
        base_loss: held-out trial -> its loss.
        perfect_loss: held-out trial -> loss of a perfect model.
        cells: excess per channel and protocol of the base model's fit, the largest first.
        maps: residual over quantities, the surest first.
        regimes: ordinary parameters asked of every protocol by itself, the least alike first.
        screened: what the data can show of every effect.
        models: every model with effects that was fitted.
        tried: single effects that the held-out trials have judged.
        absent: how large the effects that are not claimed could be.
        next_experiment: what would tell tied effects apart; None if nothing is tied.
        evaluations: parameter sets simulated.
    """

    named: Named
    floor: NoiseFloor
    base: Refit
    base_loss: Mapping[str, float]
    perfect_loss: Mapping[str, float]
    cells: tuple[Cell, ...]
    maps: tuple[Map, ...]
    regimes: tuple[Regime, ...]
    screened: tuple[Screened, ...]
    models: tuple[Trialled, ...]
    tried: int
    absent: tuple[AbsentBound, ...]
    next_experiment: NextExperiment | None
    evaluations: int


def diagnose(
    simulator: TrialSimulator,
    ordinary: Sequence[FreeParameter],
    candidates: Sequence[Candidate],
    regressors: Regressors,
    *,
    menu: SimulateMenu | None = None,
    seed: int = 0,
    remembered: Remembered | None = None,
    told: Told | None = None,
) -> Diagnosis:
    """Find where a simulator and its data disagree and name the missing effect.

    Args:
        simulator: of all trials.
        ordinary: parameters that any effect must beat: they are refitted with every one.
        candidates: effects that may be missing.
        regressors: quantities over which residuals are mapped, per trial.
        menu: simulator of further experiments, from which the next one is chosen.
        seed: of the maps' sign flips.
        remembered: fits of an interrupted run; new ones are added.
        told: is told what is being tried.

    Raises:
        InputError: if the base model's simulation breaks down, or nothing is held out.
    """
    say = told or (lambda _: None)
    say("base model")
    start = {p.name: p.start for p in ordinary}
    first = simulator.anchor(start)
    if first is None:
        raise InputError(
            "the base model's simulation breaks down on these trials; check the rig's parameters"
            " and the recording's units"
        )
    layout = simulator.layout
    if not layout.trials(held_out=True) or not layout.trials(held_out=False):
        raise InputError("nothing to judge by: some trials must be held out, and some not")
    floor = noise_floor(layout, first)
    fitter = Fitter(simulator, floor, remembered)
    base = fitter.fit(ordinary, [start])
    anchored = simulator.anchor(base.values)
    base = base if anchored is None else replace(base, residual=anchored)
    fitter.keep_slopes(base)
    space = TangentSpace(base.slopes)
    base_loss = losses(layout, base.residual, floor, held_out=True)
    every = [*layout.trials(held_out=False), *layout.trials(held_out=True)]
    where = cells(layout, base.residual, floor, every)
    over = maps(layout, base.residual, floor, regressors, seed=seed)
    say("screening")
    screened = screen(fitter, base.values, base.residual, space, candidates)
    search = SetSearch(fitter, base, base_loss, screened, say)
    models = _singles(search, screened, base.cost)
    # The shortlist was made without the held-out trials: they judge what stands on it alone.
    tried = max(len(models), 1)
    able = sorted((m for m in models if m.accepted(tried)), key=lambda m: m.mean_loss)
    for growth in (PAIRS, TRIPLES):
        grown = search.grown(able, growth) if able else []
        kept = [m for m in grown if len(search.cut_back(m, growth).names) == len(m.names)]
        models += kept
        able = kept
    by_name = {s.candidate.name: s for s in screened}

    def likeness(one: str, other: str) -> float:
        return alike(by_name[one], by_name[other])

    seen = bool(over) and over[0].p_value < _SURE_MAP
    gap_seen = seen and where[0].p_value < 1e-3 and where[0].excess > 0.1

    def lack(model: Trialled) -> LackOfFit:
        return lack_of_fit(fitter, model.fit, screened, seed=seed)

    def verdict() -> Named:
        return name(layout, floor, base_loss, models, tried, likeness, lack, gap_seen=gap_seen)

    named = verdict()
    if named.best is not None:
        for close in (named.best, *named.tied[:2]):
            say(" + ".join(close.names) + " in fine steps")
            models[models.index(close)] = polished(fitter, base_loss, close)
        named = verdict()
    if floor.repeats < 2 and named.verdict is not Verdict.NO_GAP:
        named = replace(named, verdict=Verdict.NOT_IDENTIFIABLE)
    claimed = named.best.names if named.best is not None else ()
    found = named.best.fit if named.best is not None else base
    say("what else the data allow")
    return Diagnosis(
        named=named,
        floor=floor,
        base=base,
        base_loss=base_loss,
        perfect_loss=floor_loss(layout, floor, layout.trials(held_out=True)),
        cells=where,
        maps=over,
        regimes=regimes(fitter, base),
        screened=screened,
        models=tuple(models),
        tried=tried,
        absent=absent_bounds(
            fitter,
            [s for s in screened if s.candidate.name not in claimed],
            TangentSpace(found.slopes),
            found.residual,
        ),
        next_experiment=next_experiment(named, fitter, menu) if menu is not None else None,
        evaluations=simulator.evaluations,
    )


def _singles(search: SetSearch, screened: Sequence[Screened], base_cost: float) -> list[Trialled]:
    """Refits of single effects, the most promising first.

    A promise is of first order, so the second is tried whatever the first achieves; further down
    the list only what may still be a rival, or while the gap is open.
    """
    models: list[Trialled] = []
    best, closed = 0.0, False
    for place, one in enumerate(shortlist(screened, SHORTLIST, 0.5 * EFFECT_FLOOR, PROMISE)):
        if closed and place > 1 and one.gain < RIVAL * max(best, screened[0].gain):
            continue
        found = search.single(one)
        if found is None:
            continue
        models.append(found)
        gain = base_cost - found.fit.cost
        if gain > best:
            best, closed = gain, search.promise_left(found) < OPEN * gain
    return models
