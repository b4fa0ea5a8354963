"""``pamsim fit``: a law's coefficients from a measured table, or all laws ranked on it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from pamsim.core.computation import Progress
from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import specs
from pamsim.fitting.branches import branch_section, fit_branches
from pamsim.fitting.force_map import (
    compare_force_laws,
    fit_force_law,
    section_of,
    warnings_about,
)
from pamsim.fitting.maxwell import fit_maxwell, maxwell_section, searches_on
from pamsim.fitting.result import FitResult
from pamsim.fitting.water_cycle import SearchRun
from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.recordings.measured_table import ForceLoops, ForceMap, LengthLoop, read_measured

HOLD_OUT = ("length", "pressure", "none")
_KINDS = {ForceMap: "force_map", LengthLoop: "length_loop", ForceLoops: "force_loops"}
LOOP_MODELS = {"length_loop": "arctangent", "force_loops": "fractional_maxwell"}
# A 20 mm Festo muscle (Nguyen 2024): geometry assumed where the user gives none.
_BRAID = {"nominal_length": 0.3, "diameter": 0.02, "fibre_angle": 0.49916416607}


def fit(
    data: str | os.PathLike[str],
    *,
    model: str | None = None,
    compare: bool = False,
    hold_out: str | None = None,
    held: Mapping[str, float] | None = None,
    nominal_length: float | None = None,
    diameter: float | None = None,
    fibre_angle: float | None = None,
    drop_zeros: bool = True,
    progress: Progress | None = None,
) -> FitResult:
    """Fit a law to a measured table, or all that suit it.

    Args:
        data: CSV of a force map, a length-pressure loop or force-displacement loops
            (`pamsim.recordings.measured_table`).
        model: name of the law; or None with ``compare``.
        compare: fit every law that suits the data and rank them by held-out error; for
            force-displacement loops, compare three searches of the one model instead.
        hold_out: ``length``, ``pressure`` or ``none``; None for what suits the data: ``length`` for
            a force map, the harder test, ``pressure`` for a length loop.
        held: coefficients to hold instead of fitting [SI].
        nominal_length: l0 [m]; needed where the table gives lengths only.
        diameter: of the braid at l0, for laws that use it [m].
        fibre_angle: of the braid at l0 [rad].
        drop_zeros: drop points of zero force from a map: slack or not measured.
        progress: called before each law of a comparison.

    Returns:
        The fits, best first.

    Raises:
        InputError: for a table that cannot be read, arguments that do not fit it or each other, an
            unknown law, or data that do not determine it.
    """
    if (model is None) == (not compare):
        raise InputError("give `model`, one of `pamsim list models`, or `compare` for all of them")
    if hold_out is not None and hold_out not in HOLD_OUT:
        raise InputError(f"`hold_out` {hold_out!r} is not known; {nearest(hold_out, HOLD_OUT)}")
    if model is not None and model not in FORCE_LAWS and model not in LOOP_MODELS.values():
        known = [*FORCE_LAWS, *LOOP_MODELS.values()]
        raise InputError(f"no model {model!r} that can be fitted; {nearest(model, known)}")
    file = Path(data)
    table = read_measured(file, nominal_length)
    held, kind = held or {}, _KINDS[type(table)]
    suits = [LOOP_MODELS[kind]] if kind in LOOP_MODELS else [*FORCE_LAWS]
    if model is not None and model not in suits:
        use = repr(suits[0]) if kind in LOOP_MODELS else f"one of {', '.join(suits)}"
        raise InputError(
            f"{file} ({kind.replace('_', ' ')}): model {model!r} does not describe it; use {use}"
        )
    if isinstance(table, ForceMap):
        if drop_zeros:
            table = table.without_zeros()
        given = {
            "nominal_length": table.nominal_length,
            "diameter": diameter,
            "fibre_angle": fibre_angle,
        }
        return _force_map(file, table, model, given, hold_out or "length", held, progress)
    searches: tuple[SearchRun, ...] = ()
    if isinstance(table, LengthLoop):
        fits = fit_branches(table, held=held, hold_out=hold_out or "pressure")
        section = branch_section(fits, table, nominal_length)
    elif hold_out not in (None, "none"):
        raise InputError(
            f"`hold_out` {hold_out}: of force-displacement loops nothing can be held out; leave"
            " `hold_out` out"
        )
    else:
        element, loops = fit_maxwell(table, held=held)
        searches = searches_on(loops) if compare else ()
        fits, section = (element,), maxwell_section(element, nominal_length)
    return FitResult(
        file=str(file),
        kind=kind,
        notes=table.notes,
        fits=fits,
        searches=searches,
        section=section,
    )


def _force_map(
    file: Path,
    table: ForceMap,
    model: str | None,
    given: Mapping[str, float | None],
    hold_out: str,
    held: Mapping[str, float],
    progress: Progress | None,
) -> FitResult:
    braid = Braid(**{name: _BRAID[name] if v is None else v for name, v in given.items()})
    source = {n: "assumed" if value is None else "given to the fit" for n, value in given.items()}
    skipped: dict[str, str] = {}
    warnings: list[str] = []
    if model is None:
        laws, skipped = compare_force_laws(
            table, braid, held=held, hold_out=hold_out, progress=progress
        )
        warnings = warnings_about(table, braid, laws, held=held)
    else:
        laws = [fit_force_law(table, model, braid, held=held, hold_out=hold_out)]
    notes = list(table.notes)
    used = {name for law in laws for name in law.given}
    assumed = [name for name in given if given[name] is None and name in used]
    if assumed:
        names, options = ", ".join(assumed).replace("_", " "), "`, `".join(assumed)
        notes.append(
            f"{names} assumed as of a DMSP-20-300 (300 mm, 20 mm, 28.6 deg); give your own as"
            f" `{options}`"
        )
    return FitResult(
        file=str(file),
        kind="force_map",
        compared=model is None,
        notes=tuple(notes),
        warnings=tuple(warnings),
        fits=tuple(laws),
        skipped=skipped,
        section=section_of(laws[0], braid, source),
    )


def coefficient_unit(model: str | None, name: str) -> str:
    """SI unit of a coefficient of a model, ``1`` if it has none or there is no such coefficient."""
    if model is not None and model in FORCE_LAWS:
        fields = dict(specs(FORCE_LAWS[model].group))
        return fields[name].unit if name in fields else "1"
    if model == LOOP_MODELS["length_loop"]:
        return {"k0": "m", "k1": "1/Pa", "k3": "m"}.get(name, "1")
    return "1"
