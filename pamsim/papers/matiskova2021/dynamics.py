"""The transfer functions (30) and (31): their arithmetic, and whether they agree."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.linear.first_second_order import second_order_step
from pamsim.linear.step_identification import StepIdentification, identify_step
from pamsim.papers.claim import Recomputed, recomputes
from pamsim.papers.numerics import root
from pamsim.papers.rounding import propagated
from pamsim.recordings.printed import Printed, mas20_models, mas20_steps, printed_document

SAMPLE_RATE = 500.0
"""[Hz], as printed in section 2.4."""

_LENGTHS = (2.0, 6.0, 10.0)  # s; the second is the length of our own simulated responses


def _constants() -> tuple[Printed, Printed]:
    """T1 and T2 of (31) [s]."""
    printed = printed_document("matiskova2021.toml", digits=True)["g2"]
    return printed["T1_s"], printed["T2_s"]


def _single() -> float:
    return float(mas20_models()["g1"]["T_s"])


@functools.cache
def _identified(samples: int) -> StepIdentification:
    """Step of the printed G2, as many samples after the first, without noise."""
    time = np.arange(samples + 1) / SAMPLE_RATE
    return identify_step(time, second_order_step(time, *(number.value for number in _constants())))


@recomputes("matiskova2021-29")
def _product() -> Recomputed:
    return Recomputed(propagated(lambda first, second: first * second, *_constants()))


@recomputes("matiskova2021-30")
def _sum() -> Recomputed:
    return Recomputed(propagated(lambda first, second: first + second, *_constants()))


@recomputes("matiskova2021-31", lambda models: models.g1.output_error)
@recomputes("matiskova2021-32", lambda models: models.g1.arx_unit_gain)
@recomputes("matiskova2021-33", lambda models: models.g1.arx_free_gain)
def _as_first_order(estimate: Callable[[StepIdentification], Any]) -> Recomputed:
    constants = [
        estimate(_identified(round(length * SAMPLE_RATE))).time_constants[0] for length in _LENGTHS
    ]
    listed = ", ".join(
        f"{value:.3f} s from {length:g} s"
        for value, length in zip(constants, _LENGTHS, strict=True)
    )
    return Recomputed(constants[1], sample_rate=SAMPLE_RATE, listed=listed)


def _cut_samples() -> int:
    """Length of record at which output error gives T nearest to (30) [samples]."""

    def excess(length: float) -> float:
        result = _identified(round(length * SAMPLE_RATE))
        return result.g1.output_error.time_constants[0] - _single()

    return round(root(excess, 2.0, 3.0, 0.5 / SAMPLE_RATE) * SAMPLE_RATE)


@recomputes("matiskova2021-34")
def _cut_record() -> Recomputed:
    samples = _cut_samples()
    cut = _identified(samples)
    spread = [
        abs(
            _identified(samples + more).g1.output_error.time_constants[0]
            - cut.g1.output_error.time_constants[0]
        )
        for more in (-1, 1)
    ]
    return Recomputed(
        cut.g1.output_error.time_constants[0],
        duration=cut.duration,
        reached=100.0 * cut.final_value,
        spread=max(spread),
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
