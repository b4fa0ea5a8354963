"""Small hand-made diagnoses: two muscles, three repeats, residuals known in closed form."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from pamsim.comparison.effects_on_rig import at_size, candidate
from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.diagnosis.held_out_split import HeldOutSplit
from pamsim.diagnosis.method.absent_limits import AbsentLimit
from pamsim.diagnosis.method.evidence import Share, compare_trials
from pamsim.diagnosis.method.lack_of_fit import LackOfFit
from pamsim.diagnosis.method.next_experiment import NextExperiment
from pamsim.diagnosis.method.nuisance_by_protocol import NuisanceByProtocol
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.where import Cell, ResidualMap
from pamsim.diagnosis.recordings_result import result_of
from pamsim.effects.catalog import EFFECTS
from pamsim.recordings.trial import Trial

NOISE = {"pressure_1": 400.0, "pressure_2": 400.0, "angle": 1e-3}
PROTOCOLS = ("swing", "swing_check")
REPEATS = 3
TIME = np.arange(400) / 50.0
NUISANCE = {"force.scale": 1.01}


def trials():
    """Repeats of a sine, with white noise."""
    rng = np.random.default_rng(4)
    swing = np.sin(2.0 * np.pi * TIME / 4.0)
    found = []
    for protocol in PROTOCOLS:
        for repeat in range(1, REPEATS + 1):
            clean = clean_signals(swing)
            found.append(
                Trial(
                    name=f"{protocol}_{repeat}",
                    protocol=protocol,
                    drive="pressure_set",
                    load=0.0,
                    time=TIME,
                    command=np.stack([2e5 + 1e5 * swing, 2e5 - 1e5 * swing], axis=1),
                    measured={
                        c: clean[c] + sd * rng.standard_normal(TIME.size) for c, sd in NOISE.items()
                    },
                )
            )
    return tuple(found)


def clean_signals(swing):
    return {
        "pressure_1": 2e5 + 1e5 * swing,
        "pressure_2": 2e5 - 1e5 * swing,
        "angle": 0.3 * swing,
        "force_1": 300.0 * (1.0 + swing),  # simulated, but not measured
        "force_2": 300.0 * (1.0 - swing),
    }


def model(rig, names, loss, base_loss, *, size=0.7, protocol_of):
    """A fitted model whose held-out trials have some loss, a little more or less each."""
    found = tuple(candidate(rig, EFFECTS[name]) for name in names)
    sizes = {k: v for c in found for k, v in at_size(rig, c.effect, size).items()}
    values = {**NUISANCE, **sizes}
    losses = {t: loss * (1.0 + 0.02 * (i % 3 - 1)) for i, t in enumerate(base_loss)}
    return SimpleNamespace(
        candidates=found,
        names=tuple(names),
        labels=tuple(c.label for c in found),
        family="+".join(dict.fromkeys(c.family for c in found)),
        fit=SimpleNamespace(
            values=values,
            at_bound=(),
            parameters=tuple(p for c in found for p in c.parameters),
            jacobian=np.eye(len(sizes)),
        ),
        intervals={n: (v - 0.1 * abs(v), v + 0.1 * abs(v)) for n, v in values.items()},
        loss=losses,
        mean_loss=float(np.mean(list(losses.values()))),
        improvement=compare_trials(base_loss, losses, protocol_of),
        size_known=lambda: True,
        all_present=lambda: True,
        accepted=lambda tried: True,
    )


def screened(rig, name, similarity):
    trace = np.array([similarity, np.sqrt(1.0 - similarity**2)])
    signature = SimpleNamespace(
        size=1.0,
        projected=trace,
        visible=0.5,
        explained_by_nuisance=0.25,
        similarity=lambda other: float(trace @ other),
    )
    return SimpleNamespace(
        candidate=candidate(rig, EFFECTS[name]),
        traces=(SimpleNamespace(signature=signature),),
        similarity=similarity,
        gain=similarity,
        visible=True,
    )


def report(
    rig,
    verdict,
    best=(),
    tied=(),
    *,
    repeats=REPEATS,
    explained=0.98,
    following=None,
    lack=(0.02, 0.0003, 0.0001),
    refitted=0.97,
    at_bound=(),
    left_for_certain=0.0,
    lack_error=0.0,
):
    """A diagnosis with a given verdict.

    Args:
        rig: without effects.
        verdict: what it ends with.
        best: names of the best model's effects.
        tied: of each tied model.
        repeats: that the floor claims.
        explained: share of the gap.
        following: the next experiment.
        lack: size and p-value of the lack of fit, and the smallest p-value within reach.
        lack_error: standard error of that size.
        refitted: scale of the force in the base model.
        at_bound: what ended at a limit of its range there and in the best model.
        left_for_certain: loss that the best model leaves for certain.
    """
    measured = trials()
    protocol_of = {t.name: t.protocol for t in measured}
    held_out = tuple(t.name for t in measured if t.protocol.endswith("_check"))
    base_loss = {t: 5.0 + 0.1 * i for i, t in enumerate(held_out)}
    options = {"base_loss": base_loss, "protocol_of": protocol_of}
    chosen = model(rig, best, 1.0, **options) if best else None
    if chosen is not None:
        chosen.fit.at_bound = at_bound
    others = tuple(model(rig, names, 1.01, **options) for names in tied)
    parents = tuple(model(rig, [n], 2.0 + i, **options) for i, n in enumerate(best) if best[1:])
    clean = clean_signals(np.sin(2.0 * np.pi * TIME / 4.0))
    off = {"pressure_1": 2e3, "pressure_2": -2e3, "angle": 4e-3}
    conclusion = SimpleNamespace(
        verdict=verdict,
        best=chosen,
        nearest=chosen,
        tied=others,
        explained=Share(value=explained, interval95=(explained - 0.055, explained + 0.01)),
        remainder=0.01,
        left_for_certain=left_for_certain,
        lack=LackOfFit(size=lack[0], error=lack_error, p_value=lack[1], attainable=lack[2]),
    )
    channels = [(c, p) for c in NOISE for p in PROTOCOLS]
    left = Cell(channel="angle", protocol="swing_check", excess=0.2, p_value=0.01)
    method = SimpleNamespace(
        conclusion=conclusion,
        layout=SimpleNamespace(protocol_of=protocol_of, origin={}),
        floor=NoiseFloor(
            sd=NOISE,
            variance={(c, p): NOISE[c] ** 2 for c, p in channels},
            repeats=repeats,
            assumed=repeats < REPEATS,
        ),
        base=SimpleNamespace(values={"force.scale": refitted}, at_bound=at_bound),
        base_loss=base_loss,
        cells=tuple(
            Cell(channel=c, protocol=p, excess=20.0 - i, p_value=0.001 if i < 3 else 0.4)
            for i, (c, p) in enumerate(channels)
        ),
        maps=(
            ResidualMap(
                channel="pressure_1",
                quantity="common_pressure",
                edges=np.array([1e5, 2e5, 3e5]),
                mean=np.array([0.5, -3.0]),
                p_value=0.001,
                worst=1,
            ),
            ResidualMap(
                channel="pressure_1",
                quantity="elapsed",
                edges=np.array([0.0, 4.0, 8.0]),
                mean=np.array([0.1, 0.2]),
                p_value=0.04,
                worst=1,
            ),
            ResidualMap(
                channel="angle",
                quantity="speed",
                edges=np.array([-1.0, 0.0, 1.0]),
                mean=np.array([np.nan, 1.0]),
                p_value=0.3,
                worst=1,
            ),
        ),
        cells_after=() if chosen is None else (left,),
        maps_after=(),
        screened=(screened(rig, "air_leak", 0.9), screened(rig, "angle_bias", 0.4)),
        models=tuple(m for m in (chosen, *others, *parents) if m is not None),
        tried=2,
        evaluations=40,
        absent=(
            AbsentLimit(effect="load_torque", parameter="body.rig.tilt", size=0.5,
                        limit=np.pi / 180.0, cannot_tell=None),
            AbsentLimit(effect="added_inertia", parameter="joint.shaft.armature", size=np.inf,
                        limit=np.inf, cannot_tell="the data do not show it"),
        ),
        nuisance_by_protocol=(
            NuisanceByProtocol(
                parameter="force.scale", p_value=0.02, values={"swing": (1.0, 0.9, 1.1)}
            ),
        ),
        next_experiment=following,
    )  # fmt: skip
    return result_of(
        rig,
        SimpleNamespace(sources=("some/bench",), trials=measured),
        method,
        split=HeldOutSplit(trials=held_out, parts=None, warnings=()),
        given=(Cell(channel="angle", protocol="swing", excess=0.1, p_value=0.3),),
        before={t.name: {c: y + off.get(c, 0.0) for c, y in clean.items()} for t in measured},
        after={t.name: clean for t in measured} if chosen else {},
        skipped={"load_torque": "no body's tilt is stated"},
        warnings=("forces were not measured",),
        seed=3,
        rollouts=240,
        seconds=1.5,
    )


def following():
    return NextExperiment(
        protocol="shut_hold", between=("air_leak", "angle_bias"), before=0.3, after=7.1,
        menu={"shut_hold": 7.1, "bursts": 2.0}, advice="shut the valves",
    )  # fmt: skip


VERDICTS = {
    Verdict.NO_GAP: {},
    Verdict.NAMED: {"best": ["air_leak"]},
    Verdict.NAMED_WITH_REMAINDER: {"best": ["air_leak", "angle_bias"], "explained": 0.7},
    Verdict.AMBIGUOUS: {"best": ["air_leak"], "tied": [["supply_sag"], ["angle_bias"]]},
    Verdict.UNEXPLAINED: {"best": ["air_leak"], "explained": 0.4},
    Verdict.NOT_IDENTIFIABLE: {"best": ["air_leak"], "repeats": 1},
}
"""Verdict -> what else its report says."""
