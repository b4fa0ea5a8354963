"""What the identification page shows, in words and finished numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pamsim.report.numbers import fixed, interval, significant, words


@dataclass(frozen=True)
class ParameterView:
    """One identified number."""

    name: str
    value: str
    unit: str
    interval: str


@dataclass(frozen=True)
class ModelView:
    """One line of the table of models."""

    name: str
    recommended: bool
    parameters: list[ParameterView]
    fit: str
    held_out: str
    aicc: str
    poles: list[str]
    remark: str


@dataclass(frozen=True)
class TrialView:
    """One line of the table of trials."""

    name: str
    role: str
    load: str
    samples: str
    duration: str
    fit: str
    rms: str


def model_title(name: str) -> str:
    """Name of a model for people: ``first order with dead time``, ``ARX 2,2,1``, ``OE 1,2,1``."""
    kind, _, orders = name.partition("_")
    if kind in ("arx", "oe"):
        return f"{kind.upper()} {orders.replace('_', ',')}"
    return words(name).replace(" dead time", " with dead time")


def verdict(result: Mapping[str, Any]) -> str:
    """The recommended model, its numbers and the reason, in one sentence."""
    if not result["recommended"]:
        return f"No model is recommended: {result['reason']}."
    model = _named(result, result["recommended"])
    numbers = ", ".join(
        f"{p.name} = {p.value}{' ' + p.unit if p.unit else ''}" for p in parameters(model)
    )
    held = model["fit_percent_held_out"]
    fit = f"fits {fixed(model['fit_percent'], 1)} % of the output's variation"
    if held is not None:
        fit += f" ({fixed(held, 1)} % on held-out trials)"
    return f"Recommended: {model_title(model['name'])}, {numbers}; {fit}. Why: {result['reason']}."


def parameters(model: Mapping[str, Any]) -> list[ParameterView]:
    """Parameters of a model as printed."""
    return [
        ParameterView(
            name=item["name"],
            value=significant(item["value"], 4),
            unit="" if item["unit"] in ("-", "1") else item["unit"],
            interval=interval(item["interval95"], 3),
        )
        for item in model["parameters"].values()
        if item["name"][0] not in "ab"  # coefficients of discrete models are for machines
    ]


def model_views(result: Mapping[str, Any]) -> list[ModelView]:
    """Every model of the result, in its order."""
    return [
        ModelView(
            name=model_title(model["name"]),
            recommended=model["name"] == result["recommended"],
            parameters=parameters(model),
            fit=fixed(model["fit_percent"], 2),
            held_out=fixed(model.get("fit_percent_held_out"), 2),
            aicc=fixed(model.get("aicc_above_best"), 1),
            poles=_poles(model["poles_rad_per_s"]),
            remark=_remark(model),
        )
        for model in result["models"]
    ]


def trial_views(result: Mapping[str, Any]) -> list[TrialView]:
    """Every trial, with how the shown model meets it."""
    model = _named(result, result["shown"])
    scores = {score["name"]: score for score in (*model["trials"], *model["held_out"])}
    key = next(key for score in scores.values() for key in score if key.startswith("rms_"))
    return [
        TrialView(
            name=trial["name"],
            role=words(trial["role"]),
            load=fixed(trial["load_kg"], 2),
            samples=str(trial["samples"]),
            duration=fixed(trial["duration_s"], 2),
            fit=fixed(scores[trial["name"]]["fit_percent"], 2),
            rms=significant(scores[trial["name"]][key], 3),
        )
        for trial in result["trials"]
    ]


def _named(result: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    return next(model for model in result["models"] if model["name"] == name)


def _remark(model: Mapping[str, Any]) -> str:
    parts = [model["sentence"]]
    if model["independence"] is not None:
        parts.append(model["independence"]["sentence"])
    return "; ".join(part.rstrip(".") for part in parts)


def _poles(poles: Sequence[Sequence[float] | None]) -> list[str]:
    """A conjugate pair is one entry."""
    texts: list[str] = []
    for pole in poles:
        real, imaginary = pole or (None, 0.0)
        text = "none" if real is None else significant(real, 3)
        if imaginary != 0.0:
            text += f" ± {significant(abs(imaginary), 3)}j"
        if imaginary >= 0.0 or text not in texts:
            texts.append(text)
    return texts
