"""A recording looked at: the state of the arm at any instant of a trial."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.engine.rig import Rig, load_rig
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.signals import column_of
from pamsim.recordings.trial import Trial, of_rig


@dataclass(frozen=True, kw_only=True)
class Replay:
    """One trial of a recording and the rig it is of.

    Attributes:
        rig: loaded with its scene.
        trial: with a measured position of every joint.
        others: names of the recording's other trials.
    """

    rig: Rig
    trial: Trial
    others: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Length of the trial [s]."""
        return float(self.trial.time[-1])

    @property
    def title(self) -> str:
        """What is shown, in a few words."""
        return f"{self.rig.name}, {self.trial.name}, load {self.trial.load:g} kg"

    def positions(self, time: float) -> list[float]:
        """Positions of the rig's joints at a time, linear between samples [rad or m]."""
        return [
            float(np.interp(time, self.trial.time, self.trial.measured[channel]))
            for channel in self.rig.names.joint_channels
        ]

    def pressures(self, time: float) -> list[float]:
        """Gauge pressures at a time [Pa], one per muscle; NaN where none was measured."""
        measured = self.trial.measured
        return [
            float(np.interp(time, self.trial.time, measured[channel]))
            if channel in measured
            else math.nan
            for channel in self.trial.pressure_channels
        ]


def read_replay(
    recording: str | os.PathLike[str],
    *,
    trial: str | None = None,
    rig: str | os.PathLike[str] | None = None,
) -> Replay:
    """Read one trial of a recording to look at.

    Args:
        recording: folder with ``recording.toml``, or that file.
        trial: its name; the first if None.
        rig: name or folder of a rig instead of the one the recording names.

    Raises:
        InputError: what `read_recordings` refuses, an unknown trial, a rig with another number of
            muscles, an angle that was not measured.
    """
    recorded = read_recordings(recording)
    named = {each.name: each for each in recorded.trials}
    if trial is not None and trial not in named:
        raise InputError(f"{recording}: no trial {trial!r}; {nearest(trial, named)}")
    chosen = recorded.trials[0] if trial is None else named[trial]
    loaded = load_rig(recorded.rig if rig is None else rig, scene=True)
    try:
        chosen, _ = of_rig(chosen, loaded.names, loaded.name)
    except InputError as error:
        raise InputError(f"{recording}: {error}; give its `rig`") from None
    for channel in loaded.names.joint_channels:
        if channel not in chosen.measured:
            raise InputError(
                f"{recording}: trial {chosen.name!r} has no column {column_of(channel)!r}, which a"
                " picture needs"
            )
    others = tuple(name for name in named if name != chosen.name)
    return Replay(rig=loaded, trial=chosen, others=others)


def frame_times(duration: float, *, fps: float, speed: float) -> NDArray[np.float64]:
    """Instants that the frames of a film show.

    Args:
        duration: of what is filmed [s].
        fps: frames per second of the film [Hz].
        speed: 1 for real time, 0.5 for slow motion.

    Returns:
        (n,) [s] from 0, n = duration fps / speed, so that the film lasts duration / speed.

    Raises:
        InputError: if fps or speed is not positive.
    """
    for name, value in (("fps", fps), ("speed", speed)):
        if not 0.0 < value < np.inf:
            raise InputError(f"`{name}` {value:g} must be above 0")
    count = max(1, round(duration * fps / speed))
    return np.arange(count, dtype=np.float64) * (speed / fps)
