"""Where the search for an output-error model moves, and where it starts."""

# scipy carries no types: what it returns is Any at this file's boundary.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import comb
from typing import Any

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.linear.arx import UnderdeterminedError, regression
from pamsim.linear.separable_fit import Separable
from pamsim.linear.signal_record import SignalRecord

FloatArray = NDArray[np.float64]
_lfilter: Any = scipy.signal.lfilter

_ROUNDS = 8
_LAGS = 5


def oe_problem(records: Sequence[SignalRecord], *, nb: int, nf: int, nk: int) -> Separable:
    """Return the least-squares problem of output error: x as :func:`from_differences` has F.

    Args:
        records: the trials, all with one sample time.
        nb: number of input coefficients.
        nf: number of poles.
        nk: delay [samples].

    Returns:
        The problem; theta is b1..bnb.
    """
    inputs = [record.input - record.input[0] for record in records]
    constant, slopes = from_differences(nf)

    def shared(x: FloatArray, i: int) -> FloatArray:
        with np.errstate(over="ignore", invalid="ignore"):
            through = _lfilter([1.0], np.append(1.0, constant + slopes @ x), inputs[i])
        n = through.size
        delayed = np.concatenate([np.zeros(nk + nb - 1), through])
        return np.column_stack([delayed[nb - 1 - j : nb - 1 - j + n] for j in range(nb)])

    return Separable(
        outputs=tuple(record.output for record in records),
        shared=shared,
        own=lambda _, i: np.ones((records[i].output.size, 1)),
        lower=np.full(nf, -np.inf),
        upper=np.full(nf, np.inf),
    )


def stacked_least_squares(
    pairs: Sequence[tuple[FloatArray, FloatArray]], na: int, nb: int, nk: int
) -> tuple[FloatArray, FloatArray, list[FloatArray]]:
    """Return theta, ``(phi^T phi)^-1`` and residuals; each trial's mean takes up its offset."""
    blocks = [regression(y, u, na=na, nb=nb, delay=nk) for y, u in pairs]
    centred = [(phi - phi.mean(axis=0), y - y.mean()) for phi, y in blocks]
    design = np.concatenate([phi for phi, _ in centred])
    target = np.concatenate([y for _, y in centred])
    norms = np.linalg.norm(design, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    orthogonal, triangle = np.linalg.qr(design / scale)
    left, singular, vt = np.linalg.svd(triangle)
    if singular[-1] <= design.shape[0] * np.finfo(float).eps * singular[0]:
        raise UnderdeterminedError(
            f"records do not determine ARX na={na}, nb={nb}: directions are not excited; give an "
            "input that changes more often, or lower the order"
        )
    half = vt.T / singular / scale[:, np.newaxis]
    theta = half @ (left.T @ (orthogonal.T @ target))
    return theta, half @ half.T, [y - phi @ theta for phi, y in centred]


def search_starts(
    trials: Sequence[SignalRecord], interval: float, nb: int, nf: int, nk: int
) -> list[FloatArray]:
    """Return F's coefficients f1..fnf from which the search starts."""
    found: list[FloatArray] = []
    raw = [(r.output - r.output[0], r.input - r.input[0]) for r in trials]
    pairs = raw
    for _ in range(_ROUNDS):
        try:
            f = _inside(stacked_least_squares(pairs, nf, nb, nk)[0][:nf])
        except InputError:
            break
        found.append(f)
        pairs = [
            tuple(_lfilter([1.0], np.append(1.0, f), signal) for signal in pair) for pair in raw
        ]
    longest = max(record.duration for record in trials)
    lags = np.geomspace(3.0 * interval, max(0.3 * longest, 30.0 * interval), max(_LAGS, nf + 1))
    for constants in combinations(lags, nf):
        grid: Any = np.poly(np.exp(-interval / np.array(constants)))
        found.append(grid[1:])
    return found


def _inside(f: FloatArray) -> FloatArray:
    """Mirror poles on or outside the unit circle to its inside."""
    poles = np.roots(np.append(1.0, f))
    size = np.abs(poles)
    mirrored: Any = np.poly(np.where(size < 1.0, poles, 0.999 * poles / size**2))
    return np.real(mirrored)[1:]


def from_differences(nf: int) -> tuple[FloatArray, FloatArray]:
    """Return c, M of ``f = c + M x``, x the first coefficients of F in powers of ``1 - 1/q``.

    Args:
        nf: number of poles.

    Returns:
        Shapes ``(nf,)`` and ``(nf, nf)``.

    Of a system sampled fast all poles are near 1 and f1..fnf nearly cancel; x do not.
    """
    powers = np.array([[(-1) ** j * comb(i, j) for i in range(nf + 1)] for j in range(1, nf + 1)])
    # F's leading 1 fixes the last coefficient: they sum to 1.
    last = powers[:, -1].astype(np.float64)
    return last, powers[:, :-1] - last[:, np.newaxis]
