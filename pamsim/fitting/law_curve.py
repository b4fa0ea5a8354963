"""A force law as a curve to be fitted to a map: which law, its coefficients, its forces."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping

import numpy as np

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import specs
from pamsim.core.units import FloatArray
from pamsim.fitting.held_out import Rows
from pamsim.inference.coefficient import Coefficient
from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.recordings.measured_table import ForceMap

_NO_TENSION = {
    "elastic_energy": "counts from a working point: it gives no tension that a force map could show"
}
_PRESSURES, _CONTRACTIONS = np.linspace(1e5, 6e5, 5), np.linspace(0.05, 0.2, 6)
"""Where muscles usually work [Pa, -]."""

_TINY = 1e-9  # an open lower bound, as a share of the range


def named_law(model: str) -> ForceLaw:
    """The force law of a name; InputError with the nearest if there is none."""
    if model not in FORCE_LAWS:
        raise InputError(f"no force law {model!r}; {nearest(model, FORCE_LAWS)}")
    return FORCE_LAWS[model]


def unsuitable(law: ForceLaw, table: ForceMap) -> str:
    """Why a law cannot describe a map; empty if it can."""
    if law.name in _NO_TENSION:
        return _NO_TENSION[law.name]
    if law.pushes and np.max(table.force) > 0.0:
        return "pushes, and the forces of the map pull"
    if law.pressure_range is None and np.ptp(table.pressure) > 0.01 * np.max(table.pressure):
        return "holds at one pressure, the map has several"
    return ""


def law_coefficients(
    law: ForceLaw, braid: Braid, held: Mapping[str, float]
) -> tuple[Coefficient, ...]:
    """Ranges, neutral and held values of the coefficients of a law.

    The scale is held at 1 where other coefficients have the same effect: it is redundant there.

    Raises:
        InputError: for a held name that the law does not have, or a held value out of range.
    """
    fields = dict(specs(law.group))
    for name in held:
        if name not in fields:
            raise InputError(f"{law.name} has no coefficient {name!r}; {nearest(name, fields)}")
    result: list[Coefficient] = []
    for name, spec in fields.items():
        low = spec.low + _TINY * (spec.high - spec.low) if spec.low_open else spec.low
        value = held.get(name)
        if value is not None and not low <= value <= spec.high:
            raise InputError(f"`held` {name} = {value:g} is outside {spec.range_text()}")
        result.append(
            Coefficient(
                name=name,
                unit=spec.unit,
                low=low,
                high=spec.high,
                default=spec.default,
                held=value,
            )
        )
    if "scale" not in held and _scale_is_redundant(law, braid, result):
        result[0] = dataclasses.replace(result[0], held=1.0)
    return tuple(result)


def law_curve(
    law: ForceLaw, table: ForceMap, braid: Braid, rows: Rows
) -> Callable[[FloatArray], FloatArray]:
    """The force at some points (m,) of a map as a function of the law's coefficients.

    It takes all coefficients (k,) [SI] and gives forces (m,) [N]; NaN where the law has none.
    """
    points = list(zip(table.pressure[rows].tolist(), table.contraction[rows].tolist(), strict=True))
    geometry = [float(getattr(braid, name)) for name in law.braid_fields]

    def force(pressure: float, contraction: float, numbers: list[float]) -> float:
        # As ForceLaw.force, but without reading the braid again at each of a million points.
        try:
            return numbers[0] * law.force_function(pressure, contraction, *numbers[1:])
        except (OverflowError, ZeroDivisionError, ValueError):
            return math.nan  # scalar laws raise where arrays would give inf or NaN

    def curve(values: FloatArray) -> FloatArray:
        numbers = [*values.tolist(), *geometry]
        return np.array([force(p, k, numbers) for p, k in points])

    return curve


def _scale_is_redundant(law: ForceLaw, braid: Braid, coefficients: list[Coefficient]) -> bool:
    """Whether the scale's sensitivity lies in the span of the others'.

    Checked on a grid of its own, since the redundancy is the law's, not the data's.
    """
    if coefficients[0].name != "scale" or len(coefficients) == 1:
        return False
    pressure, contraction = (x.ravel() for x in np.meshgrid(_PRESSURES, _CONTRACTIONS))
    grid = ForceMap(
        pressure=pressure, contraction=contraction, force=0.0 * pressure, nominal_length=None
    )
    curve = law_curve(law, grid, braid, np.arange(pressure.size))
    rng = np.random.default_rng(3)
    for _ in range(5):
        place = np.array([c.low + rng.uniform(0.3, 0.7) * (c.high - c.low) for c in coefficients])
        place[0] = 1.0
        columns: list[FloatArray] = []
        for i, c in enumerate(coefficients):
            step = np.zeros(place.size)
            step[i] = 1e-5 * (c.high - c.low)
            columns.append((curve(place + step) - curve(place - step)) / step[i])
        matrix = np.stack(columns, axis=1)
        if not np.all(np.isfinite(matrix)):
            continue
        norms = np.linalg.norm(matrix, axis=0)
        if norms[0] == 0.0:
            continue
        rest_of_law = matrix[:, 1:] / np.where(norms[1:] > 0.0, norms[1:], 1.0)
        target = matrix[:, 0] / norms[0]
        rest = target - rest_of_law @ np.linalg.lstsq(rest_of_law, target, rcond=1e-10)[0]
        return float(np.linalg.norm(rest)) < 1e-5
    return False
