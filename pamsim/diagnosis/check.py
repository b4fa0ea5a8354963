"""Check recordings before a long run: what was read, what is implausible, what they could show."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pamsim.comparison.chain_runs import most_runs
from pamsim.comparison.compared_signal import Comparison, comparisons_of
from pamsim.comparison.effects_on_rig import candidates
from pamsim.comparison.experiments import experiment_of
from pamsim.comparison.free_parameters import freed_parameters
from pamsim.comparison.likely_mistakes import likely_mistakes
from pamsim.comparison.link_gaps import LinkGaps, gap_per_link
from pamsim.comparison.measurements import CalibrationData, read_calibration_data
from pamsim.comparison.trial_prediction import TrialPredictor
from pamsim.core.computation import Progress, Steps, one_blas_thread
from pamsim.core.encoding import NOT_IN_JSON, fields_to_dict, json_property, write_json
from pamsim.core.errors import InputError, first_few
from pamsim.diagnosis.about_the_rig import Simulated, about_the_drive, about_the_rig
from pamsim.diagnosis.by_link.judged_units import held_out_split
from pamsim.diagnosis.by_link.whole_chain import floor_beside
from pamsim.diagnosis.effects_in_data import EffectInData, effects_in_data
from pamsim.diagnosis.options import usual_nuisance
from pamsim.engine.preflight import above_supply
from pamsim.engine.rig import Rig, given_or_recorded
from pamsim.recordings.signals import IMPOSED, JOINT_DRIVES, KINDS, kind_of
from pamsim.recordings.trial import Trial

SCHEMA = "pamsim-check/2"
FILE = "check.json"

_SHOWN = 6  # names in a line
_TOO_QUICK = "at its typical size the simulation needs a shorter time step, or breaks down"


@dataclass(frozen=True, kw_only=True)
class CheckedChannel:
    """A channel of all trials."""

    unit: str  # of the numbers
    low: float  # least reading
    high: float  # largest reading
    floor: float  # standard deviation of its noise, as repeats or one trial show it
    missed: float  # root mean square that the rig misses as it is


@dataclass(frozen=True, kw_only=True)
class RecordingCheck:
    """What recordings are, beside a rig.

    Attributes:
        rig: its name.
        protocols: name -> number of trials.
        held_out: trials that would be judged by; empty if that were parts of all trials.
        seconds: of all trials together.
        channels: compared ones.
        links: the gap per link of the rig as it is, see `pamsim.comparison.links`.
        suspicions: what is implausible, one sentence each, with the likely mend.
        notes: what else to know, one sentence each.
        effects: what each would look like, the clearest first.
        skipped: effects that cannot be tried -> why.
        run: wall time ``seconds``; the ``trials`` that were simulated with each effect, and the
            ``simulated_seconds`` of them.
        comparisons: every channel of every trial beside the rig as it is.
    """

    rig: str
    protocols: dict[str, int]
    held_out: tuple[str, ...]
    seconds: float
    channels: dict[str, CheckedChannel]
    links: LinkGaps
    suspicions: tuple[str, ...]
    notes: tuple[str, ...]
    effects: tuple[EffectInData, ...]
    skipped: dict[str, str]
    run: dict[str, Any]
    comparisons: tuple[Comparison, ...] = field(repr=False, metadata=NOT_IN_JSON)

    @json_property
    def seen(self) -> tuple[str, ...]:
        """Effects that would show at their typical size, the clearest first."""
        return tuple(one.name for one in self.effects if one.seen)

    @json_property
    def unseen(self) -> tuple[str, ...]:
        """Effects that would not."""
        return tuple(one.name for one in self.effects if not one.seen)

    def summary(self) -> str:
        """The check as a few lines for a screen."""
        repeats = ", ".join(f"{name} x {count}" for name, count in self.protocols.items())
        lines = [
            f"rig {self.rig}: {_trials(sum(self.protocols.values()))}, {self.seconds:.4g} s:"
            f" {repeats}",
            f"held out: {first_few(self.held_out, _SHOWN) or 'parts of all trials'}",
            f"{'channel':20s}{'from':>10s}{'to':>10s}{'noise':>10s}{'missed':>10s}",
        ]
        for name, one in self.channels.items():
            numbers = "".join(f"{v:10.4g}" for v in (one.low, one.high, one.floor, one.missed))
            lines.append(f"{name:20s}{numbers} {one.unit}")
        lines += self.links.lines()
        lines += [f"suspicious: {text}" for text in self.suspicions]
        lines += [f"note: {text}" for text in self.notes]
        lines.append(
            f"effects, by {_trials(len(self.run['trials']))} of"
            f" {self.run['simulated_seconds']:.3g} s together:"
        )
        lines.append(f"{'would show':32s}{'from':>10s}{'typical':>10s} {'unit':16s}mostly in")
        for one in self.effects:
            if one.seen:
                where = f"{one.channel}, {one.protocol}"
                sizes = [f"{float(f'{size:.2g}'):10g}" for size in (one.shows_from, one.typical)]
                lines.append(f"{one.name:32s}{''.join(sizes)} {one.unit:16s}{where}")
        lines.append(f"would not show: {', '.join(self.unseen) or 'none'}")
        lines += [f"not tried: {name}: {why}" for name, why in self.skipped.items()]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The same as JSON-safe values, without the signals."""
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
    progress: Progress | None = None,
) -> RecordingCheck:
    """Check recordings of a rig in some seconds.

    Args:
        data: recording folders.
        rig: name or folder of the rig, or a loaded one; the recordings' own if left out.
        effects: names of those to look for; all that a diagnosis would try if left out.
        hold_out: trials or protocols to judge by.
        threads: simulations at a time; None for one per processor.
        progress: called as each simulation ends; how many there will be is an upper estimate.

    Raises:
        InputError: for what cannot be read or simulated.
    """
    begin = time.perf_counter()
    sources = [data] if isinstance(data, str | os.PathLike) else list(data)
    measured = read_calibration_data(sources)
    if not measured.trials or measured.tables:
        raise InputError(
            "check takes folders of recordings, not tables of angles at rest; pamsim import LOG"
            " --rig RIG --out data makes a recording of a log over time"
        )
    loaded = given_or_recorded(rig, measured.rig or "mas20_arm")
    beside = measured.of_rig(loaded)
    held_out, warnings = held_out_split(beside, hold_out)
    tried, skipped = candidates(loaded, effects)
    freed = [f.free for f in freed_parameters(loaded, usual_nuisance(loaded))]
    steps = Steps(progress, len(beside.trials) + len(tried) + most_runs(loaded, beside.trials))
    predictor = TrialPredictor(
        loaded,
        beside,
        threads=threads,
        simulated=lambda: steps.begin("simulating the rig as it is"),
    )
    predictor.linearise_starts(None)  # starts as read: their errors are small beside a slip
    (prediction,) = predictor.predictions([loaded])
    if prediction is None:
        found = likely_mistakes(loaded, beside.trials, {}, threads=threads)
        mend = ": ".join(found) or "check the rig's parameters and the recording's units"
        raise InputError(f"the simulation breaks down on these trials; {mend}")
    floor = floor_beside(predictor, prediction)
    links = gap_per_link(
        loaded,
        beside.trials,
        threads=threads,
        simulated=lambda: steps.begin("simulating single links"),
    )
    of_each = effects_in_data(
        loaded,
        beside,
        floor,
        [c for c in tried if c.usual],
        freed,
        held_out=held_out,
        threads=threads,
        steps=steps,
    )
    skipped |= dict.fromkeys(of_each.broken, _TOO_QUICK)
    return RecordingCheck(
        rig=loaded.name,
        protocols=dict(Counter(t.protocol for t in beside.trials)),
        held_out=held_out,
        seconds=sum(float(t.time[-1]) for t in beside.trials),
        channels=_channels(beside, prediction.trials, floor.sd),
        links=links,
        suspicions=(
            *_standing_still(loaded, beside.trials, prediction.trials),
            *likely_mistakes(loaded, beside.trials, prediction.trials, threads=threads),
        ),
        notes=(
            *beside.notes,
            *warnings,
            *about_the_drive(beside),
            *above_supply(loaded.muscles, map(experiment_of, beside.trials)),
            *about_the_rig(loaded, beside.trials, prediction.trials, of_each.rough),
        ),
        effects=of_each.effects,
        skipped=skipped,
        run={
            "seconds": time.perf_counter() - begin,
            "trials": of_each.trials,
            "simulated_seconds": of_each.seconds,
        },
        comparisons=tuple(
            one
            for trial in beside.trials
            for one in comparisons_of(
                trial,
                trial.measured,
                prediction.trials[trial.name],
                None,
                held_out=trial.name in held_out,
            )
        ),
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


def _standing_still(rig: Rig, trials: Sequence[Trial], simulated: Simulated) -> Iterator[str]:
    """Channels that never move, although the simulation does."""
    of_joint = {rig.names.joint_channel(joint): joint for joint in rig.joints}
    for channel in dict.fromkeys(c for t in trials for c in t.measured):
        own = [
            t
            for t in trials
            if channel in t.measured
            and channel in simulated[t.name]
            and of_joint.get(channel) not in t.drives.imposed
        ]
        still = all(np.ptp(t.measured[channel]) == 0.0 for t in own)
        if still and any(np.ptp(simulated[t.name][channel]) > 0.0 for t in own):
            text = f"{channel} does not change"
            if joint := of_joint.get(channel):
                (drive,) = (k for k in IMPOSED if JOINT_DRIVES[k].of == rig.joints[joint])
                text += f"; if a machine holds it, state {joint} = {drive!r} in the drive"
            yield text


def _trials(count: int) -> str:
    return "1 trial" if count == 1 else f"{count} trials"
