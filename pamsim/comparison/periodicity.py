"""Period of a sampled command."""

from __future__ import annotations

import numpy as np

from pamsim.core.units import FloatArray

_SAME = 1e-6  # of the command's range, to which it is written
_PROBES = 32  # samples by which lags are sorted out before all samples are compared


def samples_per_period(command: FloatArray) -> int | None:
    """Period of a command that goes on for two periods at least, in samples; None without one.

    Args:
        command: (n, m), held from each sample on: the last one is never acted on and may be any.
    """
    command = command[:-1]
    count = command.shape[0]
    limit = _SAME * float(np.ptp(command, axis=0).max()) if count else 0.0
    if limit == 0.0:
        return None
    most = (count + 1) // 2  # the last period may be one sample short
    lags = np.arange(2, most + 1)
    for at in range(0, count - most, max((count - most) // _PROBES, 1)):
        lags = lags[np.all(np.abs(command[at + lags] - command[at]) <= limit, axis=1)]
    for lag in lags.tolist():
        if np.all(np.abs(command[lag:] - command[:-lag]) <= limit):
            return lag
    return None
