"""A recording: what a rig did, sampled in time, with an outcome that says whether to trust it."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import SimulationError


class Outcome(enum.Enum):
    """How a simulation ended."""

    COMPLETED = "completed"
    NOT_FINITE = "not_finite"
    ENGINE_WARNING = "engine_warning"
    TIME_STALLED = "time_stalled"


@dataclass(frozen=True, kw_only=True)
class Recording:
    """Sampled signals of one run, in SI.

    Attributes:
        time: (n,) [s], uniform, from 0.
        angle: (n,) output angle beta [rad].
        velocity: (n,) its rate [rad/s].
        pressure: (n, m) gauge pressures [Pa], one column per muscle.
        tension: (n, m) muscle tensions [N].
        command: (n, m) command held from each sample on.
        command_kind: ``valve``, ``pulse`` or ``pressure``.
        load: mass on the arm [kg].
        muscles: names of the muscles, in column order.
        outcome: how the run ended; anything but COMPLETED means the signals stop early.
        message: the outcome as a sentence.
        final_state: the engine's whole state at the last sample, to continue from; of a run that
            broke down, the state it started from.
        meta: what else is worth keeping: rig, time step, versions, name.
    """

    time: NDArray[np.float64]
    angle: NDArray[np.float64]
    velocity: NDArray[np.float64]
    pressure: NDArray[np.float64]
    tension: NDArray[np.float64]
    command: NDArray[np.float64]
    command_kind: str
    load: float
    muscles: tuple[str, ...]
    outcome: Outcome
    message: str
    final_state: NDArray[np.float64]
    meta: Mapping[str, str | float] = field(default_factory=dict[str, str | float])

    def completed(self) -> Recording:
        """Return the recording itself if the run completed.

        Raises:
            SimulationError: otherwise, carrying this partial recording.
        """
        if self.outcome is not Outcome.COMPLETED:
            raise SimulationError(self.message, recording=self)
        return self
