"""The models that a diagnosis tried, as JSON entries: effects, alternatives, everything else."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from pamsim.comparison.readable_unit import readable, readable_unit
from pamsim.diagnosis.method.evidence import compare
from pamsim.diagnosis.method.judge import Trialled
from pamsim.diagnosis.method.procedure import Diagnosis
from pamsim.diagnosis.method.screen import Screened, alike
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter

CLAIMING = (Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER)
"""Verdicts that claim an effect, from which one repair follows."""


def finite(value: float) -> float | None:
    """A number as JSON can hold it: None for NaN and infinity."""
    return float(value) if math.isfinite(value) else None


def parameter_entry(rig: Rig, model: Trialled, name: str) -> dict[str, Any]:
    """A fitted parameter, in the unit of the rig's file and in SI.

    Args:
        rig: without effects.
        model: in which it was fitted.
        name: as the rig has it.
    """
    parameter = rig_parameter(rig, name)
    interval = model.intervals.get(name)
    value = model.fit.values[name]
    return {
        "value": readable(parameter, value),
        "unit": readable_unit(parameter),
        "interval95": None if interval is None else [readable(parameter, e) for e in interval],
        "value_si": float(value),
        "unit_si": parameter.spec.unit,
        "interval95_si": None if interval is None else [float(end) for end in interval],
        "before": readable(parameter, parameter.value),
        "at_bound": name in model.fit.at_bound,
    }


def effect_entries(
    rig: Rig, found: Diagnosis, protocol_of: Mapping[str, str]
) -> list[dict[str, Any]]:
    """The claimed effects; none where the verdict claims none.

    Each says which share of the gap it explains beyond the others that are claimed with it, and
    how likely luck would have done as well, all effects that were tried taken into account.

    Args:
        rig: without effects.
        found: the diagnosis.
        protocol_of: trial -> protocol.
    """
    best = found.named.best
    if best is None or found.named.verdict not in CLAIMING:
        return []
    entries: list[dict[str, Any]] = []
    for candidate in best.candidates:
        gain, chance = best.gain, best.gain.p_value
        if len(best.candidates) > 1:
            rest = {n for n in best.names if n != candidate.name}
            parents = [m for m in found.models if set(m.names) == rest]
            gain = compare(parents[0].loss, best.loss, protocol_of) if parents else None
            chance = gain.p_value if gain else None
        share = None
        if gain is not None and best.gain.gain > 0.0:
            share = found.named.explained * gain.gain / best.gain.gain
        entries.append(
            {
                "name": candidate.name,
                "family": candidate.family,
                "missing": candidate.effect.missing,
                "parameters": {
                    p.name: parameter_entry(rig, best, p.name) for p in candidate.parameters
                },
                "explained": share,
                "p_value": None if chance is None else min(chance * found.tried, 1.0),
            }
        )
    return entries


def alternative_entries(
    rig: Rig, found: Diagnosis, protocol_of: Mapping[str, str]
) -> list[dict[str, Any]]:
    """Models that predict as well as the best; the best itself comes first where none is claimed.

    Args:
        rig: without effects.
        found: the diagnosis.
        protocol_of: trial -> protocol.
    """
    best = found.named.best
    if best is None:
        return []
    first = [] if found.named.verdict in CLAIMING else [best]
    entries: list[dict[str, Any]] = []
    for model in (*first, *found.named.tied):
        behind = compare(model.loss, best.loss, protocol_of)
        known = behind.error > 0.0 and math.isfinite(behind.error)
        entries.append(
            {
                "name": "+".join(model.names),
                "family": "+".join(dict.fromkeys(c.family for c in model.candidates)),
                "missing": " and ".join(c.effect.missing for c in model.candidates),
                "loss_difference": finite(behind.gain),
                "loss_difference_in_standard_errors": (
                    0.0 if model is best else behind.gain / behind.error if known else None
                ),
                "explained": share_of_gap(found, model),
                "parameters": {
                    p.name: parameter_entry(rig, model, p.name)
                    for c in model.candidates
                    for p in c.parameters
                },
            }
        )
    return entries


def share_of_gap(found: Diagnosis, model: Trialled) -> float | None:
    """Share of the base model's gap that a model explains, as the best model's is counted."""
    best = found.named.best
    if best is None or best.gain.gain <= 0.0:
        return None
    return max(found.named.explained * model.gain.gain / best.gain.gain, 0.0)


def tried_entries(found: Diagnosis) -> list[dict[str, Any]]:
    """Every model that was fitted, the best first."""
    tried = found.tried
    return [
        {
            "effects": list(model.names),
            "held_out_loss": finite(model.mean_loss),
            "gain": finite(model.gain.gain),
            "gain_error": finite(model.gain.error),
            "p_value": min(model.gain.p_value * tried, 1.0),
            "at_bound": list(model.fit.at_bound),
            "size_known": model.size_known(),
        }
        for model in sorted(found.models, key=lambda m: m.mean_loss)
    ]


def screened_entries(screened: Sequence[Screened]) -> list[dict[str, Any]]:
    """What the data can show of every effect, before any is fitted."""
    entries: list[dict[str, Any]] = []
    for one in screened:
        signatures = [trace.signature for trace in one.traces]
        typical = min(signatures, key=lambda s: abs(s.size - 1.0), default=None)
        others = [(abs(alike(one, other)), other) for other in screened if other is not one]
        cosine, nearest = max(others, key=lambda pair: pair[0], default=(0.0, None))
        entries.append(
            {
                "effect": one.candidate.name,
                "family": one.candidate.family,
                "visible": one.visible,
                "visibility": None if typical is None else finite(typical.visible),
                "absorbed": None if typical is None else finite(typical.absorbed),
                "likeness": finite(one.likeness),
                "gain_promised": finite(one.gain),
                "nearest": None if nearest is None else nearest.candidate.name,
                "nearest_cosine": None if nearest is None else finite(cosine),
            }
        )
    return entries
