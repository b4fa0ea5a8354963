"""Where the searches of fits begin: poles and dead times for every structure and kind of data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, product
from typing import Any

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure, Structure
from pamsim.identification.held_input import chain_derivatives, chain_modes
from pamsim.identification.records import (
    Data,
    FrequencyRecord,
    SignalRecord,
    growing_parts,
    shows,
    time_range,
)
from pamsim.identification.separable import column_scale, minimise, scaled_solution

_lfilter: Any = scipy.signal.lfilter
_correlate: Any = scipy.signal.correlate

# Counts of start values per pole coordinate: fewer where the combinations multiply.
_LAGS = {0: 1, 1: 12, 2: 8, 3: 7, 4: 6, 5: 6, 6: 6}
_DAMPING = (0.15, 0.5, 1.2)
_DELAYS = 7
_FILTERED = 8  # rounds of Steiglitz and McBride
_DISCRETE_LAGS = 5  # on the grid, as many as there are poles at least
_REWEIGHTED = 6  # rounds of Sanathanan and Koerner
_FAR = 1e3  # a pole at infinity, over the highest frequency
_REAL = 1e-9  # imaginary over absolute value, below which a time constant is real
_ROUNDS = 4  # of instrumental variables, if they do not settle before
_SETTLED = 1e-2  # change of the poles' coordinates that ends the rounds
_FIRST = 3  # time constants that the first filter is tried with
_WIDEST = 30.0  # a time constant at most, in longest records; at least, its inverse in samples


def starts_of(structure: Structure, data: Data) -> list[FloatArray]:
    """Return where to begin the search of a fit, each of shape ``(searched,)``.

    Always the same ones, so that a fit is reproducible. Of long records where the search of a part
    has ended.
    """
    if isinstance(data, FrequencyRecord):
        assert isinstance(structure, ContinuousStructure)
        late = data.dead_times(structure.zeros) if structure.dead_time else np.zeros(1)
        return [_linearised(structure, data, float(delay)) for delay in late]
    if not structure.searched:
        return [np.empty(0)]
    starts: list[FloatArray] = []
    found: list[FloatArray] = []
    for part in growing_parts(data):
        if isinstance(structure, DiscreteStructure):
            starts = _filtered(structure, part)
        else:
            starts = _grid(structure, part)
        # A smaller part may have led past a minimum that this one's starts end in.
        starts = [*found, *starts]
        if part is not data:
            end = minimise(structure.problem(part), starts)
            found = [end.x]
            if shows(part, structure.slowest(end.coordinates)):
                return found
    return starts


def _grid(structure: ContinuousStructure, records: Sequence[SignalRecord]) -> list[FloatArray]:
    shortest, longest = time_range(records)
    logs = np.linspace(np.log(2.0 * shortest), np.log(0.5 * longest), _LAGS[structure.order])
    # Distinct, since the cost has a saddle where time constants are equal.
    poles = [
        (*(v for pair in zip(rates, zetas, strict=True) for v in pair), *lags)
        for rates in combinations(-logs, structure.pairs)
        for zetas in product(np.log(_DAMPING), repeat=structure.pairs)
        for lags in combinations(logs, structure.order - 2 * structure.pairs)
    ]
    if not structure.dead_time:
        return [np.array(p) for p in poles]
    most = 0.25 * min(record.duration for record in records)
    delays = [0.0, *np.geomspace(1.5 * shortest, max(most, 3.0 * shortest), _DELAYS)]
    late = delay_starts(delays, len(structure.delayed))
    if structure.order + structure.integrators == 0:
        late = [*matching_delays(structure, records, most), *late]
    return [np.append(p, delay) for p, delay in product(poles, late)]


def delay_starts(delays: Sequence[float], count: int) -> list[FloatArray]:
    """Return dead times to start a search from: all equal, and one longer than the others.

    Those to try begin with the shortest; each result is of shape ``(count,)`` [s].
    """
    equal = [np.full(count, delay) for delay in delays]
    if count < 2:
        return equal
    return equal + [
        np.where(np.arange(count) == i, delay, delays[0])
        for i in range(count)
        for delay in delays[1:]
    ]


def matching_delays(
    structure: ContinuousStructure, records: Sequence[SignalRecord], most: float
) -> list[FloatArray]:
    """Return dead times up to one [s] with which inputs, or their changes, match the output best.

    A gain has no lag that smooths the cost: that has a minimum, or a step, at every sample. The
    middles of the samples before and after the best match are returned, of the longest record.
    """
    record = max(records, key=lambda each: each.output.size)
    lags = int(most / record.sample_time)
    starts: list[FloatArray] = []
    for change in (0, 1):
        output = np.diff(record.output - np.mean(record.output), n=change)
        best: list[int] = []
        for i in structure.delayed:
            given = np.diff(record.inputs[:, i] - np.mean(record.inputs[:, i]), n=change)
            match = _correlate(output, given, method="fft")[given.size - 1 :]
            best.append(int(np.argmax(np.abs(match[: lags + 1]))))
        middle = (np.array(best) - 0.5) * record.sample_time
        starts += [np.maximum(late, 0.0) for late in (middle, middle + record.sample_time)]
    return starts


def _filtered(structure: DiscreteStructure, records: Sequence[SignalRecord]) -> list[FloatArray]:
    """From ARX, from ARX of what passed 1/A of the round before, and from a grid of lags.

    Source: Steiglitz and McBride, IEEE Trans. Automatic Control 1965.
    """
    na, interval = structure.na, structure.sample_time
    arx = DiscreteStructure("arx", na, structure.nb, structure.nk, interval)
    found: list[FloatArray] = []
    below = np.ones(1)
    for _ in range(_FILTERED):
        filtered = [
            replace(
                record,
                output=_lfilter([1.0], below, record.output - record.output[0]),
                inputs=_lfilter([1.0], below, record.input - record.input[0]),
                held_out=True,
            )
            for record in records
        ]
        theta = arx.problem(filtered).linear_part(np.empty(0)).theta
        if not np.all(np.isfinite(theta)):
            break
        roots = np.roots(np.append(1.0, theta[:na]))
        size = np.abs(roots)
        # Poles on or outside the unit circle are mirrored to its inside.
        mirrored: Any = np.poly(np.where(size < 1.0, roots, 0.999 * roots / size**2))
        below = np.real(mirrored)
        found.append(below[1:])
    _, longest = time_range(records)
    lags = np.geomspace(
        3.0 * interval, max(0.3 * longest, 30.0 * interval), max(_DISCRETE_LAGS, na + 1)
    )
    for constants in combinations(lags, na):
        of_lags: Any = np.poly(np.exp(-interval / np.array(constants)))
        found.append(of_lags[1:])
    origin, matrix = structure.from_differences()
    inverse: Any = np.linalg.inv(matrix)
    return [inverse @ (a - origin) for a in found]


def _linearised(structure: ContinuousStructure, data: FrequencyRecord, delay: float) -> FloatArray:
    """Poles and dead time by the linear problem, unstable poles reflected.

    The error is multiplied by the denominator, which makes it linear, and weighted by that of the
    round before.

    Source: Sanathanan and Koerner, IEEE Trans. Automatic Control 8, 1963.
    """
    w = data.frequency
    scale = float(np.sqrt(w[0] * w[-1]))
    s, target = 1j * w / scale, data.response * np.exp(1j * w * delay)
    above = s[:, np.newaxis] ** np.arange(structure.zeros + 1)
    below = s[:, np.newaxis] ** np.arange(1, structure.order + 1)
    denominator = np.ones(structure.order)
    last = np.ones_like(s)
    for _ in range(_REWEIGHTED):
        weight = (1.0 / np.abs(target * last))[:, np.newaxis]
        design = np.hstack([above, -target[:, np.newaxis] * below]) * weight
        wanted = target * weight[:, 0]
        stacked: Any = np.vstack([design.real, design.imag])
        solved = scaled_solution(stacked, np.append(wanted.real, wanted.imag))
        denominator = solved[structure.zeros + 1 :]
        last = 1.0 + below @ denominator
    roots = scale * np.roots(np.append(denominator[::-1], 1.0))
    roots = np.append(roots, np.full(structure.order - roots.size, -_FAR * w[-1]))
    constants = constants_of_roots(roots, 1.0 / (_FAR * w[-1]), _FAR / w[0])
    if structure.pairs:
        coordinates = pole_coordinates(constants)
    else:  # apart, since the cost has a saddle where time constants are equal
        lags: Any = np.log(np.sort(np.abs(constants)))
        coordinates = 0.05 * np.arange(roots.size) + lags
    return np.append(coordinates, delay) if structure.dead_time else coordinates


def instrumental_variable_starts(
    structure: ContinuousStructure, records: Sequence[SignalRecord]
) -> list[FloatArray]:
    """Return start values of poles for a search, each of shape ``(searched,)``.

    One for each first filter up to the one from which the rounds settle. The structure has any
    stable poles (``real_lags`` False) and no dead time.

    Input and output pass the same filters ``s^k / E(s)``; then the model is linear in its
    coefficients. Regression alone is biased by noise in the output; the output of the last model,
    free of noise, as instrument removes the bias, and E becomes that model's denominator. There are
    no local minima, and there is no grid.

    Source: Young and Jakeman, refined instrumental variables III (International Journal of Control
    31, 1980), with white noise (SRIVC).
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
    theta = structure.problem(records).linear_part(x).theta if instruments else None
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


def pole_coordinates(constants: NDArray[Any] | Sequence[complex]) -> FloatArray:
    """Return ``ln wn, ln zeta`` of each pair, then ``ln T`` of the lag that is left over.

    These are the pole coordinates of a `ContinuousStructure` with any poles. The constants are
    ``-1 / s`` of every pole s, real or in conjugate pairs, real parts > 0 [s].
    """
    values = np.asarray(constants, dtype=complex)
    real = np.abs(np.imag(values)) <= _REAL * np.abs(values)
    oscillating = values[~real & (np.imag(values) > 0.0)]
    lags = np.sort(np.real(values[real]))
    coordinates: list[float] = []
    for constant in oscillating:
        size = abs(constant)
        coordinates += [-np.log(size), np.log(constant.real / size)]
    for fast, slow in lags[: lags.size // 2 * 2].reshape(-1, 2):
        middle = np.sqrt(fast * slow)
        coordinates += [-np.log(middle), np.log(0.5 * (fast + slow) / middle)]
    coordinates += [float(np.log(constant)) for constant in lags[lags.size // 2 * 2 :]]
    return np.array(coordinates)


def constants_of_roots(roots: NDArray[Any], shortest: float, longest: float) -> NDArray[Any]:
    """Return the time constants of poles [rad/s], unstable ones mirrored, within a range [s]."""
    size = np.clip(np.abs(roots), 1.0 / longest, 1.0 / shortest)
    angle = np.angle(np.where(roots == 0.0, -1.0, roots))
    # Mirrored at the imaginary axis, and away from it, where the damping would be 0.
    away = np.clip(np.abs(angle), 0.5 * np.pi + 1e-2, np.pi)
    return np.exp(-1j * np.sign(angle) * (np.pi - away)) / size
