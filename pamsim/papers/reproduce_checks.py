"""What a reproduction must show: statements about all rows that hold or do not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pamsim.identification.step_response import StepIdentification, step_of_lags
from pamsim.papers.calibration_record import CalibrationRecord
from pamsim.papers.printed_steps import IDENTIFIED_ROW, Row, rms_error_deg
from pamsim.papers.torque_law import best_torque_laws
from pamsim.recordings.printed import mas20_models
from pamsim.recordings.recording import Recording


@dataclass(frozen=True)
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
    """Judge a reproduction, by the record of the rig's calibration if it applies to these rows.

    The work is a muscle's over that of its air, in a cycle of the large step's size [-].
    """
    energy = Check(
        "energy",
        abs(work - 1.0) <= WORK_LIMIT,
        f"over the travel and at the pressure of the large step a muscle gives {work:.3f}"
        f" times the work of its air (1 within {100.0 * WORK_LIMIT:.0f} %)",
    )
    judged = (*_row_checks(rows), energy)
    if identified is not None:
        large = next(row.recording for row in rows if row.step.row == IDENTIFIED_ROW)
        judged += _model_checks(identified, large)
    return judged if record is None else (*judged, *_held_out_checks(record, rows))


def _row_checks(rows: tuple[Row, ...]) -> tuple[Check, ...]:
    distinct = [row for row in rows if row.step.repeats is None]
    rms = rms_error_deg(rows)
    broken = [row for row in distinct if row.metrics is None]
    wrong = [r for r in distinct if r.metrics is None or r.metrics.final * r.step.angle <= 0.0]
    turning = [row for row in distinct if not row.monotonic]
    large = [row for row in turning if row.step.size != "small"]
    swinging = [row for row in turning if row.step.size == "small" and row.step.load > 0.0]
    return (
        Check(
            "completed",
            not broken,
            f"{_rows(broken)} broke down" if broken else "every simulation ran to its end",
        ),
        Check(
            "rms",
            rms <= RMS_LIMIT_DEG,
            f"RMS error of the {len(distinct)} distinct end positions is {rms:.2f} deg"
            f" (limit {RMS_LIMIT_DEG:g} deg)",
        ),
        Check(
            "signs",
            not wrong,
            f"{_rows(wrong)} end on the wrong side"
            if wrong
            else "the arm turns the measured way in every row",
        ),
        Check(
            "monotonic",
            not large,
            f"large or medium {_rows(large)} turn back, against the paper's words"
            if large
            else "no response to a large or medium step turns back by an encoder increment,"
            " as the paper says",
        ),
        Check(
            "oscillation",
            bool(swinging),
            f"small steps with load swing before they settle ({_rows(swinging)}), as the paper says"
            if swinging
            else "no small step with load swings, against the paper's words",
        ),
    )


def _model_checks(identified: StepIdentification, large: Recording) -> tuple[Check, ...]:
    g1, g2 = identified.g1.output_error, identified.g2.output_error
    names, printed = ("T of G1", "T1 of G2", "T2 of G2"), mas20_models()
    paper = [float(printed[g][name]) for g, name in (("g1", "T_s"), ("g2", "T1_s"), ("g2", "T2_s"))]
    ours = (*g1.time_constants, *g2.time_constants)
    off = [found / wanted - 1.0 for found, wanted in zip(ours, paper, strict=True)]
    moved = large.angle - large.angle[0]
    step = step_of_lags(large.time, *paper[1:])
    away = float(np.max(np.abs(moved / moved[-1] - step)))
    listed = ", ".join(
        f"{name} is {found:.4f} s, printed {wanted:.4f} s ({100.0 * miss:+.1f} %)"
        for name, found, wanted, miss in zip(names, ours, paper, off, strict=True)
    )
    return (
        Check(
            "time_constants",
            max(map(abs, off)) <= MODEL_LIMIT,
            f"by output error {listed}; limit {100.0 * MODEL_LIMIT:.0f} %",
        ),
        Check(
            "response",
            away <= RESPONSE_LIMIT,
            f"the normalised large step is within {100.0 * away:.1f} % of the step of the"
            f" printed G2 everywhere (limit {100.0 * RESPONSE_LIMIT:.0f} %)",
        ),
    )


def _held_out_checks(record: CalibrationRecord, rows: tuple[Row, ...]) -> tuple[Check, ...]:
    """Held-out errors against those of the best torque law without a muscle.

    Each is judged against the law that predicts best there, although that law was chosen with all
    rows known.
    """
    rms = rms_error_deg(rows)
    recorded, held_out = (float(record.used[key]) for key in ("rms_deg", "leave_one_out_rms_deg"))
    if not record.belongs(rms):
        stale = (
            f"calibration.json records an RMS of {recorded:.2f} deg, simulated now: {rms:.2f} deg;"
            f" the rig was changed since then; run {record.command} again"
        )
        return (Check("leave_one_out", False, stale),)
    nested, small = record.nested.rms_deg, record.small_steps_rms_deg
    rows_limit, small_limit = best_torque_laws().values()
    return (
        Check(
            "leave_one_out",
            nested <= rows_limit,
            f"rows held out in turn are predicted with {nested:.2f} deg RMS if the form of"
            f" the model is chosen without them, too, among {len(record.static_models)};"
            f" {held_out:.2f} deg for the form used (limit {rows_limit:.2f} deg, the"
            f" best torque law without a muscle; recorded by {record.command})",
        ),
        Check(
            "small_steps",
            small <= small_limit,
            f"fitted without the small steps, the model predicts them with {small:.2f} deg"
            f" RMS (limit {small_limit:.2f} deg, the best torque law without a muscle)",
        ),
    )


def _rows(rows: list[Row]) -> str:
    return f"rows {', '.join(str(row.step.row) for row in rows)}"
