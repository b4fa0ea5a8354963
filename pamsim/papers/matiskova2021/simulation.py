"""The simulated rig: end positions, G1, G2 and the words on them."""

from __future__ import annotations

import functools

import numpy as np

from pamsim.core.errors import PamsimError
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.identification.step_response import StepIdentification
from pamsim.papers.claim import Recomputed, recomputes
from pamsim.papers.reproduce import Reproduction, reproduce
from pamsim.papers.torque_law import printed_rows_law
from pamsim.recordings.printed import mas20_models

_GRAVITY = 9.81  # m/s^2


@functools.cache
def _simulated() -> Reproduction:
    """All printed rows, simulated once."""
    return reproduce()


def _models() -> StepIdentification:
    """G1 and G2 of the simulated large step without load."""
    models = _simulated().identified
    if models is None:
        raise PamsimError("the simulated large step did not run to its end")
    return models


@recomputes("matiskova2021-37")
def _end_positions() -> Recomputed:
    done, scatter = _simulated(), printed_rows_law().left_out_rms_deg
    evidence = {"rig": done.rig.name, "rows": len(done.distinct), "scatter_deg": scatter}
    return Recomputed(done.rms_deg, high=scatter, **evidence)


@recomputes("matiskova2021-38")
def _first_order() -> Recomputed:
    g1 = _models().g1
    (arx,) = g1.arx_unit_gain.time_constants
    return Recomputed(g1.output_error.time_constants[0], arx=arx)


@recomputes("matiskova2021-39")
def _second_order() -> Recomputed:
    found = _models().g2.output_error
    printed = [mas20_models()["g2"][key] for key in ("T1_s", "T2_s")]
    first, second = (
        100.0 * abs(ours / paper - 1.0)
        for ours, paper in zip(found.time_constants, printed, strict=True)
    )
    return Recomputed(found.time_constants, fit=found.fit_percent, first=first, second=second)


@recomputes("matiskova2021-40")
def _monotonic() -> Recomputed:
    rows = [row for row in _simulated().distinct if row.step.size != "small"]
    still = [row for row in rows if row.monotonic]
    return Recomputed(float(len(still)), increment=rows[0].increment * DEG_PER_RAD)


@recomputes("matiskova2021-41")
def _oscillating() -> Recomputed:
    rows = [row for row in _simulated().distinct if row.step.size == "small"]
    swinging = [row for row in rows if row.step.load > 0.0 and not row.monotonic]
    still = [str(row.step.row) for row in rows if row.step.load == 0.0 and row.monotonic]
    shares = [100.0 * row.metrics.overshoot for row in swinging if row.metrics]
    over = f"{min(shares):.0f} to {max(shares):.0f} %" if shares else "none"
    return Recomputed(float(len(swinging)), overshoots=over, still=", ".join(still) or "none")


@recomputes("matiskova2021-42")
def _active_and_passive() -> Recomputed:
    right, stray = 0, 0.0
    for row in _simulated().rows:
        passive = int(np.argmin(np.abs(np.subtract(row.step.pressure, row.start))))
        towards = 1.0 if passive == 0 else -1.0
        right += row.metrics is not None and row.metrics.final * towards > 0.0
        stray = max(stray, float(np.ptp(row.recording.pressure[:, passive])))
    return Recomputed(float(right), stray=stray / PA_PER_KPA)


@recomputes("matiskova2021-43")
def _stronger_than_load() -> Recomputed:
    rows = _simulated().rows
    load = max(row.step.load for row in rows) * _GRAVITY
    ends = [float(row.recording.tension[-1].max()) for row in rows]
    return Recomputed((min(ends), max(ends)), low=load, load=load)
