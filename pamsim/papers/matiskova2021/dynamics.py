"""The transfer functions (30) and (31): their arithmetic, whether they agree, and their steps."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA, FloatArray
from pamsim.identification.step_response import StepIdentification, identify_step, step_of_lags
from pamsim.papers.claim import Recomputed, recomputes
from pamsim.papers.numerics import propagated, root
from pamsim.recordings.printed import Printed, mas20_models, mas20_steps, printed_document
from pamsim.recordings.recording import Recording

SAMPLE_RATE = 500.0
"""[Hz], as printed in section 2.4."""

_LENGTHS = (2.0, 6.0, 10.0)  # s; the second is the length of our own simulated responses
_CURVE_POINTS = 301


def model_responses(
    recording: Recording, identified: StepIdentification
) -> Mapping[str, list[float] | None]:
    """Unit steps of every model beside the simulated large step that was identified (Figure 9).

    Returns:
        JSON-safe curves on a common grid; None where an ARX fit has no real time constants.
    """
    keep = slice(None, None, max(1, len(recording.time) // _CURVE_POINTS))
    time = recording.time[keep]
    travelled = recording.angle - recording.angle[0]
    printed = mas20_models()
    return {
        "time_s": time.tolist(),
        "simulated": (travelled[keep] / identified.final_value).tolist(),
        "g1_output_error": _lags(identified.g1.output_error.time_constants, time),
        "g2_output_error": _lags(identified.g2.output_error.time_constants, time),
        "g1_arx": _lags(identified.g1.arx_unit_gain.time_constants, time),
        "g2_arx": _lags(identified.g2.arx_unit_gain.time_constants, time),
        "g1_paper": _lags((printed["g1"]["T_s"],), time),
        "g2_paper": _lags((printed["g2"]["T1_s"], printed["g2"]["T2_s"]), time),
    }


def _lags(constants: tuple[float, ...], time: FloatArray) -> list[float] | None:
    return step_of_lags(time, *constants).tolist() if constants else None


def _constants() -> tuple[Printed, Printed]:
    """T1 and T2 of (31) [s]."""
    printed = printed_document("matiskova2021.toml", digits=True)["g2"]
    return printed["T1_s"], printed["T2_s"]


@functools.cache
def _identified(samples: int) -> StepIdentification:
    """Step of the printed G2, as many samples after the first, without noise."""
    time = np.arange(samples + 1) / SAMPLE_RATE
    return identify_step(time, step_of_lags(time, *(number.value for number in _constants())))


def _first_order(samples: int) -> float:
    """T of G1 by output error from as many samples [s]."""
    return _identified(samples).g1.output_error.time_constants[0]


@recomputes("matiskova2021-29", lambda first, second: first * second)
@recomputes("matiskova2021-30", lambda first, second: first + second)
def _of_both_constants(function: Callable[[float, float], float]) -> Recomputed:
    return Recomputed(propagated(function, *_constants()))


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
    single = float(mas20_models()["g1"]["T_s"])

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
