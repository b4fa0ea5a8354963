"""The transfer functions (30) and (31), and what the simulated rig does: positions, G1 and G2."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable

import numpy as np

from pamsim.core.errors import PamsimError
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.identification.step_response import StepIdentification, identify_step, step_of_lags
from pamsim.papers.claim import Recomputed, recomputes
from pamsim.papers.numerics import PrintedNumbers, propagated, root
from pamsim.papers.reproduce import Reproduction, reproduce
from pamsim.papers.torque_law import printed_rows_law
from pamsim.recordings.printed import Printed, mas20_steps

SAMPLE_RATE = 500.0
"""[Hz], as printed in section 2.4."""

_LENGTHS = (2.0, 6.0, 10.0)  # s; the second is the length of our own simulated responses
_G2 = PrintedNumbers("matiskova2021", "g2")
_LAGS = "T1_s", "T2_s"  # of (31)

_GRAVITY = 9.81  # m/s^2


@functools.cache
def _identified(samples: int) -> StepIdentification:
    """Step of the printed G2, as many samples after the first, without noise."""
    time = np.arange(samples + 1) / SAMPLE_RATE
    return identify_step(time, step_of_lags(time, *map(_G2.value, _LAGS)))


def _first_order(samples: int) -> float:
    """T of G1 by output error from as many samples [s]."""
    return _identified(samples).g1.output_error.time_constants[0]


@recomputes(
    "matiskova2021-29",
    each=(operator.mul, operator.add),
)
def _of_both_constants(function: Callable[[float, float], float]) -> Printed:
    return propagated(function, *map(_G2.digits, _LAGS))


@recomputes("matiskova2021-31", each=("output_error", "arx_unit_gain", "arx_free_gain"))
def _as_first_order(estimate: str) -> Recomputed:
    models = [_identified(round(length * SAMPLE_RATE)).g1 for length in _LENGTHS]
    constants = [getattr(model, estimate).time_constants[0] for model in models]
    listed = ", ".join(
        f"{value:.3f} s from {length:g} s"
        for value, length in zip(constants, _LENGTHS, strict=True)
    )
    return Recomputed(constants[1], sample_rate=SAMPLE_RATE, listed=listed)


def _cut_samples() -> int:
    """Length of record at which output error gives T nearest to (30) [samples]."""
    single = PrintedNumbers("matiskova2021", "g1").value("T_s")

    def excess(length: float) -> float:
        return _first_order(round(length * SAMPLE_RATE)) - single

    return round(root(excess, 2.0, 3.0, 0.5 / SAMPLE_RATE) * SAMPLE_RATE)


@recomputes("matiskova2021-34")
def _cut_record() -> Recomputed:
    samples = _cut_samples()
    cut, constant = _identified(samples), _first_order(samples)
    return Recomputed(
        constant,
        duration=cut.duration,
        reached=100.0 * cut.final_value,
        spread=max(abs(_first_order(samples + more) - constant) for more in (-1, 1)),
    )


@recomputes("matiskova2021-35")
def _cut_record_second_order() -> Recomputed:
    cut = _identified(_cut_samples())
    return Recomputed(cut.g2.output_error.time_constants, duration=cut.duration)


@recomputes("matiskova2021-36")
def _unit_gain() -> Recomputed:
    gains = [
        step.angle * DEG_PER_RAD / ((step.pressure[0] - step.pressure[1]) / PA_PER_KPA)
        for step in mas20_steps()
    ]
    return Recomputed((min(gains), max(gains)))


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
def _simulated_first_order() -> Recomputed:
    g1 = _models().g1
    (arx,) = g1.arx_unit_gain.time_constants
    return Recomputed(g1.output_error.time_constants[0], arx=arx)


@recomputes("matiskova2021-39")
def _simulated_second_order() -> Recomputed:
    found = _models().g2.output_error
    first, second = 100.0 * np.abs(np.divide(found.time_constants, [*map(_G2.value, _LAGS)]) - 1.0)
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
