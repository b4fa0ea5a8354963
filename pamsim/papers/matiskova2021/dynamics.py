"""The transfer functions (30) and (31): their arithmetic, and whether they agree."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.linear.first_second_order import second_order_step
from pamsim.linear.step_identification import ArxStep, StepIdentification, identify_step
from pamsim.papers.claim import Claim, Verdict, compare, half_unit
from pamsim.papers.root import root
from pamsim.store.printed import mas20_models, mas20_steps

SAMPLE_RATE = 500.0
"""[Hz], as printed in section 2.4."""

_LENGTHS = (2.0, 6.0, 10.0)  # s; the second is the length of our own simulated responses
_T_DIGITS = 5  # of (30) and of T2 in (31)
_PRODUCT, _SUM = 0.052267, 0.669  # the expanded denominator of (31)


def claims() -> list[Claim]:
    """Claims A-29 to A-36."""
    return [
        _product(),
        _sum(),
        *(_as_first_order(*method) for method in _methods()),
        _cut_record(),
        _cut_record_second_order(),
        _unit_gain(),
    ]


def _constants() -> tuple[float, float]:
    printed = mas20_models()["g2"]
    return float(printed["T1_s"]), float(printed["T2_s"])


def _single() -> float:
    return float(mas20_models()["g1"]["T_s"])


@functools.cache
def _identified(samples: int) -> StepIdentification:
    """Step of the printed G2, as many samples after the first, without noise."""
    time = np.arange(samples + 1) / SAMPLE_RATE
    return identify_step(time, second_order_step(time, *_constants()))


def _product() -> Claim:
    first, second = _constants()
    return compare(
        "A-29",
        "(31): coefficient of s^2 is T1 T2",
        _PRODUCT,
        first * second,
        half_unit(6),
        unit="s^2",
        reason="product of the printed time constants",
        otherwise=Verdict.INCONSISTENT,
    )


def _sum() -> Claim:
    first, second = _constants()
    return compare(
        "A-30",
        "(31): coefficient of s is T1 + T2",
        _SUM,
        first + second,
        half_unit(3),
        unit="s",
        reason="sum of the printed time constants",
        otherwise=Verdict.INCONSISTENT,
    )


def _methods() -> tuple[tuple[str, str, list[float]], ...]:
    found = [_identified(round(length * SAMPLE_RATE)) for length in _LENGTHS]
    return (
        ("A-31", "output error, unit gain", [f.g1.output_error.time_constants[0] for f in found]),
        ("A-32", "ARX least squares, unit gain", _first(f.g1.arx_unit_gain for f in found)),
        ("A-33", "ARX least squares, free gain", _first(f.g1.arx_free_gain for f in found)),
    )


def _first(estimates: Iterable[ArxStep]) -> list[float]:
    return [estimate.time_constants[0] for estimate in estimates]


def _as_first_order(id: str, method: str, found: Sequence[float]) -> Claim:
    listed = ", ".join(
        f"{value:.3f} s from {length:g} s" for value, length in zip(found, _LENGTHS, strict=True)
    )
    return compare(
        id,
        f"(30) and (31) describe one response: T of G1 from a step of G2, {method}",
        _single(),
        found[1],
        half_unit(_T_DIGITS),
        unit="s",
        reason=f"step of (31) without noise, sampled at {SAMPLE_RATE:g} Hz and divided by its end"
        f" value: {listed}. The paper names ARX least squares, (25)-(29), without its orders",
        otherwise=Verdict.INCONSISTENT,
    )


def _cut_samples() -> int:
    """Length of record at which output error gives T nearest to (30) [samples]."""

    def excess(length: float) -> float:
        found = _identified(round(length * SAMPLE_RATE))
        return found.g1.output_error.time_constants[0] - _single()

    return round(root(excess, 2.0, 3.0, 0.5 / SAMPLE_RATE) * SAMPLE_RATE)


def _cut_record() -> Claim:
    samples = _cut_samples()
    cut = _identified(samples)
    spread = [
        abs(
            _identified(samples + more).g1.output_error.time_constants[0]
            - cut.g1.output_error.time_constants[0]
        )
        for more in (-1, 1)
    ]
    return Claim(
        id="A-34",
        what="(30) as a fit to a record of (31) that was cut before it settled (our candidate)",
        printed=_single(),
        recomputed=cut.g1.output_error.time_constants[0],
        unit="s",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason=f"output error with unit gain on the first {cut.duration:.3f} s of the step of (31),"
        f" divided by its end, which is at {100.0 * cut.final_value:.1f} % of the true one."
        " The length was chosen to give the printed number, to within what one sample changes"
        f" ({max(spread):.1g} s), and none is printed: a possible cause and no more",
    )


def _cut_record_second_order() -> Claim:
    cut = _identified(_cut_samples())
    return compare(
        "A-35",
        "(31) from that same cut record",
        _constants(),
        cut.g2.output_error.time_constants,
        [half_unit(6), half_unit(_T_DIGITS)],
        unit="s",
        reason=f"what gives (30) does not give (31): G2 by output error on the first"
        f" {cut.duration:.3f} s, divided by its end, so both were not identified from one record in"
        " one way",
        otherwise=Verdict.INCONSISTENT,
    )


def _unit_gain() -> Claim:
    gains = [
        step.angle * DEG_PER_RAD / ((step.pressure[0] - step.pressure[1]) / PA_PER_KPA)
        for step in mas20_steps()
    ]
    return Claim(
        id="A-36",
        what="(30) and (31) have the gain 1",
        printed=1.0,
        recomputed=(min(gains), max(gains)),
        unit="1",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="smallest and largest end angle over p_svd of the rows [deg/kPa]: the responses"
        " must have been divided by their end values, which the paper does not say, nor which"
        " rows were used",
    )
