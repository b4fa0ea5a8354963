"""Diagnose a length-pressure loop: whether a reversible law is enough for it, and what opens it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.diagnosis.method.loop_diagnosis import LoopDiagnosis, diagnose_loop
from pamsim.diagnosis.method.loop_effects import LOOP_EFFECTS
from pamsim.diagnosis.method.loop_fit import Loop, LoopModel
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.result import (
    Details,
    Diagnosis,
    Estimate,
    FoundEffect,
    GapEntry,
    NextStep,
    Place,
    Region,
    Resemblance,
    RmsLevel,
    TriedModel,
)
from pamsim.effects.catalog import EFFECTS
from pamsim.inference.permutation import rms_interval95
from pamsim.recordings.measured_table import LengthLoop
from pamsim.recordings.printed import BRANCHES, arctangent_law, loop_equation, loop_rows

RUNS = 3
"""Runs behind each printed mean (Alraouf 2025)."""

PRINTED_LOOPS = {
    "alraouf2025": "the printed means of three runs (Alraouf 2025, Table 2), with their standard"
    " errors",
    "alraouf2025_equations": "the printed branch equations (Alraouf 2025, (3) and (4)) at the"
    " pressures of Table 2: a substitute for readings that are not printed, without their noise",
}
"""Name -> form in which Alraouf 2025 prints its loop."""

CHANNEL = "length"

_M_PER_CM = 1e-2
_MM_PER_M = 1e3


def printed_loop(name: str) -> Loop:
    """A length-pressure loop of Alraouf 2025.

    Args:
        name: one of `PRINTED_LOOPS`.

    Returns:
        Pressures [Pa] and lengths [m], up and down again.

    Raises:
        InputError: for another name.
    """
    if name not in PRINTED_LOOPS:
        raise InputError(f"no printed loop {name!r}; {nearest(name, PRINTED_LOOPS)}")
    rows = {branch: loop_rows(branch) for branch in BRANCHES}
    error = None
    if name == "alraouf2025":
        lengths = {b: np.array([row.mean.value for row in rows[b]]) for b in BRANCHES}
        errors = {b: np.array([row.deviation.value for row in rows[b]]) for b in BRANCHES}
        error = _there_and_back(errors["up"], errors["down"]) * _M_PER_CM / np.sqrt(RUNS)
    else:
        lengths = {
            b: arctangent_law(
                np.array([row.pressure_kpa for row in rows[b]]),
                *(number.value for number in loop_equation(b)),
            )
            for b in BRANCHES
        }
    up, down = (np.array([row.pressure_kpa for row in rows[b]]) * PA_PER_KPA for b in BRANCHES)
    return Loop(
        input=_there_and_back(up, down),
        output=_there_and_back(lengths["up"], lengths["down"]) * _M_PER_CM,
        rising=np.arange(up.size + down.size) < up.size,
        error=error,
    )


def measured_loop(table: LengthLoop) -> Loop:
    """A measured length-pressure loop, its rows in the order in which they were taken."""
    return Loop(input=table.pressure, output=table.length, rising=table.rising)


def diagnose_length_loop(
    loop: Loop,
    source: str,
    *,
    effects: Sequence[str] = (),
    warnings: Sequence[str] = (),
    seed: int = 0,
) -> Diagnosis:
    """Diagnose a length-pressure loop.

    Args:
        loop: readings, see `printed_loop` and `measured_loop`.
        source: what they are, in words.
        effects: names of those that may open it; if left out, all that readings at rest can show.
        warnings: what a reader should know of the readings.
        seed: random seed of exchanges and sign flips.

    Raises:
        InputError: for an effect that opens no loop, or fewer than five pressures that were read on
            both branches.
    """
    began = time.perf_counter()
    known = dict.fromkeys(effect.name for effect in LOOP_EFFECTS)
    for name in effects:
        if name not in known:
            raise InputError(f"no effect {name!r} that opens a loop; {nearest(name, known)}")
    tried = [e for e in LOOP_EFFECTS if (e.name in effects if effects else not e.moving)]
    skipped = {
        e.name: "vanishes at rest; name it if the readings were taken in motion"
        for e in LOOP_EFFECTS
        if not effects and e.moving
    }
    method = diagnose_loop(loop, tried, seed=seed)
    notes = [*warnings, "one loop at one rate cannot separate hysteresis from creep"]
    if not effects:
        notes.append("readings are assumed to be taken at rest, so viscous friction is not tried")
    if loop.error is None:
        notes.append("the readings' errors are not known: no noise floor")
    best, verdict = method.best, method.verdict
    claimed = best if verdict.claims else None
    repairs = best if verdict.repairs else None
    models = [] if repairs is None else [repairs, *method.tied]
    variance = float(np.mean(method.base.unseen**2))
    return Diagnosis(
        kind="loop",
        rig=None,
        data=(source,),
        verdict=verdict,
        effects=() if claimed is None else (_found(claimed, method.explained.value),),
        certain=() if claimed is None or claimed.effect is None else (claimed.effect.name,),
        resembles=_resemblance(method),
        alternatives=tuple(
            _found(model, 1.0 - model.unseen_rms**2 / variance)
            for model in models
            if model is not claimed
        ),
        where=(_place(method),),
        maps=(),
        gap={
            CHANNEL: GapEntry(
                unit="mm",
                floor=None if method.floor is None else RmsLevel.scaled(method.floor, _MM_PER_M),
                before=_unseen_level(method.base, seed),
                after=None if repairs is None else _unseen_level(repairs, seed),
            )
        },
        absent={},
        warnings=tuple(notes),
        next_experiment=_next_step(verdict),
        explained=method.explained.value,
        explained_interval95=method.explained.interval95,
        effects_tried=len({e.name for e in tried}),
        tried=tuple(_tried(model) for model in method.attempts),
        nuisance=(),
        held_out=tuple(f"{pressure / PA_PER_KPA:g} kPa" for pressure in method.level),
        held_out_method="each reading is predicted from the other at its pressure and all others",
        skipped=skipped,
        details=Details(
            branches=_branches(method),
            forms_as_good=tuple(m.effect.form for m in method.forms if m.effect is not None),
            in_sample={
                "before": RmsLevel.scaled(method.base.rms, _MM_PER_M),
                "after": None if best is None else RmsLevel.scaled(best.rms, _MM_PER_M),
            },
        ),
        seed=seed,
        rollouts=0,
        parameter_sets=0,
        seconds=time.perf_counter() - began,
        method=method,
    )


def _found(model: LoopModel, explained: float) -> FoundEffect:
    assert model.effect is not None
    return FoundEffect(
        members={model.effect.name: model.effect.missing},
        family=_family(model.effect.name),
        form=model.effect.form,
        parameters=_estimates(model),
        explained=explained,
        p_value=model.p_value,
    )


def _estimates(model: LoopModel) -> dict[str, Estimate]:
    """How far the effect opens the loop, and the number of its shape."""
    low, high = model.interval95
    estimates = {
        "opening": Estimate(
            value=model.opening * _MM_PER_M,
            unit="mm",
            interval95=(low * _MM_PER_M, high * _MM_PER_M),
            value_si=model.opening,
            unit_si="m",
            interval95_si=model.interval95,
        )
    }
    if model.effect is not None and model.effect.shape:
        estimates[model.effect.shape] = Estimate(
            value=model.shape, unit="1", value_si=model.shape, unit_si="1"
        )
    return estimates


def _family(name: str) -> str:
    """Family in the catalogue; an effect that is not in it is its own."""
    return EFFECTS[name].family if name in EFFECTS else name


def _branches(method: LoopDiagnosis) -> dict[str, Any]:
    """Lengths on both branches at every pressure: measured, reversible, and of the nearest model.

    The nearest model is drawn, whether or not it may be claimed.
    """
    nearest = None
    if method.nearest is not None and method.nearest.effect is not None:
        assert method.fitted is not None
        nearest = {
            "effect": method.nearest.effect.name,
            "form": method.nearest.effect.form,
            "rising_mm": method.fitted[0] * _MM_PER_M,
            "falling_mm": method.fitted[1] * _MM_PER_M,
        }
    return {
        "pressure_kpa": method.level / PA_PER_KPA,
        "rising_mm": method.measured[0] * _MM_PER_M,
        "falling_mm": method.measured[1] * _MM_PER_M,
        "reversible_mm": method.reversible * _MM_PER_M,
        "nearest": nearest,
        "rising_minus_falling_mm": method.difference * _MM_PER_M,
        "error_mm": None if method.error is None else method.error * _MM_PER_M,
        "mean_mm": np.mean(method.difference) * _MM_PER_M,
    }


def _resemblance(method: LoopDiagnosis) -> Resemblance | None:
    """The model that predicts unseen readings best."""
    near = method.nearest
    if method.verdict is Verdict.NO_GAP or near is None:
        return None
    assert near.effect is not None
    share = 1.0 - (near.unseen_rms / method.base.unseen_rms) ** 2
    return Resemblance(
        name=near.effect.name,
        family=_family(near.effect.name),
        explained=method.explained.value if near is method.best else max(share, 0.0),
        p_value=near.p_value,
    )


def _place(method: LoopDiagnosis) -> Place:
    """The pressure at which the branches differ most."""
    pressure = float(method.level[int(np.argmax(np.abs(method.difference)))]) / PA_PER_KPA
    return Place(
        channel=CHANNEL,
        protocol="loop",
        excess=None,
        p_value=method.p_value,
        region=Region(
            quantity="pressure", low=pressure, high=pressure, unit="kPa", p_value=method.p_value
        ),
    )


def _unseen_level(model: LoopModel, seed: int) -> RmsLevel:
    return RmsLevel.scaled(model.unseen_rms, _MM_PER_M, rms_interval95(model.unseen, seed=seed))


def _next_step(verdict: Verdict) -> NextStep | None:
    """What to measure next; None if the question is settled."""
    if verdict is Verdict.NO_GAP:
        advice = "more runs of the same loop, with each reading recorded and not their mean alone"
        return NextStep(protocol=None, advice=advice)
    if verdict is Verdict.AMBIGUOUS:
        advice = "the same loop at a tenth of the rate: creep closes it, hysteresis does not"
        return NextStep(protocol=None, advice=advice)
    return None


def _tried(model: LoopModel) -> TriedModel:
    effect, improvement = model.effect, model.improvement
    assert effect is not None
    return TriedModel(
        effects=(effect.name,),
        form=effect.form,
        held_out=model.unseen_rms * _MM_PER_M,
        unit="mm",
        in_sample=model.rms * _MM_PER_M,
        p_value=model.p_value,
        p_value_unseen=None if improvement is None else improvement.p_value,
        accepted=model.accepted,
        parameters=_estimates(model),
    )


def _there_and_back(up: FloatArray, down: FloatArray) -> FloatArray:
    return np.concatenate([up, down[::-1]])
