"""The numbers that a user reads of a fit: gains, time constants, zeros, dead times, intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure, Structure
from pamsim.identification.optimum import Optimum
from pamsim.inference.estimate import Estimate, Interval


def estimates_of(
    structure: Structure,
    at: Optimum,
    unit_output: str = "-",
    units_input: Sequence[str] = ("-",),
    latest: Mapping[int, float] | None = None,
) -> tuple[Estimate, ...]:
    """Return the user's parameters with 95 % intervals.

    Of a continuous model K, time constants or (wn, zeta), zeros and dead times. Of several inputs
    K, zeros and dead time carry the input's number: ``K[1]``. Of an integrating model K is the gain
    from the input to the output's rate (or its rate), and ``u0`` the input at which the output does
    not run away; of several inputs ``r0`` is that rate where all are 0.

    Of a discrete model K, the time constants if all poles are those of lags, a1..., b1....

    Intervals of positive parameters are symmetric in the logarithm. ``latest`` holds the upper ends
    of the intervals of dead times that were estimated as 0 and held there, by input [s]: 0 where
    the output leads the input.
    """
    if isinstance(structure, ContinuousStructure):
        return _of_continuous(structure, at, unit_output, units_input, latest or {})
    return _of_discrete(structure, at, _per(unit_output, units_input[0]))


def _per(unit_output: str, unit_input: str) -> str:
    """Unit of a gain."""
    return "-" if unit_output == unit_input == "-" else f"{unit_output}/{unit_input}"


def _of_continuous(
    structure: ContinuousStructure,
    at: Optimum,
    unit_output: str,
    units_input: Sequence[str],
    latest_dead_times: Mapping[int, float],
) -> tuple[Estimate, ...]:
    """Gain, time constants or (wn, zeta), zeros and dead time."""
    x = at.coordinates
    numbers = [f"[{i + 1}]" for i in range(structure.inputs)] if structure.inputs > 1 else [""]
    firsts = [structure.coefficients(i).start for i in range(structure.inputs)]
    per_time = ("", "/s", "/s^2")[structure.integrators]
    result: list[Estimate] = []
    for number, first, unit in zip(numbers, firsts, units_input, strict=True):
        unit_gain = _per(unit_output, unit) + per_time
        result.append(at.estimate(f"K{number}", unit_gain, float(x[first]), at.unit(first)))
    for name, unit, i in pole_names(structure, x):
        result.append(at.estimate(name, unit, float(np.exp(x[i])), at.unit(i), positive=True))
    for number, first, zeros in zip(numbers, firsts, structure.numerator_zeros, strict=True):
        for power in range(1, zeros + 1):
            name = "Tz" if zeros == 1 else f"c{power}"
            unit = "s" if power == 1 else f"s^{power}"
            result.append(at.estimate(name + number, unit, *at.ratio(first + power, first)))
    if structure.biased:
        last = x.size - 1
        if structure.inputs > 1:
            unit = unit_output + per_time
            result.append(at.estimate("r0", unit, float(x[last]), at.unit(last)))
        else:
            ratio, gradient = at.ratio(last, firsts[0])
            result.append(at.estimate("u0", units_input[0], -ratio, -gradient))
    delays = structure.delays(x)
    for place, i in enumerate(structure.delayed, start=structure.order):
        delay, half = float(delays[i]), at.half_width(at.unit(place))
        sides: Interval | None = None
        if i in latest_dead_times:
            sides = (0.0, latest_dead_times[i])
        elif half is not None:
            sides = (max(delay - half, 0.0), delay + half)
        result.append(Estimate(name=f"L{numbers[i]}", unit="s", value=delay, interval95=sides))
    return tuple(result)


def _of_discrete(
    structure: DiscreteStructure, searched: Optimum, unit_gain: str
) -> tuple[Estimate, ...]:
    """K, the time constants if all poles are those of lags, a1..., b1...."""
    na, nb = structure.na, structure.nb
    origin, matrix = structure.from_differences()
    to_a = np.eye(na + nb)
    to_a[:na, :na] = matrix
    at = searched.moved(np.append(origin, np.zeros(nb)), to_a)
    a, b = np.split(at.coordinates, [na])
    static, gain = 1.0 + float(np.sum(a)), float(structure.static_gains(searched.coordinates)[0])
    if np.isfinite(gain):
        gradient = np.concatenate([np.full(na, -gain / static), np.full(nb, 1.0 / static)])
        result = [at.estimate("K", unit_gain, gain, gradient)]
    else:
        result = [Estimate(name="K", unit=unit_gain, value=gain, interval95=None)]
    poles = structure.poles(searched.coordinates)
    lags = all(z.imag == 0.0 and 0.0 < z.real < 1.0 for z in poles)
    if lags and len(set(poles)) == na:
        below = np.append(1.0, a)
        for k, z in enumerate(sorted(z.real for z in poles)):
            # d ln T / dz = -1 / (z ln z), and A(z) = 0 gives dz/da.
            to_pole = -(z ** np.arange(na - 1, -1, -1)) / np.polyval(np.polyder(below), z)
            gradient = np.concatenate([-to_pole / (z * np.log(z)), np.zeros(nb)])
            constant = -structure.sample_time / float(np.log(z))
            name = f"T{k + 1}" if na > 1 else "T"
            result.append(at.estimate(name, "s", constant, gradient, positive=True))
    result += [at.estimate(f"a{i + 1}", "-", float(a[i]), at.unit(i)) for i in range(na)]
    result += [at.estimate(f"b{i + 1}", unit_gain, float(b[i]), at.unit(na + i)) for i in range(nb)]
    return tuple(result)


def pole_names(structure: ContinuousStructure, x: FloatArray) -> list[tuple[str, str, int]]:
    """Return name, unit and coordinate of each pole parameter; lags rise, pairs by rising wn."""
    pairs = sorted(range(structure.pairs), key=lambda pair: float(x[2 * pair]))
    number = [str(k + 1) if structure.pairs > 1 else "" for k in range(structure.pairs)]
    result: list[tuple[str, str, int]] = []
    for suffix, pair in zip(number, pairs, strict=True):
        result += [(f"wn{suffix}", "rad/s", 2 * pair), (f"zeta{suffix}", "-", 2 * pair + 1)]
    lags = sorted(range(2 * structure.pairs, structure.order), key=lambda i: float(x[i]))
    for k, i in enumerate(lags):
        result.append((f"T{k + 1}" if len(lags) > 1 else "T", "s", i))
    return result
