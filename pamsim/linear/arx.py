"""Discrete ARX models by linear least squares, and their time constants.

ARX least squares minimises the one-step prediction error. It is unbiased only if the noise enters
through 1/A(z); a sensor's white noise on the output, or a model order below the system's, biases
the poles. Output error (:mod:`pamsim.linear.step_fit`) has neither bias.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.record_checks import finite_samples, varying_output


class UnderdeterminedError(InputError):
    """The record does not determine all ARX coefficients (regressors are linearly dependent)."""


@dataclass(frozen=True)
class ArxModel:
    """``y(t) = -a1 y(t-1) - ... - a_na y(t-na) + b1 u(t-nk) + ... + b_nb u(t-nk-nb+1) + e(t)``.

    Attributes:
        a: output coefficients a1..a_na, without the leading 1 [-].
        b: input coefficients b1..b_nb [output unit per input unit].
        delay: nk, samples between the input and its first effect; 1 in the paper.
        sample_time: Ts [s].
        residual_variance: residual sum of squares over (n - free coefficients) [output unit^2].
        n: number of equations used, N in (27).
    """

    a: tuple[float, ...]
    b: tuple[float, ...]
    delay: int
    sample_time: float
    residual_variance: float
    n: int

    @property
    def static_gain(self) -> float:
        """``sum(b) / (1 + sum(a))`` [output unit per input unit]; inf or nan for an integrator."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.float64(sum(self.b)) / np.float64(1.0 + sum(self.a)))

    @property
    def poles(self) -> tuple[complex, ...]:
        """Roots of ``z^na + a1 z^(na-1) + ... + a_na`` [-], by falling magnitude."""
        roots = np.roots(np.array([1.0, *self.a]))
        return tuple(complex(z) for z in roots[np.argsort(-np.abs(roots), kind="stable")])


def lag(na: int, nb: int, delay: int) -> int:
    """Return how many samples back the regression vector reaches: ``max(na, nk + nb - 1)``."""
    return max(na, delay + nb - 1)


def regression(
    output: ArrayLike, command: ArrayLike, *, na: int, nb: int, delay: int = 1
) -> tuple[FloatArray, FloatArray]:
    """Stack the regression vectors ``phi(t)`` and the targets ``y(t)``.

    Only times whose whole regression vector lies inside the record are used: nothing is assumed
    about what went before it.

    Args:
        output: y, shape ``(n,)`` [output unit].
        command: u, shape ``(n,)`` [input unit].
        na: number of output coefficients, >= 0.
        nb: number of input coefficients, >= 1.
        delay: nk >= 0 [samples].

    Returns:
        ``(phi, target)``, shapes ``(m, na + nb)`` and ``(m,)`` with ``m = n - max(na, nk+nb-1)``.

    Raises:
        InputError: orders out of range, lengths differ, non-finite or too few samples.

    Source: Matiskova 2021, equations (25), (26).
    """
    if na < 0 or nb < 1 or delay < 0:
        raise InputError(
            f"ARX orders na={na}, nb={nb}, delay={delay}; give na >= 0, nb >= 1, delay >= 0"
        )
    y = finite_samples(output, "output")
    u = finite_samples(command, "input")
    if y.size != u.size:
        raise InputError(f"output has {y.size} samples but input has {u.size}; give one length")
    start = lag(na, nb, delay)
    if y.size - start <= na + nb:
        raise InputError(
            f"record too short: {y.size} samples for ARX na={na}, nb={nb}, delay={delay}; "
            f"at least {start + na + nb + 1} are needed, record longer or lower the order"
        )
    past_y = [-y[start - i : y.size - i] for i in range(1, na + 1)]
    past_u = [u[start - i : u.size - i] for i in range(delay, delay + nb)]
    return np.column_stack([*past_y, *past_u]), y[start:]


def centred_regression(
    output: ArrayLike, command: ArrayLike, *, na: int, nb: int, delay: int = 1
) -> tuple[FloatArray, FloatArray]:
    """Stack as `regression` does and subtract means: that fits an offset of the record's own."""
    phi, target = regression(output, command, na=na, nb=nb, delay=delay)
    return phi - phi.mean(axis=0), target - target.mean()


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

    Args:
        output: y, uniformly sampled, shape ``(n,)`` [output unit].
        command: u, shape ``(n,)`` [input unit].
        sample_time: Ts > 0 [s].
        na: number of output coefficients, >= 0.
        nb: number of input coefficients, >= 1.
        delay: nk >= 0 [samples].
        static_gain: None estimates all coefficients as (29) does; a number g holds
            ``sum(b) / (1 + sum(a)) = g`` (the printed G1 and G2 have g = 1) [output per input].

    Returns:
        The model.

    Raises:
        InputError: bad orders, samples or sample time, or a constant output.
        UnderdeterminedError: the record does not determine the coefficients.

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
    # Columns are scaled so that the rank test does not depend on the units of y and u.
    norms = np.linalg.norm(design, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    scaled, _, rank, _ = np.linalg.lstsq(design / scale, target - phi @ origin, rcond=None)
    if rank < design.shape[1]:
        raise UnderdeterminedError(
            f"record does not determine ARX na={na}, nb={nb}: {rank} of {design.shape[1]} "
            "directions are excited; give an input that changes more often, or lower the order"
        )
    theta = origin + directions @ (scaled / scale)
    residual = target - phi @ theta
    return ArxModel(
        a=tuple(float(v) for v in theta[:na]),
        b=tuple(float(v) for v in theta[na:]),
        delay=delay,
        sample_time=float(sample_time),
        residual_variance=float(residual @ residual) / (target.size - design.shape[1]),
        n=int(target.size),
    )


def simulate_arx(model: ArxModel, command: ArrayLike) -> FloatArray:
    """Run the model freely from rest, without feeding measured outputs back.

    Args:
        model: the ARX model.
        command: u, shape ``(n,)``; zero before the record [input unit].

    Returns:
        The simulated output, shape ``(n,)`` [output unit]; not finite if the model explodes.

    Raises:
        InputError: the input is not finite or not one-dimensional.
    """
    u = finite_samples(command, "input")
    # A plain loop: scipy.signal's filter would cost a second of import for milliseconds of work.
    forced = np.convolve(u, [0.0] * model.delay + list(model.b))[: u.size].tolist()
    past = [0.0] * len(model.a)
    result: list[float] = []
    for value in forced:
        now = value - sum(a * y for a, y in zip(model.a, past, strict=True))
        result.append(now)
        past = [now, *past][: len(model.a)]
    return np.array(result, dtype=np.float64)


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
        poles: the discrete poles it was read from [-].
    """

    status: PoleStatus
    sentence: str
    gain: float | None
    time_constants: tuple[float, ...]
    poles: tuple[complex, ...]


def time_constants_from_arx(model: ArxModel) -> LagChain:
    """Read (K, T) or (K, T1, T2) from the poles ``z_i = exp(-Ts / T_i)``.

    The discrete zeros are not used: of an ARX with nb = 2 only gain and poles survive. Poles that
    no chain of lags can have give a status and no numbers.

    Args:
        model: ARX model with na = 1 or 2.

    Returns:
        The reading, with its status.

    Raises:
        InputError: na is neither 1 nor 2.

    Source: pole mapping of zero-order-hold sampling; G1, G2 of Matiskova 2021, equation (24).
    """
    if len(model.a) not in (1, 2):
        raise InputError(f"ARX has na={len(model.a)}; time constants are read for na = 1 or 2 only")
    poles = model.poles
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
        rising = sorted(-model.sample_time / float(np.log(z.real)) for z in poles)
        sentence = f"poles {shown} are those of {len(poles)} sampled lag(s)"
        return LagChain(PoleStatus.LAGS, sentence, model.static_gain, tuple(rising), poles)
    return LagChain(status, f"poles {shown}: {why}", None, (), poles)
