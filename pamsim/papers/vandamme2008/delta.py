"""Van Damme 2008, section III.E: delta, and whether a loop determines delta, c and d."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from pamsim.core.units import FloatArray
from pamsim.papers.claim import Recomputed, printed_number, recomputes
from pamsim.papers.numerics import curve_fit
from pamsim.papers.vandamme2008.factor import (
    force,
    history,
    path,
    printed_parameters,
    relative_error,
    scaled,
    static,
)
from pamsim.papers.vandamme2008.numbers import length, pressures
from pamsim.recordings.printed import Printed

_NOISE = 0.02
"""Of the force, one standard deviation over the force itself."""
_SEEDS = 20
_FAR = np.array([0.2, -0.3, -0.7])
"""Start of a fit of delta, c and d, away from all printed numbers."""


def _fit(measured: FloatArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit delta, c and d to a relative error of the force, and half their 95 % intervals."""
    u = scaled(path())

    values, covariance = curve_fit(
        lambda _, *v: relative_error(np.array(v), history(), u),
        None,
        measured,
        start,
        bounds=([0.0, -1.0, -1.9], [1.0, 0.5, 0.0]),
    )
    return values, stdtrit(measured.size - 3, 0.975) * np.sqrt(np.diag(covariance))


def _measured_ratio(fibres: int) -> FloatArray:
    """f_t0 of the generated record over its fit, at the pressure the paper fits at, 1.5 bar [-]."""
    pressure = pressures()[1]
    return force(fibres, pressure) / (pressure * length() ** 2) / static()


@recomputes("vandamme2008-25")
def _recovered() -> Recomputed:
    planted: list[Printed] = []
    result: list[float] = []
    for fibres in (40, 25):
        names = (f"delta_{fibres}", "weight_c", "weight_d")
        planted += [printed_number("vandamme2008", name) for name in names]
        result += _fit(_measured_ratio(fibres) - 1.0, _FAR)[0].tolist()
    return Recomputed(result, printed=planted)


@recomputes("vandamme2008-26")
def _digits_of_delta() -> Recomputed:
    clean = _measured_ratio(40)
    planted, inside = printed_parameters(40), np.zeros(3)
    half = np.zeros(3)
    for seed in range(_SEEDS):
        noise = np.random.default_rng(seed).standard_normal(clean.size)
        # Started where it ends without noise: vandamme2008-25 shows that a far start leads there.
        values, width = _fit(clean * (1.0 + _NOISE * noise) - 1.0, planted)
        inside += np.abs(values - planted) <= width
        half += width / _SEEDS
    shares = inside / _SEEDS
    digit = printed_number("vandamme2008", "delta_40").half_unit
    return Recomputed(
        float(half[0]),
        high=digit,
        digit=digit,
        noise=100.0 * _NOISE,
        records=_SEEDS,
        covered=", ".join(f"{share:.2f}" for share in shares),
    )
