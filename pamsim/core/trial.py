"""A measured trial: commands of a rig and readings of its sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CHANNEL_UNITS = {"pressure": "Pa", "angle": "rad", "force": "N"}
"""Kinds of measured channel; pressures and forces carry a muscle's number, such as ``force_2``."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """Sampled commands and measurements of one trial, in SI.

    Attributes:
        name: such as the file's stem.
        protocol: trials of the same protocol and settings are repeats of each other.
        command_kind: ``valve``, ``pulse`` or ``pressure``.
        load: mass on the arm [kg].
        time: (n,) [s], increasing from 0, not necessarily uniform.
        command: (n, m) command held from each sample on: opening [-] or gauge set point [Pa].
        measured: channel -> (n,): ``pressure_1`` ... [Pa, gauge], ``angle`` [rad],
            ``force_1`` ... [N]; a channel that was not measured is absent.
    """

    name: str
    protocol: str
    command_kind: str
    load: float
    time: NDArray[np.float64]
    command: NDArray[np.float64]
    measured: Mapping[str, NDArray[np.float64]]

    @property
    def sample_interval(self) -> float:
        """Median time between samples [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def muscles(self) -> int:
        """Number of muscles commanded."""
        return self.command.shape[1]


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
