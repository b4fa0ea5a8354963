"""The gap per link: how far each part of a rig is from what was measured, in its own noise."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import f as f_distribution

from pamsim.comparison.chain_runs import link_residuals
from pamsim.comparison.links import Link, link_runs
from pamsim.comparison.noise_floor import FloorRoute, NoiseFloor, noise_floor
from pamsim.comparison.repeated_misfit import (
    LEVEL,
    repeated_misfit,
    shared_p_values,
)
from pamsim.comparison.repeats import protocols_by_load
from pamsim.core.encoding import json_property
from pamsim.engine.rig import Rig
from pamsim.inference.simulator_fit import ResidualBlock, layout
from pamsim.recordings.signals import KINDS, kind_of
from pamsim.recordings.trial import Trial

MATERIAL = 0.5
"""Part of a gap that is no noise from which it is said to exceed its floor, in floors. Imposed
signals are never free of error: with nothing hidden and no variation between trials, repeats share
up to 0.3 floors on the shipped arm with one joint and 0.4 on that with two."""


@dataclass(frozen=True, kw_only=True)
class OutputGap:
    """One output of one link."""

    link: str  # its name, see `pamsim.comparison.links`
    channel: str  # the output, such as ``pressure_1``
    unit: str  # of the numbers
    gap: float  # root mean square of simulated minus measured
    # What a perfect model would be off by: noise of the output and of what is imposed, and what
    # differs between repeats
    floor: float
    missed: float  # part of the gap that is no noise, in floors
    p_value: float  # of a gap that is noise, corrected for the number of outputs
    floor_from: str  # ``repeats``; else how the floor is known within trials
    exceeds: bool  # whether what is missed is at least `MATERIAL` and its p-value below `LEVEL`

    @json_property
    def floors(self) -> float:
        """The gap in floors."""
        return self.gap / self.floor


@dataclass(frozen=True, kw_only=True)
class LinkGaps:
    """The gap per link."""

    outputs: tuple[OutputGap, ...]  # of all links, from the command on
    born_in: str  # first link whose gap exceeds its floor; empty if none does
    notes: tuple[str, ...]  # what the numbers rest on, one sentence each

    def lines(self) -> list[str]:
        """The gap per link as a table for a screen."""
        if not self.outputs:
            return []
        lines = [f"{'link':26s}{'compared':22s}{'gap':>10s}{'floor':>10s} {'unit':7s}in floors"]
        for one in self.outputs:
            above = "  above its floor" if one.exceeds else ""
            numbers = f"{one.gap:10.3g}{one.floor:10.3g} {one.unit:7s}{one.floors:9.2f}"
            lines.append(f"{one.link:26s}{one.channel:22s}{numbers}{above}")
        born = "no link has a certain gap"
        if self.born_in:
            first = next(one for one in self.outputs if one.exceeds)
            once = "" if first.floor_from == FloorRoute.REPEATS else ", if trials do not differ"
            born = f"the gap begins in {self.born_in}{once}"
        return [*lines, born, *(f"note: {text}" for text in self.notes)]


def gap_per_link(
    rig: Rig,
    trials: Sequence[Trial],
    *,
    threads: int | None = None,
    simulated: Callable[[], None] | None = None,
) -> LinkGaps:
    """Simulate every link that the trials separate, and compare its outputs with its own noise.

    Nothing is fitted. A floor is what repeats differ by when each is driven by its own measured
    inputs; of inputs recorded once, it is what noise within the trial shows. Arguments and errors
    are those of `link_residuals`.
    """
    inputs, of_name = protocols_by_load(trials), {trial.name: trial for trial in trials}
    found_residuals = link_residuals(rig, trials, threads=threads, simulated=simulated)
    residuals: dict[Link, list[ResidualBlock]] = {}
    for (link, name, channel), residual in found_residuals.items():
        block = ResidualBlock(
            trial=name,
            protocol=inputs[name],
            channel=channel,
            residual=residual,
            sample_interval=of_name[name].sample_interval,
        )
        residuals.setdefault(link, []).append(block)
    found: list[_Output] = []
    for link, blocks in residuals.items():
        stack = np.concatenate([block.residual for block in blocks])
        floor = noise_floor(layout(blocks), stack, trials)
        protocols: dict[str, dict[str, list[ResidualBlock]]] = {}
        for block in blocks:
            of_channel = protocols.setdefault(block.channel, {})
            of_channel.setdefault(block.protocol, []).append(block)
        found += [_Output(link, channel, own, floor) for channel, own in protocols.items()]
    outputs = tuple(_gaps(found))
    notes = _broken(rig, trials, residuals)
    notes += [
        f"{one.link}, {one.channel}: trials may differ by as much, as far as so few repeats show"
        for one in outputs
        if one.missed >= MATERIAL and not one.exceeds
    ]
    if any(max(map(len, one.protocols.values())) == 1 for one in found):
        notes.append(
            "of inputs recorded once the floor is the noise within a trial: what drifts, or differs"
            " from trial to trial, counts as a gap"
        )
    sensor = rig.sensor
    if sensor is not None and (sensor.angle_lag or sensor.pressure_lag):
        notes.append("the lag of the rig's sensors is not taken off the imposed signals")
    return LinkGaps(
        outputs=outputs,
        born_in=next((one.link for one in outputs if one.exceeds), ""),
        notes=tuple(notes),
    )


def _broken(
    rig: Rig, trials: Sequence[Trial], residuals: Mapping[Link, Sequence[ResidualBlock]]
) -> list[str]:
    """Links whose simulations broke down, or which need forces of one that did."""
    links = [dict.fromkeys(run.link for run in link_runs(rig, trial)) for trial in trials]
    tried = Counter(link for own in links for link in own)
    done = {link: len({block.trial for block in blocks}) for link, blocks in residuals.items()}
    return [
        f"{link.name}: the simulation breaks down in {count - done.get(link, 0)} of {count} trials"
        for link, count in tried.items()
        if count > done.get(link, 0)
    ]


class _Output(NamedTuple):
    """Residuals of an output by protocol, and the floor of its link."""

    link: Link
    channel: str
    protocols: Mapping[str, Sequence[ResidualBlock]]
    floor: NoiseFloor


def _gaps(found: Sequence[_Output]) -> Iterator[OutputGap]:
    tiny = float(np.finfo(float).tiny)
    repeats = [
        [
            repeated_misfit({b.trial: b.residual for b in own})
            for own in one.protocols.values()
            if len(own) > 1
        ]
        for one in found
    ]
    shared = iter(shared_p_values([own for own in repeats if own]) if any(repeats) else ())
    for one, own in zip(found, repeats, strict=True):
        each = [[b.residual for b in blocks] for blocks in one.protocols.values()]
        square = float(np.mean([np.mean([np.mean(r**2) for r in same]) for same in each]))
        variance = float(np.mean([one.floor.variance[one.channel, p] for p in one.protocols]))
        if own:
            p_value, missed = next(shared), float(np.mean([misfit.shared for misfit in own]))
        else:  # noise as white as the floor takes it for
            samples = sum(r.size for same in each for r in same)
            tail = float(f_distribution.sf(square / max(variance, tiny), samples, samples))
            p_value, missed = min(1.0, tail * len(found)), square - variance
        kind, floor = KINDS[kind_of(one.channel)], max(variance, tiny) ** 0.5
        missed = max(missed, 0.0) ** 0.5 / floor
        yield OutputGap(
            link=one.link.name,
            channel=one.channel,
            unit=kind.shown,
            gap=square**0.5 * kind.scale,
            floor=floor * kind.scale,
            missed=missed,
            p_value=p_value,
            floor_from=str(one.floor.routes[one.channel, next(iter(one.protocols))]),
            exceeds=missed >= MATERIAL and p_value < LEVEL,
        )
