"""The result of ``fit``: fitted laws, their ranking, and a section of a rig with the numbers."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pamsim.core.encoding import INLINE, fields_to_dict, to_dict, write_json
from pamsim.core.files import complete_file
from pamsim.core.units import FloatArray
from pamsim.fitting.curve_fit import CurveFit
from pamsim.fitting.scores import HeldOut
from pamsim.fitting.water_cycle import SearchRun
from pamsim.inference.estimate import Estimate, Flag

SCHEMA = "pamsim-fit/2"

_FLAG_TEXT = {
    Flag.DEAD: "the data do not depend on it",
    Flag.FLAT_DIRECTION: "the data determine only a combination with",
    Flag.AT_BOUND: "at the end of its allowed range, not determined by the data",
    Flag.TRADE_OFF: "trades off with",
    Flag.NOT_PINNED: "95 % interval wider than the value itself",
}
_WHOLE_FORCE = (
    "# The law is the whole measured force. So that the rubber does not count twice, set these of",
    "# the rig to 0: passive.stiffness, passive.parallel, threshold.pressure, end_shape.loss.",
)
_WITH_PARTNERS = (Flag.TRADE_OFF, Flag.FLAT_DIRECTION)


@dataclass(frozen=True, kw_only=True)
class FittedLaw:
    """One law fitted to one set of points."""

    model: str  # name of the law
    part: str = ""  # ``rising`` or ``falling`` branch; empty for all points
    title: str  # of the law, for people
    equation: str  # in plain text
    source: str  # paper and equation
    unit: str  # of the measured quantity [SI]
    # The points, what was measured and what is predicted there, each shape (n,)
    points: Mapping[str, FloatArray]
    fit: CurveFit = field(metadata=INLINE)  # coefficients, scores
    held_out: HeldOut | None = None  # errors at held-out points, or None
    notes: tuple[str, ...] = ()  # what a reader must know before using the numbers
    # Geometry the law was evaluated with, name -> value and unit [SI]
    given: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class FitResult:
    """Laws fitted to a measured table.

    Attributes:
        file: the table.
        kind: ``force_map``, ``length_loop`` or ``force_loops``.
        compared: whether the laws were ranked.
        notes: what was assumed.
        warnings: where the best of the ranked laws does not generalise.
        fits: best first.
        skipped: law -> why it does not suit the data.
        searches: on the cost of force-displacement loops.
        section: rig section -> key -> word or number, ready for ``params.toml``.
    """

    file: str
    kind: str
    compared: bool = False
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    fits: tuple[FittedLaw, ...]
    skipped: Mapping[str, str] = field(default_factory=dict)
    searches: tuple[SearchRun, ...] = ()
    section: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def summary(self) -> str:
        """The ranking, if there is one, and every coefficient: some lines of text."""
        result = self.to_dict()
        warnings = (f"warning: {warning}" for warning in self.warnings)
        return "\n".join([*detail_lines(result), *warnings, *answer_lines(result)])

    def to_dict(self) -> dict[str, Any]:
        """JSON-safe form, SI."""
        return to_dict({"schema": SCHEMA, **fields_to_dict(self)})

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``fit.json`` and ``params.toml`` into a folder; the files written.

        The folder is created if need be, and files of the same names are replaced; raises as
        `save_parameters`.
        """
        result = Path(folder) / "fit.json"
        write_json(result, self.to_dict())
        return [result, self.save_parameters(folder)]

    def save_parameters(self, folder: str | Path) -> Path:
        """Write ``params.toml``, the section of a rig, into a folder.

        Raises:
            InputError: if the place cannot be written.
        """
        path = Path(folder) / "params.toml"
        with complete_file(path) as part:
            part.write_text(_params_text(self.to_dict()), encoding="utf-8")
        return path


def coefficient_entries(coefficients: Sequence[Estimate]) -> dict[str, dict[str, Any]]:
    """The coefficients of a fit as entries of ``params.toml`` [SI].

    A held coefficient is ``assumed``, a fitted one ``identified`` with its interval, or with a note
    why there is none.
    """
    entries: dict[str, dict[str, Any]] = {}
    for c in coefficients:
        entry: dict[str, Any] = {"value": c.value, "unit": c.unit}
        entry["source"] = "assumed" if c.held else "identified"
        if c.interval95 is not None:
            entry["interval95"] = list(c.interval95)
        if c.held:
            entry["note"] = "held in the fit"
        elif c.flags:
            entry["note"] = _flag_text(c.flags, c.partners)
        entries[c.name] = entry
    return entries


def _flag_text(flags: Sequence[Flag], partners: Sequence[str]) -> str:
    """Flags as one line, such as ``trades off with c2``."""
    names = ", ".join(partners)
    return "; ".join(
        f"{_FLAG_TEXT[flag]} {names}" if flag in _WITH_PARTNERS else _FLAG_TEXT[flag]
        for flag in flags
    )


def _params_text(result: Mapping[str, Any]) -> str:
    """The sections of a fit's written result as TOML: value, unit, source, interval [SI]."""
    best = result["fits"][0]
    scores = best["scores"]
    lines = [
        f"# {best['model']} fitted to {Path(result['file']).name}: {scores['points']} points,"
        f" {scores['rmse']:.4g} {best['unit']} RMS. Paste the sections into a rig's params.toml."
    ]
    # The template of a bellows has no rubber but the wall, which its law includes.
    if result["kind"] == "force_map" and best["model"] != "effective_area":
        lines += _WHOLE_FORCE
    for name, entries in result["section"].items():
        lines += ["", f"[{name}]"]
        lines += [f"{key} = {_value(entry)}" for key, entry in entries.items()]
    return "\n".join(lines) + "\n"


def _value(entry: Any) -> str:
    """A TOML value; texts and floats are written the same in JSON and TOML."""
    if isinstance(entry, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(value)}" for key, value in entry.items()) + " }"
    return json.dumps(entry, ensure_ascii=False, allow_nan=False)


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
    yield "law                       held-out    worst in-sample      AICc  parameters"
    for law in fits:
        scores, held_out = law["scores"], law["held_out"] or {}
        yield (
            f"{law['model']:24s}{_cell(held_out.get('rmse'))}{_cell(held_out.get('worst'))}"
            f"{_cell(scores['rmse'], '.2f')}{_cell(scores['aicc'])}{scores['free']:12d}"
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
