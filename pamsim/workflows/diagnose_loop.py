"""``pamsim diagnose`` of a length-pressure loop: is a reversible law enough, and what opens it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import PA_PER_KPA
from pamsim.diagnosis.loop_diagnosis import LoopDiagnosis, diagnose_loop
from pamsim.diagnosis.loop_effects import CANDIDATES
from pamsim.diagnosis.loop_fit import Loop, LoopModel
from pamsim.diagnosis.row_evidence import rms_interval95
from pamsim.diagnosis.verdict import Verdict
from pamsim.signals.static_law import arctangent_law
from pamsim.store.measured_table import LengthLoop
from pamsim.store.printed_loop import BRANCHES, loop_equation, loop_rows

FloatArray = NDArray[np.float64]

SCHEMA = "pamsim-diagnosis/1"
CHANNEL = "length"
RUNS = 3
"""Runs behind each printed mean (seed 000)."""

_MM_PER_M = 1e3
_M_PER_CM = 1e-2

PAPER_B = {
    "means": "the printed means of three runs (seed 000, Table 2), with their standard errors",
    "branches": "the printed branch equations (seed 000, (3) and (4)) at the pressures of Table 2:"
    " a stand-in for readings that are not printed, without their noise",
}
"""Forms in which seed 000 gives its loop."""


@dataclass(frozen=True, kw_only=True)
class LoopReport:
    """A diagnosis of a loop with what it was made from.

    Attributes:
        source: what the readings are, in words.
        loop: the readings.
        found: the diagnosis.
        notes: what a reader should know, one sentence each.
        seed: of exchanges and sign flips.
        seconds: it took.
    """

    source: str
    loop: Loop
    found: LoopDiagnosis
    notes: tuple[str, ...]
    seed: int
    seconds: float

    def sentence(self) -> str:
        """The verdict for a person."""
        found, best = self.found, self.found.best
        base = found.base.unseen_rms * _MM_PER_M
        if best is None or best.effect is None:
            like = found.tried[0]
            return (
                f"Nothing is claimed to open this loop: a reversible curve misses unseen readings"
                f" by {base:.2f} mm RMS; the best resemblance, {like.name}, by"
                f" {like.unseen_rms * _MM_PER_M:.2f} mm, which luck does in"
                f" {100.0 * like.luck:.0f} % of cases."
            )
        others = sorted({m.effect.missing for m in found.tied if m.effect is not None})
        rivals = [missing for missing in others if missing != best.effect.missing]
        doubt = f" ({' or '.join(rivals)} would do as well)" if rivals else ""
        return (
            f"A reversible curve lacks {best.effect.missing}{doubt}: error at unseen readings"
            f" {base:.2f} mm RMS before, {best.unseen_rms * _MM_PER_M:.2f} mm after."
        )

    def as_dict(self) -> dict[str, Any]:
        """The content of ``diagnosis.json``, units in the key names."""
        found = self.found
        worst = int(np.argmax(np.abs(found.difference)))
        return {
            "schema": SCHEMA,
            "kind": "length_pressure_loop",
            "source": self.source,
            "verdict": str(found.verdict),
            "sentence": self.sentence(),
            "effects": [] if found.best is None else [_effect(found.best, found.explained)],
            "alternatives": [_effect(model, None) for model in found.tied],
            "where": [
                {
                    "channel": CHANNEL,
                    "protocol": "loop",
                    "quantity": "direction",
                    "region": [float(found.level[worst]) / PA_PER_KPA] * 2,
                    "unit": "kPa",
                    "mean_difference_mm": float(np.mean(found.difference)) * _MM_PER_M,
                    "largest_difference_mm": float(found.difference[worst]) * _MM_PER_M,
                    "p_value": found.p_value,
                    "levels_kpa": (found.level / PA_PER_KPA).tolist(),
                    "rising_less_falling_mm": (found.difference * _MM_PER_M).tolist(),
                }
            ],
            "gap": {
                CHANNEL: {
                    "held_out": "each reading from the other at its pressure and all others",
                    "floor_mm": None if found.floor is None else found.floor * _MM_PER_M,
                    "before": self._scored(found.base),
                    "after": None if found.best is None else self._scored(found.best),
                }
            },
            "tried": [
                {
                    **_effect(model, None),
                    "loop_rms_mm": model.rms * _MM_PER_M,
                    "unseen_rms_mm": model.unseen_rms * _MM_PER_M,
                    "p_value_unseen": None if model.gain is None else model.gain.p_value,
                    "p_value_luck": model.luck,
                    "earned": model.earned,
                }
                for model in found.tried
            ],
            "next_experiment": self.next_experiment(),
            "notes": list(self.notes),
            "seed": self.seed,
            "seconds": self.seconds,
        }

    def next_experiment(self) -> str | None:
        """What to measure next; None if the question is settled."""
        if self.found.verdict is Verdict.NO_GAP:
            return "more runs of the same loop, each reading recorded, not their mean alone"
        if self.found.verdict is Verdict.AMBIGUOUS:
            return "the same loop at a tenth of the rate: creep closes it, hysteresis does not"
        return None

    def _scored(self, model: LoopModel) -> dict[str, Any]:
        ends = rms_interval95(model.unseen, seed=self.seed)
        return {
            "value_mm": model.unseen_rms * _MM_PER_M,
            "interval95_mm": [end * _MM_PER_M for end in ends],
            "in_sample_mm": model.rms * _MM_PER_M,
        }


def _effect(model: LoopModel, explained: float | None) -> dict[str, Any]:
    assert model.effect is not None
    return {
        "name": model.effect.family,
        "family": model.effect.family,
        "operator": model.effect.name,
        "missing": model.effect.missing,
        "parameters": {
            "opening": {
                "value": model.opening * _MM_PER_M,
                "unit": "mm",
                "interval95": [end * _MM_PER_M for end in model.interval95],
            },
            **(
                {model.effect.shape: {"value": model.shape, "unit": "1", "interval95": None}}
                if model.effect.shape
                else {}
            ),
        },
        "explained": explained,
        "p_value": model.luck,
    }


def paper_b_loop(form: str) -> Loop:
    """The length-pressure loop of seed 000.

    Args:
        form: ``means`` or ``branches``, see `PAPER_B`.

    Returns:
        Pressures [Pa] and lengths [m], up and down again.

    Raises:
        InputError: for another form.
    """
    if form not in PAPER_B:
        raise InputError(f"no form {form!r} of paper B's loop; {nearest(form, PAPER_B)}")
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
        loop: readings, see `paper_b_loop` and `table_loop`.
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
