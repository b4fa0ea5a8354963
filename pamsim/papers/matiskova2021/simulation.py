"""The simulated rig: end positions, G1, G2 and the words on them."""

from __future__ import annotations

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.papers.claim import Claim, Verdict, compare, holds
from pamsim.papers.reproduce import reproduce
from pamsim.papers.reproduce_checks import MODEL_LIMIT, RMS_LIMIT_DEG
from pamsim.papers.reproduction import Reproduction, Row, rms_error
from pamsim.store.printed import mas20_models

_GRAVITY = 9.81  # m/s^2
_FITTED = (
    "its unprinted numbers were identified from these rows and (31), so this shows that one rig"
    " can do it, not that it was this one"
)


def claims() -> list[Claim]:
    """Claims A-37 to A-43; simulates all printed rows once."""
    done = reproduce()
    return [
        _end_positions(done),
        _first_order(done),
        _second_order(done),
        _monotonic(done),
        _oscillating(done),
        _active_and_passive(done),
        _stronger_than_load(done),
    ]


def _end_positions(done: Reproduction) -> Claim:
    return compare(
        "A-37",
        "measured end positions of Tables 1 and 2; RMS difference of the simulated rig",
        0.0,
        rms_error(done.distinct) * DEG_PER_RAD,
        RMS_LIMIT_DEG,
        unit="deg",
        reason=f"rig {done.rig.name}, {len(done.distinct)} distinct rows, steps started by the"
        f" operating concept; {_FITTED}. Tolerance {RMS_LIMIT_DEG:g} deg, the limit of"
        " `pamsim reproduce`",
    )


def _first_order(done: Reproduction) -> Claim:
    printed = float(mas20_models()["g1"]["T_s"])
    found = done.identified
    if found is None:
        return _broken("A-38", "(30): T of G1 of the simulated large step", printed, "s")
    return compare(
        "A-38",
        "(30): T of G1 of the simulated large step without load",
        printed,
        found.g1.output_error.time_constants[0],
        MODEL_LIMIT * printed,
        unit="s",
        reason=f"output error with unit gain; ARX with unit gain gives"
        f" {found.g1.arx_unit_gain.time_constants[0]:.3f} s. The rig's valve and damping were"
        f" identified from (31), with which (30) disagrees; tolerance"
        f" {100.0 * MODEL_LIMIT:.0f} %",
    )


def _second_order(done: Reproduction) -> Claim:
    printed = mas20_models()["g2"]
    told = float(printed["T1_s"]), float(printed["T2_s"])
    found = done.identified
    if found is None:
        return _broken("A-39", "(31): T1, T2 of G2 of the simulated large step", told, "s")
    return compare(
        "A-39",
        "(31): T1, T2 of G2 of the simulated large step without load",
        told,
        found.g2.output_error.time_constants,
        [MODEL_LIMIT * value for value in told],
        unit="s",
        reason=f"output error with unit gain, fit {found.g2.output_error.fit_percent:.1f} %;"
        f" {_FITTED}; tolerance {100.0 * MODEL_LIMIT:.0f} % of each",
    )


def _monotonic(done: Reproduction) -> Claim:
    rows = [row for row in done.distinct if row.step.size != "small"]
    turning = [row.step.row for row in rows if not row.monotonic]
    return Claim(
        id="A-40",
        what="responses to large and medium steps are monotonic; rows",
        printed=float(len(rows)),
        recomputed=float(len(rows) - len(turning)),
        unit="1",
        verdict=holds(not turning, Verdict.NOT_REPRODUCIBLE),
        reason="simulated rig; monotonic: never turns back by more than one encoder increment,"
        f" {rows[0].increment * DEG_PER_RAD:.3f} deg. The measured responses are figures only",
        tolerance=0.0,
    )


def _oscillating(done: Reproduction) -> Claim:
    rows = [row for row in done.distinct if row.step.size == "small" and row.step.load > 0.0]
    swinging = [row for row in rows if not row.monotonic]
    still = [
        row.step.row
        for row in done.distinct
        if row.step.size == "small" and row.step.load == 0.0 and row.monotonic
    ]
    return Claim(
        id="A-41",
        what="responses to small steps under load oscillate before they settle; rows",
        printed=float(len(rows)),
        recomputed=float(len(swinging)),
        unit="1",
        verdict=holds(len(swinging) == len(rows), Verdict.NOT_REPRODUCIBLE),
        reason="simulated rig; oscillates: turns back by more than one encoder increment"
        f" (overshoot {_overshoots(swinging)}). Small steps without load that stay monotonic:"
        f" rows {', '.join(map(str, still)) or 'none'}. The measured responses are figures only",
        tolerance=0.0,
    )


def _active_and_passive(done: Reproduction) -> Claim:
    right, stray = 0, 0.0
    for row in done.rows:
        start, end = np.array(row.start), np.array(row.step.pressure)
        passive = int(np.argmin(np.abs(end - start)))
        towards = 1.0 if passive == 0 else -1.0
        right += row.metrics is not None and row.metrics.final * towards > 0.0
        stray = max(stray, float(np.ptp(row.recording.pressure[:, passive])))
    return Claim(
        id="A-42",
        what="venting the active muscle turns the arm towards the passive one, kept constant; rows",
        printed=float(len(done.rows)),
        recomputed=float(right),
        unit="1",
        verdict=holds(right == len(done.rows), Verdict.NOT_REPRODUCIBLE),
        reason="simulated rig: both muscles start at the higher printed pressure, one is vented;"
        f" the other's regulator holds it within {stray / PA_PER_KPA:.1f} kPa. The pressures the"
        " measured steps started from are not printed",
        tolerance=0.0,
    )


def _stronger_than_load(done: Reproduction) -> Claim:
    load = max(row.step.load for row in done.rows) * _GRAVITY
    ends = [float(row.recording.tension[-1].max()) for row in done.rows]
    return Claim(
        id="A-43",
        what="forces of the muscles are higher than the largest load force",
        printed="higher than the load force",
        recomputed=(load, min(ends), max(ends)),
        unit="N",
        verdict=holds(min(ends) > load, Verdict.NOT_REPRODUCIBLE),
        reason="weight of the largest printed load, and the smallest and largest tension of the"
        " stronger muscle at the end of each simulated row; the force scale of a 20 mm muscle is"
        " known to about 15 %, the arm's length is not printed",
    )


def _overshoots(rows: list[Row]) -> str:
    shares = [100.0 * row.metrics.overshoot for row in rows if row.metrics]
    return f"{min(shares):.0f} to {max(shares):.0f} %" if shares else "none"


def _broken(id: str, what: str, printed: float | tuple[float, ...], unit: str) -> Claim:
    return Claim(
        id=id,
        what=what,
        printed=printed,
        recomputed=None,
        unit=unit,
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="the simulated large step did not run to its end",
    )
