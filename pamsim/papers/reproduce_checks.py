"""What a reproduction must show: statements about all rows that hold or do not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pamsim.core.units import DEG_PER_RAD
from pamsim.linear.first_second_order import second_order_step
from pamsim.linear.step_identification import StepIdentification
from pamsim.papers.calibration_record import CalibrationRecord
from pamsim.papers.printed_rows import IDENTIFIED_ROW, Row, rms_error
from pamsim.papers.torque_law import best_torque_laws
from pamsim.recordings.printed import mas20_models
from pamsim.recordings.recording import Recording


@dataclass(frozen=True, kw_only=True)
class Check:
    """A statement about the reproduction that holds or does not."""

    name: str
    ok: bool
    sentence: str


RMS_LIMIT_DEG = 0.9
"""Largest RMS error of the final angle: between those of torque laws of three and four numbers."""

MODEL_LIMIT = 0.05
"""Largest relative difference of a time constant from the printed one."""

RESPONSE_LIMIT = 0.02
"""Largest deviation of the normalised large step from the step of the printed G2 [-]."""

WORK_LIMIT = 0.02
"""Largest difference of a muscle's work from that of its air [-]."""


def checks(
    rows: tuple[Row, ...],
    identified: StepIdentification | None,
    record: CalibrationRecord | None,
    work: float,
) -> tuple[Check, ...]:
    """Judge a reproduction.

    Args:
        rows: all of them.
        identified: models of the large step, or None if it did not complete.
        record: of the rig's calibration, if it applies to these rows.
        work: a muscle's over that of its air, in a cycle of the large step's size [-].
    """
    judged = (*_row_checks(rows), _work_check(work))
    if identified is not None:
        large = next(row.recording for row in rows if row.step.row == IDENTIFIED_ROW)
        judged += _model_checks(identified, large)
    return judged if record is None else (*judged, *_held_out_checks(record, rows))


def _row_checks(rows: tuple[Row, ...]) -> tuple[Check, ...]:
    distinct = tuple(row for row in rows if row.step.repeats is None)
    rms = rms_error(distinct) * DEG_PER_RAD
    broken = [row.step.row for row in distinct if row.metrics is None]
    wrong = [
        row.step.row
        for row in distinct
        if row.metrics is None or row.metrics.final * row.step.angle <= 0.0
    ]
    turning = [row.step.row for row in distinct if row.step.size != "small" and not row.monotonic]
    swinging = [
        row.step.row
        for row in distinct
        if row.step.size == "small" and row.step.load > 0.0 and not row.monotonic
    ]
    return (
        Check(
            name="completed",
            ok=not broken,
            sentence="every simulation ran to its end"
            if not broken
            else f"{_rows(broken)} broke down",
        ),
        Check(
            name="rms",
            ok=rms <= RMS_LIMIT_DEG,
            sentence=f"RMS error of the {len(distinct)} distinct end positions is {rms:.2f} deg"
            f" (limit {RMS_LIMIT_DEG:g} deg)",
        ),
        Check(
            name="signs",
            ok=not wrong,
            sentence="the arm turns the measured way in every row"
            if not wrong
            else f"{_rows(wrong)} end on the wrong side",
        ),
        Check(
            name="monotonic",
            ok=not turning,
            sentence="no response to a large or medium step turns back by an encoder increment,"
            " as the paper says"
            if not turning
            else f"large or medium {_rows(turning)} turn back, against the paper's words",
        ),
        Check(
            name="oscillation",
            ok=bool(swinging),
            sentence=f"small steps with load swing before they settle ({_rows(swinging)}), as the"
            " paper says"
            if swinging
            else "no small step with load swings, against the paper's words",
        ),
    )


def _work_check(work: float) -> Check:
    return Check(
        name="energy",
        ok=abs(work - 1.0) <= WORK_LIMIT,
        sentence=f"over the travel and at the pressure of the large step a muscle gives {work:.3f}"
        f" times the work of its air (1 within {100.0 * WORK_LIMIT:.0f} %)",
    )


def _model_checks(identified: StepIdentification, large: Recording) -> tuple[Check, ...]:
    printed = mas20_models()
    (single,) = identified.g1.output_error.time_constants
    fast, slow = identified.g2.output_error.time_constants
    pairs = (
        ("T of G1", single, float(printed["g1"]["T_s"])),
        ("T1 of G2", fast, float(printed["g2"]["T1_s"])),
        ("T2 of G2", slow, float(printed["g2"]["T2_s"])),
    )
    off = [ours / paper - 1.0 for _, ours, paper in pairs]
    moved = large.angle - large.angle[0]
    step = second_order_step(large.time, pairs[1][2], pairs[2][2])
    away = float(np.max(np.abs(moved / moved[-1] - step)))
    return (
        Check(
            name="time_constants",
            ok=max(map(abs, off)) <= MODEL_LIMIT,
            sentence="by output error "
            + ", ".join(
                f"{what} is {ours:.4f} s, printed {paper:.4f} s ({100.0 * miss:+.1f} %)"
                for (what, ours, paper), miss in zip(pairs, off, strict=True)
            )
            + f"; limit {100.0 * MODEL_LIMIT:.0f} %",
        ),
        Check(
            name="response",
            ok=away <= RESPONSE_LIMIT,
            sentence=f"the normalised large step is within {100.0 * away:.1f} % of the step of the"
            f" printed G2 everywhere (limit {100.0 * RESPONSE_LIMIT:.0f} %)",
        ),
    )


def _held_out_checks(record: CalibrationRecord, rows: tuple[Row, ...]) -> tuple[Check, ...]:
    """Held-out errors against those of the best torque law without a muscle.

    Each is judged against the law that predicts best there, although that law was chosen with all
    rows known.
    """
    rms = rms_error(tuple(row for row in rows if row.step.repeats is None)) * DEG_PER_RAD
    recorded, held_out = (float(record.used[key]) for key in ("rms_deg", "leave_one_out_rms_deg"))
    if not record.belongs(rms):
        return (
            Check(
                name="leave_one_out",
                ok=False,
                sentence=f"calibration.json records an RMS of {recorded:.2f} deg, simulated now:"
                f" {rms:.2f} deg; the rig was changed since then; run {record.command} again",
            ),
        )
    nested, small, best = record.nested.rms_deg, record.small_steps_rms_deg, best_torque_laws()
    return (
        Check(
            name="leave_one_out",
            ok=nested <= best.left_out_rms_deg,
            sentence=f"rows held out in turn are predicted with {nested:.2f} deg RMS if the form of"
            f" the model is chosen without them, too, among {len(record.static_models)};"
            f" {held_out:.2f} deg for the form used (limit {best.left_out_rms_deg:.2f} deg, the"
            f" best torque law without a muscle; recorded by {record.command})",
        ),
        Check(
            name="small_steps",
            ok=small <= best.small_steps_rms_deg,
            sentence=f"fitted without the small steps, the model predicts them with {small:.2f} deg"
            f" RMS (limit {best.small_steps_rms_deg:.2f} deg, the best torque law without a"
            " muscle)",
        ),
    )


def _rows(numbers: list[int]) -> str:
    return f"rows {', '.join(map(str, numbers))}"
