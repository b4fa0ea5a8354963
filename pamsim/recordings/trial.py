"""A measured trial: commands of a rig and readings of its sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pamsim.recordings.drive import Drive, DriveLike
from pamsim.recordings.signal_names import muscle_channels

HELD_OUT_SUFFIX = "_check"
"""Trials of protocols with this end of the name are held out unless others are named."""


@dataclass(frozen=True, kw_only=True)
class TrialLead:
    """What a rig did right before a trial: it is simulated, so that memory settles, not compared.

    Attributes:
        time: (k,) [s], increasing from 0.
        duration: from its first sample to the trial's [s].
        command: (k, m + j) as that of the trial.
        start_pressure: (m,) first measured gauge pressures [Pa]; NaN where not measured.
    """

    time: NDArray[np.float64]
    duration: float
    command: NDArray[np.float64]
    start_pressure: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Trial:
    """Sampled commands and measurements of one trial, in SI.

    Attributes:
        name: such as the file's stem.
        protocol: trials of the same protocol and settings are repeats of each other.
        drive: one kind for all muscles, or muscle or driven joint -> kind, see
            `pamsim.recordings.drive`.
        load: mass on the arm [kg].
        time: (n,) [s], increasing from 0, not necessarily uniform.
        command: (n, m + j) of each muscle, then of each driven joint: opening [-] or gauge set
            point [Pa], held from each sample on, 0 of a sealed muscle; or the measured gauge
            pressure [Pa], torque [N m], force [N], angle [rad] or position [m] at each sample.
        measured: channel -> (n,) [SI]; a channel that was not measured is absent. Of a rig with
            one joint ``angle``, ``pressure_1`` (gauge) ..., ``force_1`` ...; of any other
            ``knee.angle``, ``flexor.pressure``, ``flexor.force`` ...; of a joint whose motion is
            imposed also the ``torque`` or ``force`` that this takes, such as ``knee.torque``.
        muscle_names: in the order of the commands; none where muscles have numbers.
        lead_in: None for a trial that begins at rest.
    """

    name: str
    protocol: str
    drive: DriveLike
    load: float
    time: NDArray[np.float64]
    command: NDArray[np.float64]
    measured: Mapping[str, NDArray[np.float64]]
    muscle_names: tuple[str, ...] = ()
    lead_in: TrialLead | None = None

    @property
    def sample_interval(self) -> float:
        """Median time between samples [s]."""
        return float(np.median(np.diff(self.time)))

    @cached_property
    def drives(self) -> Drive:
        """``drive`` of every column of the command."""
        return Drive.of(self.drive, self.command.shape[1])

    @property
    def muscles(self) -> int:
        """Number of muscles commanded."""
        return len(self.drives.muscles)

    @property
    def pressure_channels(self) -> tuple[str, ...]:
        """Channel of each muscle's pressure, measured or not."""
        return muscle_channels("pressure", self.muscle_names, self.muscles)


@dataclass(frozen=True, kw_only=True)
class TrialSet:
    """The trials of one recording folder.

    Attributes:
        rig: name or path of the rig they belong to.
        trials: in the order of ``recording.toml``.
        notes: what a reader should know, one sentence each: channels not measured, clocks not
            uniform.
    """

    rig: str
    trials: tuple[Trial, ...]
    notes: tuple[str, ...] = ()
