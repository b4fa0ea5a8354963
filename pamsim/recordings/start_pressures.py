"""Pressures at which the muscles of a trial rest before it begins."""

from __future__ import annotations

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.recordings.trial import Trial


def start_pressures(trial: Trial) -> FloatArray:
    """Gauge pressures at which the muscles of a trial rest before it begins, shape (m,) [Pa].

    Raises:
        InputError: if one was neither measured nor commanded.
    """
    return np.array([start_pressure(trial, muscle) for muscle in range(trial.muscles)])


def start_pressure(trial: Trial, muscle: int) -> float:
    """The same of one muscle, by its number from 0 [Pa].

    Raises:
        InputError: if it was neither measured nor commanded.
    """
    lead, measured = trial.lead_in, trial.measured.get(trial.pressure_channels[muscle])
    first, start = trial.command[0], np.nan
    if lead is not None:
        first, start = lead.command[0], float(lead.start_pressure[muscle])
    elif measured is not None:
        start = float(measured[0])
    if not np.isfinite(start):
        if trial.drives.muscles[muscle] not in ("pressure_set", "measured"):
            name = trial.muscle_names[muscle] if trial.muscle_names else ""
            raise InputError(
                f"trial {trial.name!r} does not give the start pressure of"
                f" {name or f'muscle {muscle + 1}'}: record {name or f'p{muscle + 1}'}_kpa,"
                " or command pressures"
            )
        start = float(first[muscle])
    # A vented sensor may read slightly below the atmosphere, where the muscle is.
    return max(start, 0.0)
