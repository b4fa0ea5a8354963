"""Noise that a lab knows of its sensors, as the table ``[noise]`` of a recording states it.

    [noise]
    "elbow.angle" = { rms = "0.1 deg" }
    "biceps.pressure" = { rms = "0.5 kPa", filter = "3 Hz" }

What samples show may be far less: of a log that was filtered at 3 Hz, neighbouring samples have
nearly the same error. Filtered noise is that of a low-pass of first order, which forgets within
1 / (2 pi f).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.signal

from pamsim.core.errors import InputError
from pamsim.core.toml_tables import Entry, check_table
from pamsim.core.units import FloatArray, parse_quantity
from pamsim.recordings.signals import KINDS, kind_of

_lfilter: Any = scipy.signal.lfilter

_ENTRY = {
    "rms": Entry(str, 'a size such as "0.1 deg"'),
    "filter": Entry(str, 'the cut-off of the low-pass before the log, such as "3 Hz"', None),
}


@dataclass(frozen=True, kw_only=True)
class StatedNoise:
    """Noise of a channel."""

    rms: float  # standard deviation [SI]
    cutoff: float = math.inf  # of the low-pass that it has passed [Hz]; inf without one

    def drawn(self, count: int, interval: float, rng: np.random.Generator) -> FloatArray:
        """Noise of ``count`` samples (count,) [SI], an interval [s] apart."""
        kept = math.exp(-2.0 * math.pi * self.cutoff * interval)
        return self.rms * drifting_noise(rng, (count,), kept)


def drifting_noise(rng: np.random.Generator, shape: tuple[int, ...], kept: float) -> FloatArray:
    """Noise of unit variance along the first axis, of which a share is kept to the next sample."""
    drive = rng.standard_normal(shape)
    drive[0] /= np.sqrt(1.0 - kept**2)  # the noise is stationary from the first sample on
    return np.asarray(_lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], drive, axis=0))


def stated_noise(table: object, channels: Iterable[str], where: str) -> dict[str, StatedNoise]:
    """Noise of each measured channel that a table states: channel -> rms and, as needed, filter.

    Raises:
        InputError: for a channel that was not measured, an unknown key, a size without meaning.
    """
    if not isinstance(table, Mapping):
        raise InputError(f'{where}: write a table, such as "elbow.angle" = {{ rms = "0.1 deg" }}')
    known, found = tuple(dict.fromkeys(channels)), dict[str, StatedNoise]()
    for channel, one in table.items():
        place = f"{where}: {channel}"
        if channel not in known:
            raise InputError(f"{place} was not measured; write {', '.join(known)}")
        stated = check_table(one, _ENTRY, place)
        unit = KINDS[kind_of(channel)].unit
        rms = parse_quantity(stated["rms"], unit, unit, where=f"{place}: rms")
        cutoff = math.inf
        if stated["filter"] is not None:
            cutoff = parse_quantity(stated["filter"], "Hz", "Hz", where=f"{place}: filter")
        if not (0.0 <= rms < math.inf and cutoff > 0.0):
            raise InputError(f"{place}: rms must be 0 or more, filter above 0 Hz")
        found[channel] = StatedNoise(rms=rms, cutoff=cutoff)
    return found
