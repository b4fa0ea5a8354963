"""Predict every row of a table from a fit that has not seen it.

Rows have no order in time and no repeats: each is its own trial, and leaving one out at a time is
all the holding out that there can be.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.optimize
from scipy.stats import t as student

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.row_fit import RowFit, RowSimulator
from pamsim.inference.free_parameter import SearchScale
from pamsim.inference.leave_one_out import LeftOut, refits_without

# scipy carries no types: what it returns is Any at this file's boundary.
_bounded_linear: Any = scipy.optimize.lsq_linear

_BLIND = 1e-9  # rad per range: a parameter that moves no row
_ROUNDS = 6  # of a refit without a row
_SETTLED = 1e-4  # change of a place in its range that ends it


def linearised_left_out(fit: RowFit) -> FloatArray:
    """Errors at unseen rows from the fit's own Jacobian, without another prediction, (n,) [SI].

    Each row's refit is the bounded linear problem of the other rows.
    """
    place, count = fit.place, fit.residual.size
    errors = fit.residual.copy()
    for i in range(count):
        keep = np.arange(count) != i
        step = _bounded_step(fit.jacobian[keep], fit.residual[keep], place)
        errors[i] += float(fit.jacobian[i] @ step)
    return errors


def linearised_reach95(fit: RowFit) -> FloatArray:
    """Half widths of the parameters' intervals from the fit's own Jacobian, (p,) [SI].

    They take the rows' errors as independent, with one variance; infinite for parameters that
    move no row.
    """
    count, free = fit.jacobian.shape
    variance = float(fit.residual @ fit.residual) / max(count - free, 1)
    covariance = np.linalg.pinv(fit.jacobian.T @ fit.jacobian, rcond=1e-12) * variance
    reach = float(student.ppf(0.975, max(count - free, 1))) * np.sqrt(np.diag(covariance))
    blind = np.linalg.norm(fit.jacobian, axis=0) < _BLIND
    return np.where(blind, np.inf, reach * SearchScale(fit.parameters).slope(fit.place))


def left_out(simulator: RowSimulator, fit: RowFit) -> LeftOut:
    """Refit without each row in turn, all refits predicted in one call per round.

    Every refit is a Gauss-Newton iteration within the ranges, with the Jacobian of the common
    optimum, which is close to its own.

    Args:
        simulator: of the rows.
        fit: to all of them.

    Raises:
        InputError: if the rows are too few, or a refit leaves what can be predicted.
    """
    count, free = fit.jacobian.shape
    if count <= free + 1:
        raise InputError(f"{count} rows less one do not determine {free} parameters")
    if free == 0:
        return LeftOut(
            residual=fit.residual, values=np.empty((count, 0)), evaluations=0, settled=0.0
        )
    names = [p.name for p in fit.parameters]

    def step(i: int, residual: FloatArray, place: FloatArray) -> FloatArray:
        keep = np.arange(count) != i
        return place + _bounded_step(fit.jacobian[keep], residual[keep], place)

    def predict(values: FloatArray) -> list[FloatArray | None]:
        return simulator.many([dict(zip(names, v, strict=True)) for v in values.tolist()])

    return refits_without(
        fit.place,
        fit.residual,
        step,
        predict,
        SearchScale(fit.parameters),
        tolerance=_SETTLED,
        most=_ROUNDS,
    )


def _bounded_step(jacobian: FloatArray, residual: FloatArray, place: FloatArray) -> FloatArray:
    """Step that least squares take from a place, to no place outside 0 ... 1, (p,)."""
    free: FloatArray = np.asarray(np.linalg.lstsq(jacobian, -residual, rcond=None)[0], dtype=float)
    if np.all((place + free >= 0.0) & (place + free <= 1.0)):
        return free
    ends = (np.minimum(-place, -1e-12), np.maximum(1.0 - place, 1e-12))
    return _bounded_linear(jacobian, -residual, bounds=ends, method="bvls").x
