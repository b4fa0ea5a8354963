"""Fit force laws to a measured force map, and rank them by their error at held-out points."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pamsim.core.computation import Progress
from pamsim.core.digits import p_in_words
from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import specs
from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.fitting.coefficients import Coefficient, Curve, held_coefficients
from pamsim.fitting.curve_fit import (
    CurveFit,
    difference_columns,
    fit_curve,
    held_out_in_turn,
)
from pamsim.fitting.result import FittedLaw, coefficient_entries
from pamsim.fitting.scores import HeldOut, Rows, grouped
from pamsim.inference.projection import orthonormal, project_out
from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.recordings.measured_table import ForceMap

_GROWTH = 3.0
"""Held-out error over that of the fitted points from which a law does not generalise."""

_NO_TENSION = {
    "elastic_energy": "counts from a working point: it gives no tension that a force map could show"
}
_PRESSURES, _CONTRACTIONS = np.linspace(1e5, 6e5, 5), np.linspace(0.05, 0.2, 6)
"""Where muscles usually work [Pa, -]."""

_TINY = 1e-9  # an open lower bound, as a share of the range
_REDUNDANT = 1e-5  # of an effect: what others leave of it is the error of differences
_DIRECTION = 1e-10  # singular value over the largest, from which effects have a direction


def fit_force_law(
    table: ForceMap,
    model: str,
    braid: Braid,
    *,
    held: Mapping[str, float],
    hold_out: str,
) -> FittedLaw:
    """Fit one force law to a force map, some of its coefficients held [SI].

    ``hold_out`` is ``pressure``, ``length`` or ``none``: what is held out in turn. The braid's
    geometry is for laws that use it.

    Raises:
        InputError: for an unknown law or coefficient, a value out of range, too few points, or a
            law that does not suit the map.
    """
    law = named_law(model)
    unsuited = unsuitable(law, table)
    if unsuited:
        raise InputError(f"model {model!r}: {unsuited}")
    coefficients = law_coefficients(law, braid, held)
    every = np.arange(table.force.size)
    groups = {"length": grouped(table.contraction), "pressure": grouped(table.pressure)}
    fit = fit_curve(law_curve(law, table, braid, every), table.force, coefficients, groups=groups)
    held_out = None if hold_out == "none" else _held_out(table, law, braid, coefficients, hold_out)
    return FittedLaw(
        model=model,
        title=law.title,
        equation=law.equation,
        source=law.source,
        unit="N",
        points={
            "pressure": table.pressure,
            "contraction": table.contraction,
            "measured": table.force,
            "predicted": fit.predicted,
        },
        fit=fit,
        held_out=held_out,
        notes=tuple(_notes(law, table, braid, fit)),
        given={
            name: {"value": getattr(braid, name), "unit": spec.unit}
            for name, spec in specs(Braid)
            if name in law.braid_fields
        },
    )


def _held_out(
    table: ForceMap, law: ForceLaw, braid: Braid, coefficients: Sequence[Coefficient], by: str
) -> HeldOut:
    """Errors of a law at each pressure or length, fitted to all others."""
    groups = grouped(table.pressure if by == "pressure" else table.contraction)

    def over(rows: Rows) -> Curve:
        return law_curve(law, table, braid, rows)

    return held_out_in_turn(over, table.force, coefficients, groups, by=by)


def compare_force_laws(
    table: ForceMap,
    braid: Braid,
    *,
    held: Mapping[str, float],
    hold_out: str,
    progress: Progress | None = None,
) -> tuple[list[FittedLaw], dict[str, str]]:
    """Fit every force law that suits a map, best first, and why the others were not fitted.

    Arguments are those of `fit_force_law`; coefficients are held in the laws that have them. What
    is held out ranks the laws; with ``none`` AICc does. ``progress`` is called before each law.

    Raises:
        InputError: for a coefficient that no law has, or if no law can be fitted.
    """
    known = {name for law in FORCE_LAWS.values() for name, _ in specs(law.group)}
    for name in held:
        if name not in known:
            raise InputError(f"no force law has a coefficient {name!r}; {nearest(name, known)}")
    fits: list[FittedLaw] = []
    skipped: dict[str, str] = {}
    for i, (name, law) in enumerate(FORCE_LAWS.items()):
        if progress is not None:
            progress(i, len(FORCE_LAWS), name)
        try:
            fits.append(fit_force_law(table, name, braid, held=_own(law, held), hold_out=hold_out))
        except InputError as error:
            skipped[name] = str(error).removeprefix(f"model {name!r}: ")
    if not fits:
        raise InputError(f"no force law can be fitted: {next(iter(skipped.values()))}")
    return sorted(fits, key=_rank), skipped


def warnings_about(
    table: ForceMap, braid: Braid, laws: Sequence[FittedLaw], *, held: Mapping[str, float]
) -> list[str]:
    """Where the first of the laws of `compare_force_laws` does not generalise.

    There is a warning for held-out lengths, and one for held-out pressures, if a law with fewer
    coefficients predicts them as well or better, or the error there is several times that of the
    fitted points.
    """

    def error(fitted: FittedLaw, by: str) -> float:
        if fitted.held_out is not None and fitted.held_out.by == by:
            return fitted.held_out.rmse
        law = named_law(fitted.model)
        coefficients = law_coefficients(law, braid, _own(law, held))
        return _held_out(table, law, braid, coefficients, by).rmse

    warnings: list[str] = []
    first, *others = laws
    scores = first.fit.scores
    for by in ("length", "pressure"):
        try:
            own = error(first, by)
        except InputError:  # the map has one length, or one pressure
            continue
        worst = math.inf if math.isnan(own) else own
        simpler = {o.model: error(o, by) for o in others if o.fit.scores.free < scores.free}
        better = {model: rmse for model, rmse in simpler.items() if rmse <= worst}
        least = min(better, key=lambda model: better[model], default=None)
        if least is not None:
            other = f"{least}, with fewer coefficients, by {better[least]:.3g} N"
        elif not own <= _GROWTH * scores.rmse:
            other = f"at fitted ones by {scores.rmse:.3g} N"
        else:
            continue
        misses = "predicts nothing" if math.isnan(own) else f"misses by {own:.3g} N"
        warnings.append(
            f"{first.model} does not generalise to other {by}s: at held-out {by}s it {misses},"
            f" {other}"
        )
    return warnings


def _own(law: ForceLaw, held: Mapping[str, float]) -> dict[str, float]:
    """Of the coefficients that are held, those that a law has."""
    return {name: held[name] for name, _ in specs(law.group) if name in held}


def section_of(
    fitted: FittedLaw, braid: Braid, braid_source: Mapping[str, str]
) -> dict[str, dict[str, Any]]:
    """The fitted law as sections of a rig's ``params.toml``.

    Of the braid that it was made with, those fields are written of which a source is given; others
    are at their default.
    """
    sections: dict[str, dict[str, Any]] = {}
    if fitted.given:
        sections["muscle.braid"] = {
            name: {"value": getattr(braid, name), "unit": spec.unit, "source": braid_source[name]}
            for name, spec in specs(Braid)
            if name in braid_source
        }
    sections["muscle.force"] = {"law": fitted.model, **coefficient_entries(fitted.fit.coefficients)}
    return sections


def _notes(law: ForceLaw, table: ForceMap, braid: Braid, fit: CurveFit) -> list[str]:
    low, high = law.contraction_range(fit.values.tolist(), braid)
    ranges = [("contractions", table.contraction, low, high, f"{low:.0%} to {high:.0%}")]
    if law.pressure_range is not None:
        least, most = law.pressure_range
        shown = f"{least / PA_PER_KPA:.0f} to {most / PA_PER_KPA:.0f} kPa"
        ranges.append(("pressures", table.pressure, least, most, shown))
    notes: list[str] = []
    for what, values, least, most, shown in ranges:
        outside = int(np.sum((values < least) | (values > most)))
        if outside:
            notes.append(
                f"{outside} of {values.size} points lie outside the {what} its source states,"
                f" {shown}"
            )
    notes += [
        f"points of one {group} share an error, of the law or of a reading"
        f" ({p_in_words(p_value)}): the intervals allow for it"
        for group, p_value in fit.shared.items()
    ]
    return notes


def _rank(fitted: FittedLaw) -> tuple[bool, float]:
    if fitted.held_out is not None:
        return math.isnan(fitted.held_out.rmse), fitted.held_out.rmse
    scores = fitted.fit.scores
    if scores.aicc is not None:
        return False, scores.aicc
    # A perfect match comes first, nearly as many coefficients as points last.
    return False, -math.inf if scores.aic is None else math.inf


def named_law(model: str) -> ForceLaw:
    """The force law of a name; InputError with the nearest if there is none."""
    if model not in FORCE_LAWS:
        raise InputError(f"no force law {model!r}; {nearest(model, FORCE_LAWS)}")
    return FORCE_LAWS[model]


def unsuitable(law: ForceLaw, table: ForceMap) -> str:
    """Why a law cannot describe a map; empty if it can."""
    if law.name in _NO_TENSION:
        return _NO_TENSION[law.name]
    pushed = bool(np.sum(table.force) < 0.0)
    if law.pushes and not pushed:
        return "pushes, and the forces of the map pull: state a push as negative"
    if pushed and not law.pushes:
        return "pulls, and the forces of the map push: state a pull as positive"
    if law.pressure_range is None and np.ptp(table.pressure) > 0.01 * np.max(table.pressure):
        return "holds at one pressure, the map has several"
    return ""


def law_coefficients(
    law: ForceLaw, braid: Braid, held: Mapping[str, float]
) -> tuple[Coefficient, ...]:
    """Ranges, neutral and held values of the coefficients of a law.

    The scale is held at 1 where other coefficients have the same effect: it is redundant there.

    Raises:
        InputError: for a held name that the law does not have, or a held value out of range.
    """
    every = tuple(
        Coefficient(
            name=name,
            unit=spec.unit,
            low=spec.low + _TINY * (spec.high - spec.low) if spec.low_open else spec.low,
            high=spec.high,
            default=spec.default,
        )
        for name, spec in specs(law.group)
    )
    first, *others = held_coefficients(every, held)
    if "scale" not in held and _scale_is_redundant(law, braid, every):
        first = replace(first, held=1.0)
    return (first, *others)


def law_curve(law: ForceLaw, table: ForceMap, braid: Braid, rows: Rows) -> Curve:
    """The force at some points (m,) of a map as a function of the law's coefficients.

    It takes all coefficients (k,) [SI] and gives forces (m,) [N]; NaN where the law has none.
    """
    points = list(zip(table.pressure[rows].tolist(), table.contraction[rows].tolist(), strict=True))
    geometry = [float(getattr(braid, name)) for name in law.braid_fields]

    def force(pressure: float, contraction: float, numbers: list[float]) -> float:
        # As ForceLaw.force, but without reading the braid again at each of a million points.
        try:
            return numbers[0] * law.force_function(pressure, contraction, *numbers[1:])
        except (OverflowError, ZeroDivisionError, ValueError):
            return math.nan  # scalar laws raise where arrays would give inf or NaN

    def curve(values: FloatArray) -> FloatArray:
        numbers = [*values.tolist(), *geometry]
        return np.array([force(p, k, numbers) for p, k in points])

    return curve


def _scale_is_redundant(law: ForceLaw, braid: Braid, coefficients: Sequence[Coefficient]) -> bool:
    """Whether the scale's sensitivity lies in the span of the others'.

    Checked on a grid of its own, since the redundancy is the law's, not the data's.
    """
    if coefficients[0].name != "scale" or len(coefficients) == 1:
        return False
    pressure, contraction = (x.ravel() for x in np.meshgrid(_PRESSURES, _CONTRACTIONS))
    grid = ForceMap(
        pressure=pressure, contraction=contraction, force=0.0 * pressure, nominal_length=None
    )
    curve = law_curve(law, grid, braid, np.arange(pressure.size))
    rng = np.random.default_rng(3)
    for _ in range(5):
        place = np.array([c.low + rng.uniform(0.3, 0.7) * (c.high - c.low) for c in coefficients])
        place[0] = 1.0
        matrix = difference_columns(curve, place, coefficients)
        if np.all(np.isfinite(matrix)) and np.any(matrix[:, 0]):
            own, basis = matrix[:, 0], orthonormal(matrix[:, 1:], _DIRECTION)
            rest = project_out(basis, own)
            return bool(np.linalg.norm(rest) < _REDUNDANT * np.linalg.norm(own))
    return False
