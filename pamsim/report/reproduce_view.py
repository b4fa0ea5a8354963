"""What the reproduction page shows, in words and finished numbers; the template only places it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pamsim.report.numbers import fixed, interval, plain, significant, words
from pamsim.report.reproduce_rows import OperatingPoint, distinct

# Upper ends of the tints of the error column [deg]; beyond the last one is the strongest tint.
TINT_STEPS_DEG = (0.5, 1.0, 2.0, 4.0)
_LOWERED = str.maketrans("12", "₁₂")


@dataclass(frozen=True)
class RowView:
    """One line of the table of operating points; ``tint`` counts the steps the error exceeds."""

    point: OperatingPoint
    p1: str
    p2: str
    load: str
    measured: str
    simulated: str
    error: str
    tint: int | None
    settling: str
    overshoot: str
    monotonic: str
    marks: list[int]


@dataclass(frozen=True)
class RowGroup:
    """Consecutive lines of one printed table and one size of step."""

    title: str
    rows: list[RowView]


@dataclass(frozen=True)
class ModelView:
    """One line of the table of models: an estimator and its numbers."""

    model: str
    estimator: str
    gain: str
    constants: list[tuple[str, str, str]]
    fit: str
    remark: str
    printed: bool = False


def dig(data: Any, *keys: str) -> Any:
    """Follow keys into nested mappings; None where the way ends."""
    for key in keys:
        if not isinstance(data, Mapping):
            return None
        data = data.get(key)
    return data


def verdict(result: Mapping[str, Any], points: Sequence[OperatingPoint]) -> str:
    """Say in one sentence how close the simulation comes, in numbers.

    Args:
        result: of schema ``pamsim-reproduce/1``.
        points: all its rows.

    Returns:
        A sentence without judging words: the reader judges.
    """
    single = distinct(points)
    done = sum(point.completed for point in single)
    count = str(done) if done == len(single) else f"{done} of {len(single)}"
    text = f"{count} distinct operating points reproduced with {fixed(result.get('rms_deg'), 1)}"
    text += " deg RMS"
    worst = dig(result, "worst", "row")
    if worst is not None:
        text += f" (worst: row {worst}, {fixed(dig(result, 'worst', 'error_deg'), 1)} deg)"
    parts = [text]
    for model, names in (("g1", ("T",)), ("g2", ("T1", "T2"))):
        ours = [dig(result, model, f"{name}_s") for name in names]
        printed = [dig(result, "paper", model, f"{name}_s") for name in names]
        if None in ours or None in printed:
            continue
        equal = ", ".join(
            f"{name.translate(_LOWERED)} = {significant(value, 3)} s"
            for name, value in zip(names, ours, strict=True)
        )
        against = " and ".join(f"{significant(value, 3)} s" for value in printed)
        method = words(dig(result, model, "method")) or "method not given"
        parts.append(
            f"{model.upper().translate(_LOWERED)}: {equal} ({method}) against {against} printed"
        )
    return "; ".join(parts) + "."


def row_views(points: Sequence[OperatingPoint]) -> tuple[list[RowGroup], list[str]]:
    """Prepare the table of operating points.

    Args:
        points: all rows.

    Returns:
        The lines under their headings, and the footnotes that their ``marks`` count from 1.
    """
    notes: list[str] = []
    groups: list[RowGroup] = []
    for point in points:
        marks: list[int] = []
        for text in _row_notes(point):
            notes.append(f"Row {point.row}: {text}")
            marks.append(len(notes))
        tint = None
        if point.error_deg is not None:
            tint = sum(abs(point.error_deg) >= step for step in TINT_STEPS_DEG)
        title = f"Table {point.table}, {point.size} steps"
        if not groups or groups[-1].title != title:
            groups.append(RowGroup(title, []))
        groups[-1].rows.append(
            RowView(
                point=point,
                p1=plain(point.p1_kpa),
                p2=plain(point.p2_kpa),
                load=plain(point.load_kg),
                measured=fixed(point.measured_deg, 2),
                simulated=fixed(point.simulated_deg, 2),
                error=fixed(point.error_deg, 2),
                tint=tint,
                settling=fixed(point.settling_s, 2),
                overshoot=fixed(point.overshoot_percent, 1),
                monotonic=plain(point.monotonic),
                marks=marks,
            )
        )
    return groups, notes


def _row_notes(point: OperatingPoint) -> Iterator[str]:
    if point.repeats is not None:
        text = point.slip or f"repeats row {point.repeats}"
        yield f"{text}; counted once in the RMS."
    elif point.slip:
        yield f"{point.slip}."
    if not point.completed:
        yield f"the run ended early ({words(point.outcome)}): {point.message}"


def model_views(result: Mapping[str, Any]) -> list[ModelView]:
    """Prepare the table of models: per model our estimators, then the printed one.

    Args:
        result: of schema ``pamsim-reproduce/1``; an estimator without real time constants has
            nulls and is shown with its status.

    Returns:
        The lines in the order of the table.
    """
    views: list[ModelView] = []
    for model, names in (("g1", ("T",)), ("g2", ("T1", "T2"))):
        estimates = [
            ("method not given", dig(result, model)),
            ("ARX, unit gain", dig(result, model, "arx", "unit_gain")),
            ("ARX, free gain", dig(result, model, "arx", "free_gain")),
        ]
        for fallback, data in estimates:
            if not isinstance(data, Mapping):
                continue
            constants = [
                (
                    name,
                    significant(data.get(f"{name}_s"), 4),
                    interval(data.get(f"interval95_{name}_s"), 4),
                )
                for name in names
            ]
            views.append(
                ModelView(
                    model=model.upper(),
                    estimator=words(data.get("method")) or fallback,
                    gain=significant(data.get("K"), 4),
                    constants=constants,
                    fit=fixed(data.get("fit_percent"), 2),
                    remark=str(data.get("sentence") or words(data.get("status"))),
                )
            )
        printed = dig(result, "paper", model)
        if isinstance(printed, Mapping):
            constants = [(name, plain(printed.get(f"{name}_s")), "") for name in names]
            views.append(
                ModelView(
                    model=model.upper(),
                    estimator="paper, discrete least squares (eqs. 25–29)",
                    gain=plain(printed.get("K", 1)),
                    constants=constants,
                    fit="–",
                    remark="as printed; the gain is normalised to 1",
                    printed=True,
                )
            )
    return views


def failing(result: Mapping[str, Any]) -> int:
    """Number of checks that do not hold."""
    return sum(not check.get("ok") for check in result.get("checks") or ())
