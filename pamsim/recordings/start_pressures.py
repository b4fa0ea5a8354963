"""Pressures at which the muscles of a trial rest before it begins."""

from __future__ import annotations

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.recordings.trial import Trial

SHUT_AT_0 = frozenset({"valve", "pulse"})  # drives whose valves are shut at a command of 0
_FEWEST, _MOST = 16, 50
"""Readings of which a straight line shows the beginning: to ``2 / sqrt(n)`` of the noise, half of
it and a quarter. Air that leaks follows a line for so long, or a parabola."""
_BENT = 2.0  # standard errors from which readings are no straight line: 5 % are by chance


def start_pressures(trial: Trial) -> FloatArray:
    """Gauge pressures at which the muscles of a trial rest before it begins, shape (m,) [Pa].

    Of a muscle that nothing moves at first, all readings until then give it: with shut valves an
    error of the first alone would last as long as the trial.

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
        start = _at_rest(measured[: resting_rows(trial)])
    if not np.isfinite(start):
        kind = trial.drives.muscles[muscle]
        if kind not in ("pressure_set", "measured"):
            name = trial.muscle_names[muscle] if trial.muscle_names else ""
            column = f"{name or f'p{muscle + 1}'}_kpa"
            mend = column if kind == "sealed" else f"{column}, or command pressures"
            raise InputError(
                f"trial {trial.name!r} does not give the start pressure of"
                f" {name or f'muscle {muscle + 1}'}: record {mend}"
            )
        start = float(first[muscle])
    # A vented sensor may read slightly below the atmosphere, where the muscle is.
    return max(start, 0.0)


def resting_rows(trial: Trial) -> int:
    """Number of rows at the beginning that show the start; 1 where something moves too soon.

    In more than one all valves are shut and no command changes, but air may leak.
    """
    still = np.all(trial.command == trial.command[0], axis=1)
    for muscle, kind in enumerate(trial.drives.muscles):
        still &= kind == "sealed" or (kind in SHUT_AT_0 and trial.command[0, muscle] == 0.0)
    rows = still.size if still.all() else int(np.argmin(still))
    return min(rows, _MOST) if rows >= _FEWEST else 1


def _at_rest(readings: FloatArray) -> float:
    """Pressure at the first of some readings (n,), by a line, bent if they show that."""
    if readings.size == 1:
        return float(readings[0])
    basis = np.linalg.qr(np.vander(np.linspace(0.0, 1.0, readings.size), 3, increasing=True))[0]
    size = basis.T @ readings
    noise = np.linalg.norm(readings - basis @ size) / np.sqrt(readings.size - size.size)
    if abs(size[2]) < _BENT * noise:
        size[2] = 0.0
    return float(basis[0] @ size)
