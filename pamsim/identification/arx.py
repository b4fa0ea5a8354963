"""Discrete ARX models by linear least squares, and their time constants.

ARX least squares minimises the one-step prediction error. It is unbiased only if the noise enters
through 1/A(z); a sensor's white noise on the output, or a model order below the system's, biases
the poles. Output error (:mod:`pamsim.identification.discrete_fit`) has neither bias.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.discrete_structure import DiscreteStructure, regression
from pamsim.identification.separable_fit import scaled_solution
from pamsim.inference.record_checks import varying_output


class UnderdeterminedError(InputError):
    """The record does not determine all ARX coefficients (regressors are linearly dependent)."""


@dataclass(frozen=True, eq=False)
class ArxModel:
    """``y(t) = -a1 y(t-1) - ... - a_na y(t-na) + b1 u(t-nk) + ... + b_nb u(t-nk-nb+1) + e(t)``.

    Attributes:
        structure: na, nb, nk and the sample time.
        coordinates: a1..a_na [-], then b1..b_nb [output unit per input unit].
        residual_variance: residual sum of squares over (n - free coefficients) [output unit^2].
        n: number of equations used, N in (27).
    """

    structure: DiscreteStructure
    coordinates: FloatArray
    residual_variance: float = 0.0
    n: int = 0


def fit_arx(
    output: ArrayLike,
    command: ArrayLike,
    sample_time: float,
    *,
    na: int,
    nb: int,
    delay: int = 1,
    static_gain: float | None = None,
) -> ArxModel:
    """Estimate an ARX model by least squares, freely or with its static gain held.

    Without a static gain all coefficients are estimated as (29) does; a number g holds
    ``sum(b) / (1 + sum(a)) = g`` (the printed G1 and G2 have g = 1) [output per input].

    Source: Matiskova 2021, equations (25)-(29); the gain constraint is added here because (30)
    and (31) are printed with unit gain, without the method.
    """
    if not (np.isfinite(sample_time) and sample_time > 0.0):
        raise InputError(f"sample time {sample_time!r} s is not a positive time; give seconds > 0")
    if static_gain is not None and not np.isfinite(static_gain):
        raise InputError(f"static gain {static_gain!r} is not finite; give a number or None")
    phi, target = regression(output, command, na=na, nb=nb, delay=delay)
    varying_output(target)

    # theta = origin + directions @ free; without a constraint that is theta itself.
    origin, directions = np.zeros(na + nb), np.eye(na + nb)
    if static_gain is not None:
        # sum(b) - g sum(a) = g is linear in theta: its solutions are a point plus a null space.
        row = np.concatenate([np.full(na, -static_gain), np.ones(nb)])
        origin = row * (static_gain / float(row @ row))
        directions = np.linalg.svd(row[np.newaxis, :])[2][1:].T
    design = phi @ directions
    # Same estimate as (29), but orthogonal factors of phi instead of the inverse of phi^T phi,
    # whose condition number is the square (at 500 Hz y(t-1) and y(t-2) are nearly parallel).
    free, rank = scaled_solution(design, target - phi @ origin)
    if rank < design.shape[1]:
        raise UnderdeterminedError(
            f"record does not determine ARX na={na}, nb={nb}: {rank} of {design.shape[1]} "
            "directions are excited; give an input that changes more often, or lower the order"
        )
    theta = origin + directions @ free
    residual = target - phi @ theta
    return ArxModel(
        structure=DiscreteStructure("arx", na, nb, delay, float(sample_time)),
        coordinates=theta,
        residual_variance=float(residual @ residual) / (target.size - design.shape[1]),
        n=int(target.size),
    )


class PoleStatus(StrEnum):
    """Whether discrete poles are those of a sampled chain of first-order lags."""

    LAGS = "lags"
    COMPLEX = "complex_poles"
    NOT_POSITIVE = "non_positive_pole"
    UNSTABLE = "unstable_pole"


@dataclass(frozen=True)
class LagChain:
    """Continuous-time reading of an ARX model: ``K / ((T1 s + 1) ... (Tn s + 1))``.

    Attributes:
        status: ``LAGS`` if the reading holds, otherwise why it does not.
        sentence: the same for a person.
        gain: static gain K; None unless ``status`` is ``LAGS`` [output unit per input unit].
        time_constants: rising, one per pole; empty unless ``status`` is ``LAGS`` [s].
    """

    status: PoleStatus
    sentence: str
    gain: float | None = None
    time_constants: tuple[float, ...] = ()


def time_constants_from_arx(model: ArxModel) -> LagChain:
    """Read (K, T) or (K, T1, T2) from the poles ``z_i = exp(-Ts / T_i)`` for na = 1 or 2.

    The discrete zeros are not used: of an ARX with nb = 2 only gain and poles survive. Poles that
    no chain of lags can have give a status and no numbers.

    Source: pole mapping of zero-order-hold sampling; G1, G2 of Matiskova 2021, equation (24).
    """
    structure = model.structure
    if structure.na not in (1, 2):
        raise InputError(f"ARX has na={structure.na}; time constants are read for na = 1 or 2 only")
    poles = structure.poles(model.coordinates)
    shown = ", ".join(f"{z.real:.6g}{z.imag:+.3g}j" if z.imag else f"{z.real:.6g}" for z in poles)
    if any(abs(z) >= 1.0 for z in poles):
        status = PoleStatus.UNSTABLE
        why = "a pole on or outside the unit circle does not settle: no time constant exists"
    elif any(z.imag != 0.0 for z in poles):
        status = PoleStatus.COMPLEX
        why = "the model oscillates: real T1, T2 do not exist"
    elif any(z.real <= 0.0 for z in poles):
        status = PoleStatus.NOT_POSITIVE
        why = "a pole <= 0 alternates from sample to sample: no lag does that (often noise)"
    else:
        rising = sorted(-structure.sample_time / float(np.log(z.real)) for z in poles)
        sentence = f"poles {shown} are those of {len(poles)} sampled lag(s)"
        gain = structure.static_gain(model.coordinates)
        return LagChain(PoleStatus.LAGS, sentence, gain, tuple(rising))
    return LagChain(status, f"poles {shown}: {why}")
