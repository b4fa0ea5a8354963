"""What a diagnosis shows of the signals, as JSON entries: where, gap, loops, lines, regimes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from pamsim.comparison.compared_signal import shown_unit
from pamsim.comparison.readable_unit import readable, readable_unit
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.diagnosis.method.gap import ChannelGap, Level
from pamsim.diagnosis.method.loops import PRESSURE, DrivenCycle
from pamsim.diagnosis.method.regimes import Regime
from pamsim.diagnosis.method.spectrum_split import SpectrumSplit
from pamsim.diagnosis.method.where import Cell, Map
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter

SURE_MAP = 0.05
"""p-value up to which a map tells where a channel misses."""

_QUANTITIES = {
    "common_pressure": ("kPa", 1.0 / PA_PER_KPA),
    "pressure_difference": ("kPa", 1.0 / PA_PER_KPA),
    "angle": ("deg", DEG_PER_RAD),
    "speed": ("deg/s", DEG_PER_RAD),
    "direction": ("1", 1.0),
}
"""Unit in which a map's quantity is written, and the factor on SI; seconds if left out."""


def cell_entries(cells: Sequence[Cell], maps: Sequence[Map]) -> list[dict[str, Any]]:
    """Excess of channels and protocols, each with the region that the channel's surest map tells.

    Args:
        cells: excess over the noise floor.
        maps: the surest first; none leaves the regions out.
    """
    regions: dict[str, dict[str, Any]] = {}
    for one in maps:
        if one.p_value <= SURE_MAP and one.channel not in regions:
            unit, scale = _quantity(one.quantity)
            low, high = one.region
            regions[one.channel] = {
                "quantity": one.quantity,
                "low": low * scale,
                "high": high * scale,
                "unit": unit,
                "p_value": one.p_value,
            }
    return [{**asdict(cell), "region": regions.get(cell.channel)} for cell in cells]


def map_entries(maps: Sequence[Map]) -> list[dict[str, Any]]:
    """Mean residuals over bins; None for an empty bin."""
    entries: list[dict[str, Any]] = []
    for one in maps:
        unit, scale = _quantity(one.quantity)
        entries.append(
            {
                "channel": one.channel,
                "quantity": one.quantity,
                "unit": unit,
                "edges": (one.edges * scale).tolist(),
                "mean_in_noise": [float(m) if np.isfinite(m) else None for m in one.mean],
                "p_value": one.p_value,
            }
        )
    return entries


def gap_entries(gaps: Sequence[ChannelGap]) -> dict[str, Any]:
    """Channel -> floor, before and after, in the written unit."""

    def level(found: Level | None, scale: float) -> dict[str, Any] | None:
        if found is None:
            return None
        ends = found.interval95
        return {
            "value": found.value * scale,
            "interval95": None if ends is None else [end * scale for end in ends],
            "value_si": found.value,
        }

    entries: dict[str, Any] = {}
    for gap in gaps:
        unit, scale = shown_unit(gap.channel)
        entries[gap.channel] = {
            "unit": unit,
            "floor": level(gap.floor, scale),
            "before": level(gap.before, scale),
            "after": level(gap.after, scale),
        }
    return entries


def loop_entries(loops: Sequence[DrivenCycle]) -> list[dict[str, Any]]:
    """Loops as means over the repeats of a protocol, with the spread of the measured ones."""
    groups: dict[tuple[str, str, int], list[DrivenCycle]] = {}
    for loop in loops:
        groups.setdefault((loop.drive, loop.protocol, loop.cycle), []).append(loop)
    entries: list[dict[str, Any]] = []
    for (drive, protocol, cycle), members in groups.items():
        pressure = drive == PRESSURE
        scale = DEG_PER_RAD / (PA_PER_KPA if pressure else 1.0)

        def mean(
            of: Callable[[DrivenCycle], float], members: Sequence[DrivenCycle] = members
        ) -> float:
            return float(np.mean([of(member) for member in members]))

        areas = [member.measured * scale for member in members]
        repaired = [m.after * scale for m in members if m.after is not None]
        entries.append(
            {
                "drive": f"{drive}_difference",
                "protocol": protocol,
                "cycle": cycle,
                "repeats": len(members),
                "amplitude_deg": mean(lambda m: m.amplitude) * DEG_PER_RAD,
                "common_pressure_kpa": mean(lambda m: m.common_pressure) / PA_PER_KPA,
                "period_s": mean(lambda m: m.period),
                "unit": "kPa*deg" if pressure else "N*deg",
                "measured": float(np.mean(areas)),
                "spread": float(np.std(areas, ddof=1)) if len(areas) > 1 else None,
                "before": mean(lambda m: m.before) * scale,
                "after": float(np.mean(repaired)) if repaired else None,
            }
        )
    return entries


def spectrum_entries(
    before: Sequence[SpectrumSplit], after: Sequence[SpectrumSplit]
) -> list[dict[str, Any]]:
    """Residuals of periodic protocols by lines, in the written unit, before and after."""
    repaired = {(one.protocol, one.channel): one for one in after}

    def levels(split: SpectrumSplit | None, scale: float) -> dict[str, Any] | None:
        if split is None:
            return None
        names = ("mean", "excited", "even", "odd", "noise")
        values = {name: getattr(split, name) for name in names}
        return {name: None if v is None else v * scale for name, v in values.items()}

    entries: list[dict[str, Any]] = []
    for split in before:
        unit, scale = shown_unit(split.channel)
        entries.append(
            {
                "protocol": split.protocol,
                "channel": split.channel,
                "unit": unit,
                "period_s": split.period,
                "segments": split.segments,
                "before": levels(split, scale),
                "after": levels(repaired.get((split.protocol, split.channel)), scale),
            }
        )
    return entries


def regime_entries(rig: Rig, regimes: Sequence[Regime]) -> list[dict[str, Any]]:
    """Ordinary parameters fitted to each protocol by itself, in the unit of the rig's file."""
    entries: list[dict[str, Any]] = []
    for regime in regimes:
        parameter = rig_parameter(rig, regime.parameter)
        entries.append(
            {
                "parameter": regime.parameter,
                "unit": readable_unit(parameter),
                "p_value": regime.p_value,
                "values": {
                    protocol: {
                        "value": readable(parameter, value),
                        "interval95": [readable(parameter, low), readable(parameter, high)],
                    }
                    for protocol, (value, low, high) in regime.values.items()
                },
            }
        )
    return entries


def _quantity(name: str) -> tuple[str, float]:
    return _QUANTITIES.get(name, ("s", 1.0))
