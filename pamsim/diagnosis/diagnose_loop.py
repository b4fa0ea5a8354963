"""``pamsim diagnose`` of a length-pressure loop: is a reversible law enough, and what opens it."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import PA_PER_KPA
from pamsim.diagnosis.loop_report import LoopReport
from pamsim.diagnosis.method.loop_diagnosis import diagnose_loop
from pamsim.diagnosis.method.loop_effects import CANDIDATES
from pamsim.diagnosis.method.loop_model import Loop
from pamsim.signals.static_law import arctangent_law
from pamsim.store.measured_table import LengthLoop
from pamsim.store.printed import BRANCHES, loop_equation, loop_rows

FloatArray = NDArray[np.float64]

RUNS = 3
"""Runs behind each printed mean (Alraouf 2025)."""

_M_PER_CM = 1e-2

ALRAOUF_2025_FORMS = {
    "means": "the printed means of three runs (Alraouf 2025, Table 2), with their standard errors",
    "branches": "the printed branch equations (Alraouf 2025, (3) and (4)) at the pressures of"
    " Table 2: a stand-in for readings that are not printed, without their noise",
}
"""Forms in which Alraouf 2025 gives its loop."""


def alraouf2025_loop(form: str) -> Loop:
    """The length-pressure loop of Alraouf 2025.

    Args:
        form: ``means`` or ``branches``, see `ALRAOUF_2025_FORMS`.

    Returns:
        Pressures [Pa] and lengths [m], up and down again.

    Raises:
        InputError: for another form.
    """
    if form not in ALRAOUF_2025_FORMS:
        raise InputError(
            f"no form {form!r} of the loop of Alraouf 2025; {nearest(form, ALRAOUF_2025_FORMS)}"
        )
    rows = {branch: loop_rows(branch) for branch in BRANCHES}
    if form == "means":
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
        error = None
    up, down = (np.array([row.pressure_kpa for row in rows[b]]) * PA_PER_KPA for b in BRANCHES)
    return Loop(
        input=_there_and_back(up, down),
        output=_there_and_back(lengths["up"], lengths["down"]) * _M_PER_CM,
        rising=np.arange(up.size + down.size) < up.size,
        error=error,
    )


def table_loop(table: LengthLoop) -> Loop:
    """A measured length-pressure loop, its rows in the order in which they were taken."""
    return Loop(input=table.pressure, output=table.length, rising=table.rising)


def diagnose_length_loop(
    loop: Loop, source: str, *, at_rest: bool = True, seed: int = 0
) -> LoopReport:
    """Diagnose a length-pressure loop.

    Args:
        loop: readings, see `alraouf2025_loop` and `table_loop`.
        source: what they are, in words.
        at_rest: whether every reading was taken at rest, so that nothing viscous is left in it.
        seed: of exchanges and sign flips.

    Raises:
        InputError: if fewer than five pressures were read on both branches.
    """
    began = time.perf_counter()
    tried = [c for c in CANDIDATES if not (at_rest and c.moving)]
    found = diagnose_loop(loop, tried, seed=seed)
    notes = ["one loop at one rate does not tell hysteresis from creep"]
    if at_rest:
        notes.append("readings are taken as at rest, so that viscous friction is not tried")
    if loop.error is None:
        notes.append("the readings' errors are not known: no noise floor")
    return LoopReport(
        source=source,
        loop=loop,
        found=found,
        notes=tuple(notes),
        seed=seed,
        seconds=time.perf_counter() - began,
    )


def _there_and_back(up: FloatArray, down: FloatArray) -> FloatArray:
    return np.concatenate([up, down[::-1]])
