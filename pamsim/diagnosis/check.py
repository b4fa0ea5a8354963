"""Check recordings before a long run: what was read, what is implausible, what they could show."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.measurements import CalibrationData, read_calibration_data
from pamsim.comparison.trial_prediction import CHANNELS
from pamsim.core.blas_threads import one_blas_thread
from pamsim.core.encoding import fields_to_dict
from pamsim.core.errors import InputError
from pamsim.core.signal_names import KINDS, kind_of
from pamsim.core.trial import Trial
from pamsim.diagnosis.compared_recordings import about_the_drive, compared
from pamsim.diagnosis.method.screen import screen
from pamsim.diagnosis.method.trial_diagnosis import fitted_base
from pamsim.diagnosis.recordings import NUISANCE
from pamsim.engine.rig import Rig, load_rig
from pamsim.store.json_file import write_json

Simulated = Mapping[str, Mapping[str, NDArray[np.float64]]]
"""Trial -> channel -> (n,) [SI]."""

SCHEMA = "pamsim-check/1"
FILE = "check.json"

_LIKE = 0.7
"""Correlation from which a signal counts as that of the simulation, or as its mirror image."""

_SLIPS = {
    "angle": ((57.29578, "rad, not deg"), (1.0 / 57.29578, "deg, not rad"), (360.0, "turns")),
    "pressure": ((100.0, "bar, not kPa"), (0.145038, "psi, not kPa"), (1000.0, "MPa, not kPa")),
    "force": ((1000.0, "kN, not N"), (9.80665, "kgf, not N")),
}
"""Kind of channel -> what its numbers would have to be multiplied by, and the unit they are in."""

_NEAR = 0.15  # relative error of a factor that is taken for a mistaken unit


@dataclass(frozen=True, kw_only=True)
class CheckedChannel:
    """A channel of all trials.

    Attributes:
        unit: of the numbers.
        low, high: extreme readings.
        floor: standard deviation of its noise, as repeats or one trial show it.
        missed: root mean square that the rig, nuisance parameters refitted, misses.
    """

    unit: str
    low: float
    high: float
    floor: float
    missed: float


@dataclass(frozen=True, kw_only=True)
class RecordingCheck:
    """What recordings are, beside a rig.

    Attributes:
        rig: its name.
        protocols: name -> number of trials.
        held_out: trials, or parts of trials, that would be judged by.
        seconds: of all trials together.
        channels: compared ones.
        suspicions: what is implausible, one sentence each, with the likely mend.
        notes: what else to know, one sentence each.
        seen: effects that would show, the clearest first.
        unseen: effects that would not, at any of the sizes that are tried.
        skipped: effects that cannot be tried -> why.
    """

    rig: str
    protocols: dict[str, int]
    held_out: tuple[str, ...]
    seconds: float
    channels: dict[str, CheckedChannel]
    suspicions: tuple[str, ...]
    notes: tuple[str, ...]
    seen: tuple[str, ...]
    unseen: tuple[str, ...]
    skipped: dict[str, str]

    def summary(self) -> str:
        """The check as a few lines for a screen."""
        repeats = ", ".join(f"{name} x {count}" for name, count in self.protocols.items())
        lines = [
            f"rig {self.rig}: {sum(self.protocols.values())} trials, {self.seconds:.4g} s:"
            f" {repeats}",
            f"held out: {_some(self.held_out)}",
            f"{'channel':20s}{'from':>10s}{'to':>10s}{'noise':>10s}{'missed':>10s}",
        ]
        for name, one in self.channels.items():
            numbers = "".join(f"{v:10.4g}" for v in (one.low, one.high, one.floor, one.missed))
            lines.append(f"{name:20s}{numbers} {one.unit}")
        lines += [f"suspicious: {text}" for text in self.suspicions]
        lines += [f"note: {text}" for text in self.notes]
        lines.append(f"effects that would show: {', '.join(self.seen) or 'none'}")
        lines.append(f"effects that would not: {', '.join(self.unseen) or 'none'}")
        lines += [f"not tried: {name}: {why}" for name, why in self.skipped.items()]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The same as JSON-safe values."""
        return {"schema": SCHEMA, **fields_to_dict(self)}

    def save(self, folder: str | Path) -> Path:
        """Write ``check.json``.

        Raises:
            InputError: if it cannot be written.
        """
        path = Path(folder) / FILE
        path.parent.mkdir(parents=True, exist_ok=True)
        write_json(path, self.to_dict())
        return path


@one_blas_thread()
def check(
    data: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    rig: str | os.PathLike[str] | Rig | None = None,
    effects: Sequence[str] = (),
    hold_out: Sequence[str] = (),
    threads: int | None = None,
) -> RecordingCheck:
    """Check recordings of a rig in the time of some simulations.

    Args:
        data: recording folders.
        rig: name or folder of the rig, or a loaded one; the recordings' own if left out.
        effects: names of those to look for; all that a diagnosis would try if left out.
        hold_out: trials or protocols to judge by.
        threads: simulations at a time; None for one per processor.

    Raises:
        InputError: for what cannot be read or simulated.
    """
    sources = [data] if isinstance(data, str | os.PathLike) else list(data)
    measured = read_calibration_data(sources)
    if not measured.trials or measured.tables:
        raise InputError("check takes recording folders; tables and loops are judged as they are")
    loaded = rig if isinstance(rig, Rig) else load_rig(rig or measured.rig or "mas20_arm")
    beside = compared(measured, loaded, effects, NUISANCE, CHANNELS, hold_out, threads)
    fitter, base = fitted_base(
        beside.simulator, beside.nuisance, {t.name: t.command for t in beside.data.trials}
    )
    usual = [c for c in beside.tried if c.usual]
    screened = screen(fitter, base, usual)
    shown = {
        one.candidate.name: max(t.signature.visible for t in one.traces)
        for one in screened
        if one.visible
    }
    simulated = beside.engine.signals(base.values)
    return RecordingCheck(
        rig=loaded.name,
        protocols=dict(Counter(t.protocol for t in beside.data.trials)),
        held_out=beside.split.names,
        seconds=sum(float(t.time[-1]) for t in beside.data.trials),
        channels=_channels(beside.data, simulated, fitter.floor.sd),
        # With the rig's own numbers: a refit would make up for a wrong unit.
        suspicions=_suspicions(beside.data.trials, beside.engine.signals({})),
        notes=(*beside.data.notes, *beside.split.warnings, *about_the_drive(beside.data)),
        seen=tuple(sorted(shown, key=lambda name: -shown[name])),
        unseen=tuple(s.candidate.name for s in screened if s.candidate.name not in shown),
        skipped=beside.skipped,
    )


def _channels(
    data: CalibrationData, simulated: Simulated, floor: Mapping[str, float]
) -> dict[str, CheckedChannel]:
    """Each channel of the noise floor over all trials."""
    found: dict[str, CheckedChannel] = {}
    for channel, noise in floor.items():
        kind = KINDS[kind_of(channel)]
        own = [t for t in data.trials if channel in t.measured and t.name in simulated]
        readings = np.concatenate([t.measured[channel] for t in own])
        missed = np.concatenate([simulated[t.name][channel] - t.measured[channel] for t in own])
        found[channel] = CheckedChannel(
            unit=kind.shown,
            low=float(readings.min()) * kind.scale,
            high=float(readings.max()) * kind.scale,
            floor=float(noise) * kind.scale,
            missed=float(np.sqrt(np.mean(missed**2))) * kind.scale,
        )
    return found


def _suspicions(trials: Sequence[Trial], simulated: Simulated) -> tuple[str, ...]:
    """What of all trials together is implausible."""
    found: list[str] = []
    channels = dict.fromkeys(c for t in trials for c in t.measured)
    for channel in channels:
        own = [t for t in trials if channel in t.measured and channel in simulated.get(t.name, {})]
        if not own:
            continue
        read = np.concatenate([_moved(t.measured[channel]) for t in own])
        expected = np.concatenate([_moved(simulated[t.name][channel]) for t in own])
        found += _about(channel, read, expected)
    return tuple(found)


def _moved(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values - values.mean()


def _about(channel: str, read: NDArray[np.float64], expected: NDArray[np.float64]) -> list[str]:
    lengths = float(np.linalg.norm(read) * np.linalg.norm(expected))
    if lengths == 0.0:
        return [
            f"{channel} does not change" if not np.any(read) else f"{channel} should not change"
        ]
    similarity = float(read @ expected) / lengths
    factor = float(read @ expected) / float(read @ read)
    if similarity < -_LIKE:
        return [
            f"{channel} moves against the simulation (correlation {similarity:.2f}): its sign may"
            " be turned (sign = -1 in [columns]), or the muscles swapped"
        ]
    if similarity < _LIKE:
        return []
    return [
        f"{channel} times {factor:.3g} would be what is simulated: its numbers may be in {unit}"
        for slip, unit in _SLIPS.get(kind_of(channel), ())
        if abs(factor / slip - 1.0) < _NEAR
    ]


def _some(names: Sequence[str], most: int = 6) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
