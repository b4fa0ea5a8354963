"""Start values of a fit's poles by refined instrumental variables: no local minima, no grid.

Input and output pass the same filters ``s^k / E(s)``; then the model is linear in its coefficients.
Regression alone is biased by noise in the output; the output of the last model, free of noise, as
instrument removes the bias, and E becomes that model's denominator.
Source: Young and Jakeman, refined instrumental variables III (International Journal of Control 31,
1980), with white noise (SRIVC).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.identification.continuous_structure import ContinuousStructure
from pamsim.identification.held_input import chain_derivatives, chain_modes
from pamsim.identification.pole_coordinates import constants_of_roots, pole_coordinates
from pamsim.identification.separable_fit import column_scale
from pamsim.identification.signal_record import SignalRecord, time_range
from pamsim.inference.trial_noise import WHITE

_ROUNDS = 4
_SETTLED = 1e-2  # change of the poles' coordinates that ends the rounds
_FIRST = 3  # time constants that the first filter is tried with
_WIDEST = 30.0  # a time constant at most, in longest records; at least, its inverse in samples


def instrumental_variable_starts(
    structure: ContinuousStructure, records: Sequence[SignalRecord]
) -> list[FloatArray]:
    """Return start values of poles for a search, each of shape ``(searched,)``.

    One for each first filter up to the one from which the rounds settle. The structure has any
    stable poles (``real_lags`` False) and no dead time.
    """
    shortest, longest = time_range(records)
    starts: list[FloatArray] = []
    for first in np.geomspace(2.0 * shortest, 0.1 * longest, _FIRST):
        spread = first * np.linspace(0.9, 1.1, structure.order)
        x = pole_coordinates(spread)
        for instruments in (False, *[True] * _ROUNDS):
            roots = _poles_by_regression(structure, records, x, instruments)
            if roots is None:
                break
            constants = constants_of_roots(roots, shortest / _WIDEST, longest * _WIDEST)
            before, x = x, pole_coordinates(constants)
            if instruments and np.max(np.abs(x - before), initial=0.0) < _SETTLED:
                return [*starts, x]
        starts.append(x)
    return starts


def _poles_by_regression(
    structure: ContinuousStructure,
    records: Sequence[SignalRecord],
    x: FloatArray,
    instruments: bool,
) -> NDArray[Any] | None:
    """Poles of the model that the filters of these pole coordinates lead to; None on overflow."""
    n, q, zeros = structure.order, structure.integrators, structure.zeros
    given_columns = structure.inputs * (zeros + 1)
    constants = structure.constants(x)
    # As many filters as poles; those of the integrators are as slow as the slowest lag.
    filters = np.append(constants, np.full(q, np.max(np.abs(constants), initial=1.0)))
    theta = structure.problem(records).solved(x, WHITE)[0] if instruments else None
    rows: list[FloatArray] = []
    for record in records:
        span = np.linspace(0.0, 1.0, record.output.size)[:, np.newaxis]

        def derivatives(values: FloatArray, record: SignalRecord = record) -> FloatArray:
            every = chain_derivatives(
                filters, values, record.sample_time, count=n + q + 1, hold="foh"
            )
            return every[:, q:]

        blocks = [
            derivatives(record.output - record.output[0]),
            *(
                chain_derivatives(
                    filters, given - given[0], record.sample_time, count=zeros + 1, hold=hold
                )
                for given, hold in zip(record.inputs.T.copy(), record.holds, strict=True)
            ),
        ]
        if theta is not None:
            blocks.append(derivatives(structure.responses(x, record) @ theta)[:, 1:])
        modes = chain_modes(filters, record.output.size, record.sample_time)
        columns, own = np.hstack(blocks), np.hstack([span ** np.arange(q + 2), modes])
        if not (np.all(np.isfinite(columns)) and np.all(np.isfinite(own))):
            return None
        basis = np.linalg.qr(own)[0]
        rows.append(columns - basis @ (basis.T @ columns))
    table = np.concatenate(rows)
    target, output = table[:, 0], -table[:, 1 : n + 1]
    given = table[:, n + 1 : n + 1 + given_columns]
    regressors = np.hstack([output, given])
    clean = output if theta is None else -table[:, n + 1 + given_columns :]
    seen = np.hstack([clean, given])
    scale = column_scale(regressors)
    seen = seen / column_scale(seen)
    solution: Any = np.linalg.lstsq(seen.T @ (regressors / scale), seen.T @ target, rcond=None)[0]
    denominator = np.append((solution / scale)[:n][::-1], 1.0)
    if not np.all(np.isfinite(denominator)):
        return None
    roots = np.roots(denominator)
    # A leading coefficient of 0 is a pole at infinity.
    return np.append(roots, np.full(n - roots.size, -np.inf))
