"""The result of ``fit`` as lines of text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any


def summary_lines(result: Mapping[str, Any]) -> Iterator[str]:
    """Notes, the ranking if there is one, warnings, coefficients with intervals, and scores.

    Args:
        result: of schema ``pamsim-fit/2``.
    """
    yield from detail_lines(result)
    yield from (f"warning: {warning}" for warning in result["warnings"])
    yield from answer_lines(result)


def detail_lines(result: Mapping[str, Any]) -> Iterator[str]:
    """Notes, the ranking if there is one, the searches that were compared."""
    for note in result["notes"]:
        yield f"note: {note}"
    if result["kind"] == "force_map" and result["compared"]:
        yield from _ranking_lines(result["fits"], result["skipped"])
    if result["searches"]:
        yield from _search_lines(result["searches"])


def answer_lines(result: Mapping[str, Any]) -> Iterator[str]:
    """Coefficients with intervals, and scores; of a force map those of the best law."""
    for law in result["fits"][: 1 if result["kind"] == "force_map" else None]:
        yield from _law_lines(law)


def _ranking_lines(fits: Sequence[Mapping[str, Any]], skipped: Mapping[str, str]) -> Iterator[str]:
    held_out = fits[0]["held_out"]
    by = f"held-out {held_out['by']}" if held_out else "AICc, nothing held out"
    yield f"{len(fits)} laws ranked by {by}; errors in N"
    yield "law                       held-out    worst in-sample       AIC  parameters"
    for law in fits:
        scores, held_out = law["scores"], law["held_out"] or {}
        yield (
            f"{law['model']:24s}{_cell(held_out.get('rmse'))}{_cell(held_out.get('worst'))}"
            f"{_cell(scores['rmse'], '.2f')}{_cell(scores['aic'])}{scores['free']:12d}"
        )
    for name, reason in skipped.items():
        yield f"not fitted: {name}: {reason}"


def _law_lines(law: Mapping[str, Any]) -> Iterator[str]:
    part = f", {law['part']} branch" if law["part"] else ""
    yield f"{law['model']}{part}: {law['equation']}"
    for c in law["coefficients"]:
        unit = "" if c["unit"] == "1" else f" {c['unit']}"
        line = f"  {c['name']:18s}{c['value']:13.6g}{unit}"
        if c["held"]:
            line += "  held"
        elif c["interval95"] is not None:
            line += "  [{:.4g}, {:.4g}]".format(*c["interval95"])
        if c["flags"]:
            line += f"  ({', '.join(c['flags']).replace('_', ' ')}"
            line += f" with {', '.join(c['partners'])})" if c["partners"] else ")"
        yield line
    scores, unit = law["scores"], law["unit"]
    text = f"  in-sample {scores['rmse']:.4g} {unit} RMS, MAE {scores['mae']:.4g} {unit}"
    if scores["r2"] is not None:
        text += f", R2 {scores['r2']:.5f}"
    yield f"{text}; {scores['points']} points, {scores['free']} coefficients"
    held_out = law["held_out"]
    if held_out is not None:
        each = ", ".join("none" if e is None else f"{e:.3g}" for e in held_out["group_rmse"])
        total = "none" if held_out["rmse"] is None else f"{held_out['rmse']:.4g} {unit} RMS"
        groups = f"{len(held_out['groups'])} {held_out['by']}s"
        yield f"  held out in turn, {groups}: {total} ({each})"
    if not law["converged"]:
        yield "  the solver ran out of evaluations: do not quote these numbers"
    for note in law["notes"]:
        yield f"  note: {note}"


def _search_lines(searches: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield "search                      cost reached  evaluations  to 0.001 N^2 of the best"
    for run in searches:
        near = run["evaluations_to_tolerance"]
        yield (
            f"{run['method']:26s}{run['value']:14.4g}{run['evaluations']:13d}"
            f"{'never' if near is None else near:>26}"
        )


def _cell(value: float | None, form: str = ".1f") -> str:
    if value is None:
        return f"{'none':>10}"
    return f"{value:10.2g}" if abs(value) >= 1e6 else f"{value:10{form}}"
