"""Where a model misses, in the units of the result: maps and regions."""

from __future__ import annotations

from pamsim.core.units import DEG_PER_RAD, MM_PER_M, PA_PER_KPA
from pamsim.diagnosis.method.where import ResidualMap
from pamsim.diagnosis.result import MapEntry, Region

_QUANTITIES = {
    "common_pressure": ("kPa", 1.0 / PA_PER_KPA),
    "pressure_difference": ("kPa", 1.0 / PA_PER_KPA),
    "angle": ("deg", DEG_PER_RAD),
    "speed": ("deg/s", DEG_PER_RAD),
    "position": ("mm", MM_PER_M),
    "sliding_speed": ("mm/s", MM_PER_M),
    "load": ("kg", 1.0),
    "direction": ("1", 1.0),
}
"""Unit in which a map's quantity is written, and the factor on SI; seconds if left out. Quantities
of a named joint, such as ``knee.speed``, end in these."""


def map_entry(residual_map: ResidualMap, mean_unit: str, scale: float) -> MapEntry:
    """A map as it is written.

    Args:
        residual_map: of rows.
        mean_unit: of the residual in the result.
        scale: its factor on the unit of the map.
    """
    unit, quantity_scale = _unit(residual_map)
    rms = residual_map.rms
    return MapEntry(
        channel=residual_map.channel,
        quantity=residual_map.quantity,
        unit=unit,
        edges=residual_map.edges * quantity_scale,
        mean=residual_map.mean * scale,
        mean_unit=mean_unit,
        p_value=residual_map.p_value,
        rows=residual_map.rows,
        rms=None if rms is None else rms * scale,
    )


def region(residual_map: ResidualMap) -> Region:
    """The bin of a map that is off most."""
    unit, scale = _unit(residual_map)
    low, high = residual_map.region
    return Region(
        quantity=residual_map.quantity,
        low=low * scale,
        high=high * scale,
        unit=unit,
        p_value=residual_map.p_value,
        rows=residual_map.rows[residual_map.worst] if residual_map.rows else (),
    )


def _unit(residual_map: ResidualMap) -> tuple[str, float]:
    return _QUANTITIES.get(residual_map.quantity.rpartition(".")[2], ("s", 1.0))
