"""What of a rig would make fits fail, and what recordings cannot show because of their drive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from pamsim.comparison.measurements import CalibrationData
from pamsim.core.units import FloatArray
from pamsim.engine.equilibrium import moment_arms
from pamsim.engine.mjcf import contacts, may_collide
from pamsim.engine.rig import Rig
from pamsim.recordings.signals import KINDS, kind_of
from pamsim.recordings.trial import Trial

Simulated = Mapping[str, Mapping[str, FloatArray]]
"""Trial -> channel -> (n,) [SI]."""

_SAMPLES = 500
"""Positions in which contacts are sought."""

_AT_LIMIT = 1e-3  # of a joint's range
_ON_STOP = 0.2
"""Share of the samples in which a joint is on a stop, beyond that of the recording, to be said."""


def about_the_drive(data: CalibrationData) -> tuple[str, ...]:
    """What trials that are driven by measured pressures cannot show."""
    driven = [trial for trial in data.trials if "measured" in trial.drives.muscles]
    if not driven:
        return ()
    every = all(trial.drives.all_measured for trial in driven)
    which = "all trials are" if len(driven) == len(data.trials) else f"{len(driven)} trials are"
    whose = "the measured pressures" if every else "the measured pressures of some muscles"
    return (
        f"{which} driven by {whose}: they do not show what valves, air and supply do differently"
        f"{'' if every else ' there'}",
    )


def about_the_rig(
    rig: Rig, trials: Sequence[Trial], simulated: Simulated, rough: Mapping[str, float]
) -> tuple[str, ...]:
    """Sentences on rest, stops and contacts of the rig and on signals that jump, with suspects.

    ``rough`` are channels that jump when the muscles' force changes by 1e-7, and by how much [SI].
    """
    positions = _positions(rig, trials, simulated)
    touching = list(_touching(rig, positions)) if may_collide(rig.model) else []
    notes = [
        *_moved_one_way(rig),
        *_off_at_rest(rig, trials, simulated),
        *_on_stops(rig, trials, simulated),
    ]
    if touching:
        notes.append(
            f"{', '.join(touching)}: a contact makes signals jump; give geoms contype=0 and"
            " conaffinity=0 unless it is meant"
        )
    elif may_collide(rig.model):
        notes.append(
            "geoms of the MJCF may touch, though none do here; a contact makes signals jump: give"
            " geoms contype=0 and conaffinity=0 unless a contact is meant"
        )
    suspects = [*touching, *_at_limits(rig, positions), *_switching(rig)]
    for channel, change in rough.items():
        kind = KINDS[kind_of(channel)]
        notes.append(
            f"{channel} moves by {change * kind.scale:.2g} {kind.shown} where the muscles' force"
            " changes by 1e-7: the simulation is not smooth, and no fit can follow it; suspected:"
            f" {', '.join(suspects) or 'the time step, which may be too long'}"
        )
    return tuple(notes)


def _positions(rig: Rig, trials: Sequence[Trial], simulated: Simulated) -> FloatArray:
    """Simulated positions of the recorded joints, (n, j) [rad or m]."""
    channels = rig.names.joint_channels
    every = np.concatenate(
        [np.column_stack([simulated[t.name][channel] for channel in channels]) for t in trials]
    )
    return every[:: max(len(every) // _SAMPLES, 1)]


def _moved_one_way(rig: Rig) -> Iterator[str]:
    """Joints without a spring that several muscles move, all of them one way."""
    pushing = np.array([muscle.pushes for muscle in rig.muscles.values()])
    for joint, arms in zip(rig.joints, moment_arms(rig, rig.model.qpos0).T, strict=True):
        own, way = np.flatnonzero(arms), np.sign(np.where(pushing, -arms, arms))
        if own.size > 1 and abs(way.sum()) == own.size and not rig.model.joint(joint).stiffness[0]:
            yield (
                f"{', '.join(np.array(list(rig.muscles))[own])} move {joint} one way, and no spring"
                " moves it back: unless its weight does, one of their moment arms has the wrong"
                " sign"
            )


def _off_at_rest(rig: Rig, trials: Sequence[Trial], simulated: Simulated) -> Iterator[str]:
    """Joints that begin further off than they move: nothing else can be judged before."""
    for joint, channel in zip(rig.joints, rig.names.joint_channels, strict=True):
        own = [t for t in trials if channel in t.measured and joint not in t.drives.imposed]
        if not own:
            continue
        off = np.array([simulated[t.name][channel][0] - t.measured[channel][0] for t in own])
        moved = max(float(np.ptp(t.measured[channel])) for t in own)
        kind = KINDS[kind_of(channel)]
        if np.abs(off).min() > moved > 0.0:
            yield (
                f"{joint} is {np.median(off) * kind.scale:+.3g} {kind.shown} off at rest, further"
                f" than it moves: calibrate mounting.length_at_zero of its muscles first, or check"
                f" the zero of {channel}"
            )


def _on_stops(rig: Rig, trials: Sequence[Trial], simulated: Simulated) -> Iterator[str]:
    """Joints that the simulation leaves on a stop where the recording does not."""
    for joint, channel in zip(rig.joints, rig.names.joint_channels, strict=True):
        own = [t for t in trials if channel in t.measured]
        if not own or not rig.model.joint(joint).limited[0]:
            continue
        low, high = rig.model.joint(joint).range
        for end, side in ((low, 1.0), (high, -1.0)):
            expected, read = (
                float(np.mean(side * (np.concatenate(signals) - end) < _AT_LIMIT * (high - low)))
                for signals in (
                    [simulated[t.name][channel] for t in own],
                    [t.measured[channel] for t in own],
                )
            )
            kind = KINDS[kind_of(channel)]
            if expected - read > _ON_STOP:
                yield (
                    f"{joint} is on its stop at {end * kind.scale:.3g} {kind.shown} in"
                    f" {100.0 * expected:.0f} % of the simulation and {100.0 * read:.0f} % of the"
                    " recording: what is missed there is the rest, no dynamics"
                )


def _touching(rig: Rig, positions: FloatArray) -> Iterator[str]:
    for (one, two), count in contacts(rig.model, rig.position_addresses, positions).items():
        yield f"{one} and {two} touch in {100.0 * count / len(positions):.3g} % of the samples"


def _at_limits(rig: Rig, positions: FloatArray) -> Iterator[str]:
    """Joints that reach the end of their range."""
    for name, values in zip(rig.joints, positions.T, strict=True):
        joint = rig.model.joint(name)
        low, high = joint.range
        margin = _AT_LIMIT * (high - low)
        if joint.limited[0] and (values.min() < low + margin or values.max() > high - margin):
            yield f"{name} reaches the limit of its range"


def _switching(rig: Rig) -> Iterator[str]:
    """What of joints, transmission and valves changes from one law to another."""
    muscles = rig.muscles.values()
    if rig.model.dof_frictionloss.any() or any(m.friction.acts for m in muscles):
        yield "dry friction, which holds or lets go"
    if any(m.chain.backlash > 0.0 for m in muscles):
        yield "backlash"
    if any(m.valve.dead_zone > 0.0 or m.valve.regulator_dead_band > 0.0 for m in muscles):
        yield "the dead zone of the valves"
