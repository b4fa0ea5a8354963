"""What recordings show beside the verdict: noise, lack of fit, hysteresis loops, spectral lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from pamsim.comparison.compared_signal import shown_unit
from pamsim.comparison.readable_unit import readable, readable_interval, readable_unit
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.diagnosis.method.gap import Residuals
from pamsim.diagnosis.method.nuisance_by_protocol import NuisanceByProtocol
from pamsim.diagnosis.method.recorded_loops import PRESSURE, DrivenCycle, Signals, loop_areas
from pamsim.diagnosis.method.screen import Screened, signature_similarity
from pamsim.diagnosis.method.spectrum_split import SpectrumSplit, spectrum_splits
from pamsim.diagnosis.method.trial_diagnosis import TrialDiagnosis
from pamsim.diagnosis.method.where import Cell
from pamsim.diagnosis.result import Details
from pamsim.diagnosis.where_entries import cell_places
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.recordings.trial import Trial


def recordings_details(
    rig: Rig,
    trials: Sequence[Trial],
    method: TrialDiagnosis,
    given: Sequence[Cell],
    before: Signals,
    after: Signals,
    residuals: tuple[Residuals, Residuals],
) -> Details:
    """Write what only recordings show.

    Args:
        rig: without effects.
        trials: as measured.
        method: result of the method.
        given: excess of angle and forces with the arm driven by the measured pressures.
        before: trial -> channel -> (n,) simulated by the refitted base model [SI].
        after: the same by the best model; empty where the verdict repairs nothing.
        residuals: of both [SI].
    """
    lack = method.conclusion.lack
    return Details(
        remainder=method.conclusion.remainder,
        lack_of_fit={
            **asdict(lack),
            "level": lack.level,
            "testable": lack.testable,
            "significant": lack.significant,
        },
        noise_floor=_noise_floor(method),
        where_with_measured_pressures=cell_places(given, ()),
        nuisance_by_protocol=tuple(
            _by_protocol(rig, entry) for entry in method.nuisance_by_protocol
        ),
        loop_areas=_loop_areas(loop_areas(trials, before, after)),
        spectrum=_spectrum(*(spectrum_splits(trials, part) for part in residuals)),
        screened=_screened(method.screened),
    )


def _noise_floor(method: TrialDiagnosis) -> dict[str, Any]:
    channels: dict[str, Any] = {}
    for channel, sd in method.floor.sd.items():
        unit, scale = shown_unit(channel)
        channels[channel] = {"sd": sd * scale, "unit": unit, "sd_si": sd}
    return {
        "channels": channels,
        "repeats": method.floor.repeats,
        "assumed": method.floor.assumed,
        "route": method.floor.route.value,
    }


def _screened(screened: Sequence[Screened]) -> tuple[dict[str, Any], ...]:
    """What the data can show of every effect, before any is fitted."""
    entries: list[dict[str, Any]] = []
    for effect in screened:
        signatures = [trace.signature for trace in effect.traces]
        typical = min(signatures, key=lambda s: abs(s.size - 1.0), default=None)
        others = [(signature_similarity(effect, o), o) for o in screened if o is not effect]
        similarity, near = max(others, key=lambda pair: pair[0], default=(0.0, None))
        entries.append(
            {
                "effect": effect.candidate.name,
                "family": effect.candidate.family,
                "visible": effect.visible,
                "visibility": None if typical is None else typical.visible,
                "explained_by_nuisance": None if typical is None else typical.explained_by_nuisance,
                "similarity": effect.similarity,
                "promised_gain": effect.gain,
                "most_similar": None if near is None else near.candidate.name,
                "similarity_to_it": None if near is None else similarity,
            }
        )
    return tuple(entries)


def _loop_areas(cycles: Sequence[DrivenCycle]) -> tuple[dict[str, Any], ...]:
    """Areas as means over the repeats of a protocol, with the spread of the measured ones."""
    groups: dict[tuple[str, str, int], list[DrivenCycle]] = {}
    for cycle in cycles:
        groups.setdefault((cycle.drive, cycle.protocol, cycle.cycle), []).append(cycle)
    entries: list[dict[str, Any]] = []
    for (drive, protocol, number), members in groups.items():
        scale = DEG_PER_RAD / (PA_PER_KPA if drive == PRESSURE else 1.0)
        areas = [member.measured * scale for member in members]
        repaired = [m.after * scale for m in members if m.after is not None]
        entries.append(
            {
                "drive": f"{drive}_difference",
                "protocol": protocol,
                "cycle": number,
                "repeats": len(members),
                "amplitude_deg": np.mean([m.amplitude for m in members]) * DEG_PER_RAD,
                "common_pressure_kpa": np.mean([m.common_pressure for m in members]) / PA_PER_KPA,
                "period_s": np.mean([m.period for m in members]),
                "unit": "kPa*deg" if drive == PRESSURE else "N*deg",
                "measured": np.mean(areas),
                "spread": np.std(areas, ddof=1) if len(areas) > 1 else None,
                "before": np.mean([m.before for m in members]) * scale,
                "after": np.mean(repaired) if repaired else None,
            }
        )
    return tuple(entries)


def _spectrum(
    before: Sequence[SpectrumSplit], after: Sequence[SpectrumSplit]
) -> tuple[dict[str, Any], ...]:
    """Residuals of periodic protocols by spectral lines, before and after."""
    repaired = {(split.protocol, split.channel): split for split in after}

    def levels(split: SpectrumSplit | None, scale: float) -> dict[str, Any] | None:
        if split is None:
            return None
        values = {
            name: getattr(split, name) for name in ("mean", "excited", "even", "odd", "noise")
        }
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
    return tuple(entries)


def _by_protocol(rig: Rig, entry: NuisanceByProtocol) -> dict[str, Any]:
    """A nuisance parameter fitted to each protocol by itself, in the unit of the rig's file."""
    parameter = rig_parameter(rig, entry.parameter)
    return {
        "parameter": entry.parameter,
        "unit": readable_unit(parameter),
        "p_value": entry.p_value,
        "values": {
            protocol: {
                "value": readable(parameter, value),
                "interval95": readable_interval(parameter, (low, high)),
            }
            for protocol, (value, low, high) in entry.values.items()
        },
    }
