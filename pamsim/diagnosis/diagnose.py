"""The workflow: floor, base fit, where, screen, refit, judge, sets of effects, verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from pamsim.core.errors import InputError
from pamsim.diagnosis.candidate import Candidate
from pamsim.diagnosis.evidence import compare, losses
from pamsim.diagnosis.judge import EFFECT_FLOOR, Trialled, trial
from pamsim.diagnosis.noise_floor import NoiseFloor, noise_floor
from pamsim.diagnosis.refit import Fitter, Refit
from pamsim.diagnosis.screen import Screened, alike, screen, shortlist
from pamsim.diagnosis.signature import TangentSpace
from pamsim.diagnosis.trial_residuals import TrialSimulator
from pamsim.diagnosis.verdict import Named, Verdict, name
from pamsim.diagnosis.where import Cell, Map, Regressors, cells, maps
from pamsim.sysid.free_parameter import FreeParameter

Told = Callable[[str], None]
"""Is told what is being tried."""

SHORTLIST = 7
SECONDS = 4
"""Second effects that are tried beside each of the best single ones."""

BEAM = 2
_SURE_MAP = 0.005  # p-value of a where-map that shows a gap by itself
_SECOND_SIGNIFICANCE = 0.01
_SECOND_FLOOR = 2.0 * EFFECT_FLOOR


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """All that a diagnosis found.

    Attributes:
        named: the verdict.
        floor: of the noise.
        base: fit of the base model.
        base_loss: held-out trial -> its loss.
        cells: excess per channel and protocol of the base model's fit, the largest first.
        maps: residual over quantities, the surest first.
        screened: what the data can show of every effect.
        models: every model with effects that was fitted.
        evaluations: parameter sets simulated.
    """

    named: Named
    floor: NoiseFloor
    base: Refit
    base_loss: Mapping[str, float]
    cells: tuple[Cell, ...]
    maps: tuple[Map, ...]
    screened: tuple[Screened, ...]
    models: tuple[Trialled, ...]
    evaluations: int


def diagnose(
    simulator: TrialSimulator,
    ordinary: Sequence[FreeParameter],
    candidates: Sequence[Candidate],
    regressors: Regressors,
    *,
    seed: int = 0,
    told: Told | None = None,
) -> Diagnosis:
    """Find where a simulator and its data disagree and name the missing effect.

    Args:
        simulator: of all trials.
        ordinary: parameters that any effect must beat: they are refitted with every one.
        candidates: effects that may be missing.
        regressors: quantities over which residuals are mapped, per trial.
        seed: of the maps' sign flips.
        told: is told what is being tried.

    Raises:
        InputError: if the base model's simulation breaks down, or nothing is held out.
    """
    say = told or (lambda _: None)
    say("base model")
    start = {p.name: p.start for p in ordinary}
    (first,) = simulator.many([start])
    if first is None:
        raise InputError(
            "the base model's simulation breaks down on these trials; check the rig's parameters"
            " and the recording's units"
        )
    layout = simulator.layout
    if not layout.trials(held_out=True) or not layout.trials(held_out=False):
        raise InputError("nothing to judge by: some trials must be held out, and some not")
    floor = noise_floor(layout, first)
    fitter = Fitter(simulator, floor)
    base = fitter.fit(ordinary, start)
    slopes = fitter.keep_slopes(ordinary, base)
    space = TangentSpace(slopes)
    base_loss = losses(layout, base.residual, floor, held_out=True)
    every = [*layout.trials(held_out=False), *layout.trials(held_out=True)]
    where = cells(layout, base.residual, floor, every)
    over = maps(layout, base.residual, floor, regressors, seed=seed)
    say("screening")
    screened = screen(fitter, base, space, candidates)
    look_alikes = {c.name: c.effect.look_alikes for c in candidates}
    listed = shortlist(screened, SHORTLIST, look_alikes)
    models: list[Trialled] = []
    for one in listed:
        say(one.candidate.name)
        found = trial(fitter, base, base_loss, ordinary, [one.candidate], _starts(one))
        if found is not None:
            models.append(found)
    tried = len(candidates)
    able = sorted((m for m in models if m.accepted(tried)), key=lambda m: m.mean_loss)
    pairs = _pairs(fitter, base, base_loss, ordinary, space, screened, able, say)
    by_name = {s.candidate.name: s for s in screened}

    def likeness(one: str, other: str) -> float:
        return alike(by_name[one], by_name[other])

    seen = bool(over) and over[0].p_value < _SURE_MAP
    named = name(
        layout,
        floor,
        base_loss,
        [*models, *pairs],
        tried,
        likeness,
        gap_seen=seen and where[0].p_value < 1e-3 and where[0].excess > 0.1,
    )
    if floor.repeats < 2 and named.verdict is not Verdict.NO_GAP:
        named = replace(named, verdict=Verdict.NOT_IDENTIFIABLE)
    return Diagnosis(
        named=named,
        floor=floor,
        base=base,
        base_loss=base_loss,
        cells=where,
        maps=over,
        screened=screened,
        models=(*models, *pairs),
        evaluations=simulator.evaluations,
    )


def _starts(one: Screened) -> list[dict[str, float]]:
    """The probe whose signature is most alike, then the effect's own further starts."""
    probes = dict(one.candidate.probes)
    return [probes[one.best], *one.candidate.starts]


def _pairs(
    fitter: Fitter,
    base: Refit,
    base_loss: Mapping[str, float],
    ordinary: Sequence[FreeParameter],
    space: TangentSpace,
    screened: Sequence[Screened],
    able: Sequence[Trialled],
    say: Told,
) -> list[Trialled]:
    """Pairs that beat both their members and the best single effect on the held-out trials."""
    layout = fitter.simulator.layout
    accepted: list[Trialled] = []
    jobs: list[tuple[Trialled, Screened]] = []
    for single in able[:BEAM]:
        misfit = space.across(-fitter.weighted(single.fit.residual))
        others = [s for s in screened if s.candidate.name not in single.names and s.visible]
        others.sort(key=lambda s: -max((g.likeness(misfit) for g in s.signatures), default=0.0))
        jobs += [(single, other) for other in others[:SECONDS]]
    done: set[frozenset[str]] = set()
    for single, other in jobs:
        pair = frozenset({*single.names, other.candidate.name})
        if pair in done:
            continue
        done.add(pair)
        say(" + ".join(sorted(pair)))
        began = {p.name: single.fit.values[p.name] for c in single.candidates for p in c.parameters}
        starts = [{**began, **values} for values in _starts(other)]
        found = trial(
            fitter, base, base_loss, ordinary, [*single.candidates, other.candidate], starts
        )
        if found is None:
            continue
        over = compare(able[0].loss, found.loss, layout.protocol_of)
        parent = compare(single.loss, found.loss, layout.protocol_of)
        sure = all(
            c.p_value * max(len(jobs), 1) < _SECOND_SIGNIFICANCE and c.gain > _SECOND_FLOOR
            for c in (over, parent)
        )
        if sure and found.size_known():
            accepted.append(found)
    return accepted
