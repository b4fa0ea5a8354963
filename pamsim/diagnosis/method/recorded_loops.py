"""Areas of hysteresis loops in recordings: what widens with rate, amplitude or pressure.

Loops of the same width at every rate come from friction or backlash. Loops that widen with the rate
come from damping or delay, loops that widen with the common pressure from the muscles.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.recordings.trial import Trial

Signals = Mapping[str, Mapping[str, FloatArray]]
"""Trial -> channel -> (n,) simulated signal [SI]."""

PRESSURE, FORCE = "pressure", "force"

_BAND = 0.1  # of half the drive's range: smaller swings about the middle are no cycles
_MOVING = 0.02  # of the fastest change of the drive: slower counts as held
_MOSTLY = 0.5  # share of a trial in which its drive must move: steps draw no loops


@dataclass(frozen=True, kw_only=True)
class DrivenCycle:
    """One cycle of one trial.

    Attributes:
        trial: its name.
        protocol: of the trial.
        drive: ``pressure`` or ``force``: whose difference between the muscles the angle is drawn
            against.
        cycle: number within the trial, from 1.
        amplitude: half the range of the measured angle [rad].
        common_pressure: mean of the measured pressures [Pa]; of the simulated ones where they were
            not measured.
        period: [s].
        measured: area [Pa rad] or [N rad], positive where the angle lags.
        before: area that the base model draws.
        after: area that the repaired model draws; None where nothing is claimed.
    """

    trial: str
    protocol: str
    drive: str
    cycle: int
    amplitude: float
    common_pressure: float
    period: float
    measured: float
    before: float
    after: float | None


def loop_area(drive: FloatArray, response: FloatArray) -> float:
    """Area of a closed loop, positive where the response lags the drive.

    Args:
        drive: (n,), drawn to the right.
        response: (n,), drawn upwards.
    """
    ahead = np.roll(drive, -1) * response
    return 0.5 * float(np.sum(drive * np.roll(response, -1) - ahead))


def cycles(drive: FloatArray) -> list[slice]:
    """Whole cycles of a drive, each from one rise through the middle to the next.

    Args:
        drive: (n,), without noise; one that mostly stands still has none.
    """
    speed = np.abs(np.diff(drive))
    if not np.any(speed) or np.mean(speed > _MOVING * speed.max()) < _MOSTLY:
        return []
    off = drive - 0.5 * float(drive.max() + drive.min())
    band = 0.5 * _BAND * float(np.ptp(drive))
    rises = (np.flatnonzero((off[:-1] < 0.0) & (off[1:] >= 0.0)) + 1).tolist()
    # A trial that begins or ends in the middle begins or ends a cycle there.
    ends = [k for k in (0, drive.size - 1) if abs(off[k]) < band]
    turns = sorted({*rises, *ends})
    whole: list[slice] = []
    for start in turns:
        if whole and start < whole[-1].stop - 1:
            continue
        stop = _turned(off, start, turns, band)
        if stop is not None:
            whole.append(slice(start, stop + 1))
    return whole


def _turned(off: FloatArray, start: int, turns: Sequence[int], band: float) -> int | None:
    """First turn by which a drive has been above its middle, and then below."""
    for stop in turns:
        above = np.flatnonzero(off[start : stop + 1] > band)
        below = np.flatnonzero(off[start : stop + 1] < -band)
        if above.size and below.size:
            return stop if above[0] < below[0] else None
    return None


def loop_areas(trials: Sequence[Trial], before: Signals, after: Signals) -> tuple[DrivenCycle, ...]:
    """Areas of the loops of all trials of two muscles whose drive goes back and forth.

    Args:
        trials: as measured.
        before: what the base model makes of them.
        after: what the repaired model makes of them; empty where nothing is claimed.
    """
    driven: list[DrivenCycle] = []
    for trial in trials:
        if trial.muscles != 2 or "angle" not in trial.measured or trial.name not in before:
            continue
        simulated = before[trial.name]
        parts = cycles(_apart(simulated, PRESSURE))
        common = {**simulated, **trial.measured}
        for drive in (PRESSURE, FORCE):
            if not all(f"{drive}_{i}" in trial.measured for i in (1, 2)):
                continue
            for number, part in enumerate(parts, 1):
                angle = trial.measured["angle"][part]
                mean = 0.5 * (common["pressure_1"][part] + common["pressure_2"][part])
                driven.append(
                    DrivenCycle(
                        trial=trial.name,
                        protocol=trial.protocol,
                        drive=drive,
                        cycle=number,
                        amplitude=0.5 * float(np.ptp(angle)),
                        common_pressure=float(np.mean(mean)),
                        period=float(trial.time[part][-1] - trial.time[part][0]),
                        measured=_area(trial.measured, drive, part),
                        before=_area(simulated, drive, part),
                        after=_area(after[trial.name], drive, part) if after else None,
                    )
                )
    return tuple(driven)


def _apart(signals: Mapping[str, FloatArray], drive: str) -> FloatArray:
    return signals[f"{drive}_1"] - signals[f"{drive}_2"]


def _area(signals: Mapping[str, FloatArray], drive: str, part: slice) -> float:
    return loop_area(_apart(signals, drive)[part], signals["angle"][part])
