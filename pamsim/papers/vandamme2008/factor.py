"""Van Damme 2008, sections III.D and III.E: the relative error (6) and the force (7)."""

from __future__ import annotations

import functools

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.papers.claim import AGREES, Order, Recomputed, agreeing, printed_values, recomputes
from pamsim.papers.vandamme2008.numbers import (
    PERCENT,
    largest,
    length,
    pressures,
    value,
)
from pamsim.papers.vandamme2008.preisach import output, relay_history, weight_table
from pamsim.physics.force_laws.pleated import SLENDERNESS_6, pleated_function


@functools.cache
def path() -> FloatArray:
    """Contractions of the generated record [-]."""
    turns = [0.05, 0.35, 0.05, 0.35, 0.1, 0.3, 0.12, 0.25, 0.07, 0.2, 0.07, 0.2]
    return np.interp(np.linspace(0.0, len(turns) - 1, 300), np.arange(len(turns)), turns)


def scaled(contraction: FloatArray) -> FloatArray:
    """Scaled contraction eps_s of (6) [-]."""
    return 2.0 * contraction / largest() - 1.0


@functools.cache
def history() -> FloatArray:
    """Outputs of the relays along the generated record, from -1 to 1."""
    return relay_history(scaled(path()))


@functools.cache
def _major() -> tuple[FloatArray, FloatArray]:
    """Input and relays of one major loop, both branches."""
    rise = np.linspace(-1.0, 1.0, 121)
    u = np.concatenate([[1.0, -1.1], rise, rise[::-1]])
    return u[2:], relay_history(u)[2:]


def relative_error(values: FloatArray, relays: FloatArray, u: FloatArray) -> FloatArray:
    """Relative error (6) [-].

    Args:
        values: delta, c and d [-].
        relays: from `relay_history`.
        u: scaled contraction along the same path [-].
    """
    weights = weight_table(float(values[1]), float(values[2]))
    u_major, major = _major()
    slope, start = np.polyfit(u_major, output(major, weights), 1)
    return values[0] * (output(relays, weights) - (slope * u + start))


def printed_parameters(fibres: int) -> FloatArray:
    """Printed delta, c and d of the muscle with 40 or 25 fibres [-]."""
    return np.array([value(f"delta_{fibres}"), value("weight_c"), value("weight_d")])


def static() -> FloatArray:
    """Force function (2) along the generated record [-], f0 to f4 from the exact shape."""
    law = SLENDERNESS_6
    return np.array(
        [pleated_function(eps, law.f0, law.f1, law.f2, law.f3, law.f4) for eps in path().tolist()]
    )


def force(fibres: int, pressure: float) -> FloatArray:
    """Force (7) along the record [N]."""
    error = relative_error(printed_parameters(fibres), history(), scaled(path()))
    return pressure * length() ** 2 * static() * (1.0 + error)


@recomputes("vandamme2008-17")
def _mapping() -> Recomputed:
    ends = scaled(np.array([0.0, largest()]))
    return Recomputed(ends.tolist(), **agreeing(-1.0, 1.0))


@recomputes("vandamme2008-18")
def _line() -> Recomputed:
    u, major = _major()
    w = output(major, weight_table(value("weight_c"), value("weight_d")))
    slope, start = np.polyfit(u, w, 1)
    return Recomputed((float(slope), float(start)))


@recomputes("vandamme2008-19")
def _loses_energy() -> Recomputed:
    u, major = _major()
    error = relative_error(printed_parameters(40), major, u)
    half = len(u) // 2
    gap = error[half:][::-1] - error[:half]
    return Recomputed(
        (float(gap.min()), float(gap.max())),
        low=(-AGREES, AGREES),
    )


@recomputes("vandamme2008-20")
def _pressure_independent() -> Recomputed:
    loops = [force(40, p) / (p * length() ** 2) for p in pressures()]
    spread = max(float(np.max(np.abs(loop / loops[0] - 1.0))) for loop in loops)
    return Recomputed(spread, high=AGREES)


def _width(fibres: int) -> float:
    """Largest gap between the branches of e over the major loop [%]."""
    u, major = _major()
    error = relative_error(printed_parameters(fibres), major, u)
    half = len(u) // 2
    return float(np.max(error[half:][::-1] - error[:half])) / PERCENT


@recomputes("vandamme2008-21")
def _less_pronounced() -> Recomputed:
    wide, narrow = _width(40), _width(25)
    return Recomputed((narrow, wide), order=Order.RISING, factor=wide / narrow)


@recomputes("vandamme2008-22")
def _good_range() -> Recomputed:
    low, high = (number * PERCENT for number in printed_values("vandamme2008", "good_range"))
    inside = (path() >= low) & (path() <= high)
    error = relative_error(printed_parameters(40), history(), scaled(path()))[inside]
    return Recomputed((float(np.min(error)) / PERCENT, float(np.max(error)) / PERCENT))
