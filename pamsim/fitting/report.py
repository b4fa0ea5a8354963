"""What a fit hands back: fitted curves, ranking, searches, and a rig section with the numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.fitting.curve_fit import CurveFit
from pamsim.fitting.held_out import HeldOut
from pamsim.fitting.search_comparison import SearchRun
from pamsim.inference.estimate import Flag

FloatArray = NDArray[np.float64]
SCHEMA = "pamsim-fit/1"

_FLAG_TEXT = {
    Flag.DEAD: "the data do not depend on it",
    Flag.FLAT_DIRECTION: "the data do not tell it from",
    Flag.AT_BOUND: "at the end of its allowed range, which the data did not decide",
    Flag.TRADE_OFF: "trades off with",
    Flag.NOT_PINNED: "95 % interval wider than the value itself",
}


@dataclass(frozen=True, kw_only=True)
class FittedCurve:
    """One law fitted to one set of points.

    Attributes:
        model: name of the law.
        part: ``rising`` or ``falling`` branch; empty for all points.
        title: of the law, for people.
        equation: in plain text.
        source: paper and equation.
        unit: of the measured quantity [SI].
        points: what the points are and what is predicted there, each shape (n,).
        fit: coefficients, scores.
        held_out: errors at held-out points, or None.
        notes: what a reader must know before relying on the numbers.
        given: geometry the law was evaluated with, name -> (value, unit) [SI].
    """

    model: str
    part: str
    title: str
    equation: str
    source: str
    unit: str
    points: Mapping[str, FloatArray]
    fit: CurveFit
    held_out: HeldOut | None
    notes: tuple[str, ...] = ()
    given: Mapping[str, tuple[float, str]] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe form, SI."""
        return {
            "model": self.model,
            "part": self.part,
            "title": self.title,
            "equation": self.equation,
            "source": self.source,
            "unit": self.unit,
            "coefficients": [c.as_dict() for c in self.fit.coefficients],
            "given": {name: {"value": v, "unit": u} for name, (v, u) in self.given.items()},
            "scores": self.fit.scores.as_dict(),
            "held_out": None if self.held_out is None else self.held_out.as_dict(),
            "converged": self.fit.converged,
            "evaluations": self.fit.evaluations,
            "notes": list(self.notes),
            "points": {name: values.tolist() for name, values in self.points.items()},
            "held_out_residual": None
            if self.held_out is None
            else [float(r) if np.isfinite(r) else None for r in self.held_out.residual],
        }


@dataclass(frozen=True, kw_only=True)
class FitReport:
    """The result of ``pamsim fit``.

    Attributes:
        file: what was fitted.
        kind: ``force_map``, ``length_loop`` or ``force_loops``.
        notes: what was taken for granted.
        fits: best first.
        skipped: law -> why it does not suit the data.
        searches: of the cost of force-displacement loops.
        section: rig section -> key -> word or number, ready for ``params.toml``.
    """

    file: str
    kind: str
    notes: tuple[str, ...]
    fits: tuple[FittedCurve, ...]
    skipped: Mapping[str, str] = field(default_factory=dict)
    searches: tuple[SearchRun, ...] = ()
    section: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe form, SI."""
        return {
            "schema": SCHEMA,
            "file": self.file,
            "kind": self.kind,
            "notes": list(self.notes),
            "fits": [fitted.as_dict() for fitted in self.fits],
            "skipped": dict(self.skipped),
            "searches": [run.as_dict() for run in self.searches],
            "section": {key: dict(entries) for key, entries in self.section.items()},
        }


def coefficient_entries(fitted: FittedCurve) -> dict[str, dict[str, Any]]:
    """The coefficients of a fit as entries of a rig's ``params.toml`` [SI].

    A held coefficient is ``assumed``, a fitted one ``identified`` with its interval, or with a note
    why there is none.
    """
    entries: dict[str, dict[str, Any]] = {}
    for c in fitted.fit.coefficients:
        entry: dict[str, Any] = {"value": c.value, "unit": c.unit}
        entry["source"] = "assumed" if c.held else "identified"
        if c.interval95 is not None:
            entry["interval95"] = list(c.interval95)
        if c.held:
            entry["note"] = "held in the fit"
        elif c.flags:
            entry["note"] = flag_text(c.flags, c.partners)
        entries[c.name] = entry
    return entries


def flag_text(flags: tuple[Flag, ...], partners: tuple[str, ...]) -> str:
    """Flags as one line, such as ``trades off with c2``."""
    others = ", ".join(partners)
    return "; ".join(
        f"{_FLAG_TEXT[d]} {others}" if d in (Flag.TRADE_OFF, Flag.FLAT_DIRECTION) else _FLAG_TEXT[d]
        for d in flags
    )
