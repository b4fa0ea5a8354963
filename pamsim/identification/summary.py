"""The result of ``identify`` as lines of text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any


def summary_lines(result: Mapping[str, Any]) -> Iterator[str]:
    """Notes, every model with its numbers, operating points, and the recommended model."""
    for note in result["notes"]:
        yield f"note: {note}"
    roles = [trial["role"] for trial in result["trials"]]
    held_out = f", {roles.count('held_out')} held out" if "held_out" in roles else ""
    yield (
        f"{result['output']['expression']} from {inputs_in_words(result)}:"
        f" {roles.count('fitted')} trial(s) fitted{held_out}"
    )
    for model in result["models"]:
        recommended = model["name"] == result["recommended"]
        yield from _model_lines(model, recommended, result["output"]["unit"])
    if result.get("scan") and result["models"]:
        yield (
            "structure chosen by these data: about nine in ten of the 95 % intervals of gains and"
            " dead times hold"
        )
    for name, reason in result["skipped"].items():
        yield f"not fitted: {name}: {reason}"
    if result["local"] is not None:
        yield f"{len(result['local']['models'])} operating points:"
        for item in result["local"]["dependences"]:
            yield f"  {item['sentence']}"
    if result.get("missing") is None:
        yield f"recommended: {result['recommended'] or 'none'}: {result['reason']}"
    else:
        yield f"not recommended: {result['missing']}"
        yield f"best linear model: {result['best']}: {result['reason']}"


def inputs_in_words(result: Mapping[str, Any]) -> str:
    """The inputs; several with the numbers that their parameters carry: ``[1] u1, [2] u2``."""
    names = [into["expression"] for into in result["inputs"]]
    if len(names) == 1:
        return names[0]
    return ", ".join(f"[{i}] {name}" for i, name in enumerate(names, start=1))


def _model_lines(model: Mapping[str, Any], recommended: bool, unit_output: str) -> Iterator[str]:
    fit = f"fits {_number(model['fit_percent'], '.2f')} %"
    if model["fit_percent_held_out"] is not None:
        fit += f", held out {model['fit_percent_held_out']:.2f} %"
    if model["fit_percent_one_step"] is not None:
        fit += f", one step ahead {model['fit_percent_one_step']:.2f} %"
    yield f"{'*' if recommended else ' '} {model['name']}: {fit}"
    for name, item in model["parameters"].items():
        if name[0] in "ab":  # coefficients of discrete models: in the JSON only
            continue
        if name[0] == "L" and item["value"] == 0.0 and item["interval95"] is not None:
            end = item["interval95"][1]
            below = f"none; below {_number(end, '.4g')} s"
            leads = "none; the output leads the input, check the order of the rows"
            yield f"    {name:5s}{leads if end == 0.0 else below}"
            continue
        unit = "" if item["unit"] in ("-", "1") else f" {item['unit']}"
        line = f"    {name:5s}{_number(item['value'], '12.5g')}{unit}"
        if item["interval95"] is not None:
            low, high = (
                "not bounded" if end is None else f"{end:.4g}" for end in item["interval95"]
            )
            line += f"  [{low}, {high}]"
        yield line
    drifts = [trial for trial in model.get("trials", ()) if trial["drift"] is not None]
    if drifts:
        over = ", ".join(f"{trial['drift']:+.3g} over {trial['name']}" for trial in drifts)
        unit = "" if unit_output == "1" else f" [{unit_output}]"
        yield f"    drift of the output{unit}: {over}"
    poles = [pole for pole in model["poles_rad_per_s"] if pole is not None]
    if poles:
        yield f"    poles {', '.join(_complex(*pole) for pole in poles)} rad/s"
    if model["status"] != "converged":
        yield f"    {model['status'].replace('_', ' ')}: {model['sentence']}"
    if model["independence"] is not None:
        yield f"    {model['independence']['sentence']}"


def _complex(real: float, imaginary: float) -> str:
    return f"{real:.4g}" if imaginary == 0.0 else f"{real:.4g}{imaginary:+.4g}j"


def _number(value: float | None, form: str) -> str:
    return "none" if value is None else f"{value:{form}}"
