"""What ``pamsim diagnose`` writes: `diagnosis.json`, and the signals that its page draws."""

from __future__ import annotations

from typing import Any

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.comparison.readable_unit import readable, readable_unit
from pamsim.core.trial import Trial
from pamsim.core.versions import versions
from pamsim.diagnosis.diagnose import DiagnosisReport
from pamsim.diagnosis.experiment_menu import MENU
from pamsim.diagnosis.method.absent import AbsentBound
from pamsim.diagnosis.method.gap import FloatArray, Residuals, gaps
from pamsim.diagnosis.method.lack_of_fit import LackOfFit
from pamsim.diagnosis.method.loops import Signals, loops
from pamsim.diagnosis.method.next_experiment import NextExperiment
from pamsim.diagnosis.method.spectrum_split import spectrum_splits
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.models_as_json import (
    CLAIMING,
    alternative_entries,
    effect_entries,
    finite,
    screened_entries,
    tried_entries,
)
from pamsim.diagnosis.sentence import ratio_to_floor, verdict_sentence
from pamsim.diagnosis.signals_as_json import (
    cell_entries,
    gap_entries,
    loop_entries,
    map_entries,
    regime_entries,
    spectrum_entries,
)
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter

SCHEMA = "pamsim-diagnosis/1"

REPAIRING = (*CLAIMING, Verdict.AMBIGUOUS)
"""Verdicts whose best model closes the gap, whether or not it is the only one that does."""


def diagnosis_dict(report: DiagnosisReport) -> dict[str, Any]:
    """JSON-safe form of a diagnosis; numbers carry their unit, or are SI where the key says so.

    Args:
        report: of the diagnosis.
    """
    found = report.found
    protocol_of = {trial.name: trial.protocol for trial in report.data.trials}
    predicted = _repaired(report)
    before = _residuals(report, report.predictions_before)
    after = _residuals(report, predicted)
    gap = gaps(before, after, found.floor, protocol_of, report.held_out)
    closed = ratio_to_floor(gap, repaired=True) if after else None
    return {
        "schema": SCHEMA,
        "rig": report.rig.name,
        "data": list(report.data.sources),
        "verdict": str(found.named.verdict),
        "sentence": verdict_sentence(report.rig, found, gap),
        "explained": found.named.explained,
        "remainder_in_floors": finite(found.named.remainder),
        "lack_of_fit": _lack(found.named.lack),
        "effects": effect_entries(report.rig, found, protocol_of),
        "alternatives": alternative_entries(report.rig, found, protocol_of),
        "where": cell_entries(found.cells, found.maps),
        "maps": map_entries(found.maps),
        "gap": gap_entries(gap),
        "gap_over_floor": {
            "before": finite(ratio_to_floor(gap, repaired=False)),
            "after": None if closed is None else finite(closed),
        },
        "absent": {bound.effect: _absent(report.rig, bound) for bound in found.absent},
        "next_experiment": _following(found.next_experiment),
        "given": cell_entries(report.given, ()),
        "regimes": regime_entries(report.rig, found.regimes),
        "loops": loop_entries(loops(report.data.trials, report.predictions_before, predicted)),
        "spectrum": spectrum_entries(
            spectrum_splits(report.data.trials, before), spectrum_splits(report.data.trials, after)
        ),
        "screened": screened_entries(found.screened),
        "tried": tried_entries(found),
        "base": _base(report),
        "noise_floor": _floor(report),
        "held_out": list(report.held_out),
        "notes": list(report.notes),
        "skipped": dict(report.skipped),
        "seed": report.seed,
        "rollouts": report.rollouts,
        "parameter_sets": found.evaluations,
        "seconds": report.seconds,
        "versions": versions("scipy"),
        "repaired_rig": None,
    }


def comparisons(report: DiagnosisReport) -> tuple[Comparison, ...]:
    """Every compared channel of every trial beside what the models make of it."""
    after = _repaired(report)
    return tuple(
        Comparison(
            trial=trial.name,
            protocol=trial.protocol,
            channel=channel,
            held_out=trial.name in report.held_out,
            time=trial.time,
            measured=trial.measured[channel],
            before=report.predictions_before[trial.name][channel],
            after=after[trial.name][channel] if after else None,
        )
        for trial in report.data.trials
        for channel in _compared(report, trial)
    )


def _repaired(report: DiagnosisReport) -> Signals:
    """What the best model makes of the trials; nothing where it is no repair, only a likeness."""
    return report.predictions_after if report.found.named.verdict in REPAIRING else {}


def _compared(report: DiagnosisReport, trial: Trial) -> list[str]:
    """Channels of a trial that the diagnosis looked at."""
    return [channel for channel in trial.measured if channel in report.found.floor.sd]


def _residuals(report: DiagnosisReport, predicted: Signals) -> Residuals:
    """Simulated minus measured."""
    found: dict[str, dict[str, FloatArray]] = {}
    for trial in report.data.trials:
        if trial.name in predicted:
            found[trial.name] = {
                channel: predicted[trial.name][channel] - trial.measured[channel]
                for channel in _compared(report, trial)
            }
    return found


def _lack(lack: LackOfFit | None) -> dict[str, Any] | None:
    """What repeats share that the best model does not predict."""
    if lack is None:
        return None
    return {"in_floors": lack.size, "p_value": lack.p_value, "found": lack.found}


def _absent(rig: Rig, bound: AbsentBound) -> dict[str, Any]:
    parameter = rig_parameter(rig, bound.parameter)
    # A distance: what the unit's zero is does not matter.
    away = readable(parameter, bound.limit) - readable(parameter, 0.0)
    return {
        "parameter": bound.parameter,
        "visible": bound.visible,
        "size": finite(bound.size),
        "limit": finite(away),
        "unit": readable_unit(parameter),
        "limit_si": finite(bound.limit),
    }


def _following(chosen: NextExperiment | None) -> dict[str, Any] | None:
    if chosen is None:
        return None
    return {
        "protocol": chosen.protocol,
        "shows": MENU[chosen.protocol].shows,
        "between": list(chosen.between),
        "before": finite(chosen.before),
        "after": finite(chosen.after),
        "menu": {name: finite(distance) for name, distance in chosen.menu.items()},
        "advice": chosen.advice,
    }


def _base(report: DiagnosisReport) -> list[dict[str, Any]]:
    """Ordinary parameters as the rig has them, and as the base and the best model were fitted."""
    best = report.found.named.best
    entries: list[dict[str, Any]] = []
    for name, value in report.found.base.values.items():
        parameter = rig_parameter(report.rig, name)
        repaired = None if best is None else best.fit.values.get(name)
        entries.append(
            {
                "parameter": name,
                "unit": readable_unit(parameter),
                "before": readable(parameter, parameter.value),
                "after": readable(parameter, value),
                "with_effects": None if repaired is None else readable(parameter, repaired),
                "at_bound": name in report.found.base.at_bound,
            }
        )
    return entries


def _floor(report: DiagnosisReport) -> dict[str, Any]:
    floor = report.found.floor
    channels: dict[str, Any] = {}
    for channel, sd in floor.sd.items():
        unit, scale = shown_unit(channel)
        channels[channel] = {"sd": sd * scale, "unit": unit, "sd_si": sd}
    return {"channels": channels, "repeats": floor.repeats, "assumed": floor.assumed}
