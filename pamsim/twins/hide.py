"""Synthetic recordings: simulate a rig in which effects are hidden."""

from __future__ import annotations

import dataclasses
import itertools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from pamsim.comparison.effects_on_rig import at_size, rig_effect
from pamsim.comparison.protocols import IMPOSED_MOTIONS, PROTOCOLS, protocol
from pamsim.core.computation import Progress, Steps
from pamsim.core.errors import InputError
from pamsim.engine.batch import simulate_batch
from pamsim.engine.parameters import each_muscle
from pamsim.engine.preflight import above_supply
from pamsim.engine.rig import Rig, load_rig
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Recording
from pamsim.recordings.rig_file import shipped_rigs
from pamsim.recordings.sensors import MeasurementChain, distorted, quantised
from pamsim.recordings.signals import IMPOSED
from pamsim.recordings.trial import HELD_OUT_SUFFIX
from pamsim.twins.noise import with_noise, with_variation
from pamsim.twins.synthetic_recording import HiddenEffect, HideSettings, SyntheticRecording

RigLike: TypeAlias = str | os.PathLike[str] | Rig
"""Name of a shipped rig, rig folder, or a loaded rig."""

Jobs: TypeAlias = Sequence[tuple[Rig, Experiment]]
"""A rig as it is in a trial, and what is done with it there."""


def hide(
    rig: RigLike,
    effects: Mapping[str, float],
    *,
    progress: Progress | None = None,
    **options: Any,
) -> SyntheticRecording:
    """Simulate recordings of a rig in which effects are hidden.

    The same seed gives the same recordings bit for bit.

    Args:
        rig: without the effects: name of a shipped rig, rig folder, or a loaded rig.
        effects: name, as in `pamsim.effects.catalog` -> size in units of the effect's typical one.
        progress: called as each trial is simulated.
        options: fields of `HideSettings`.

    Returns:
        The recordings and the ground truth; ``save(folder)`` writes both.

    Raises:
        InputError: for an unknown effect or protocol, an effect that the rig cannot have, a size
            without meaning, no repeats, too short or endless trials, a protocol that is named twice
            or needs more pressure than the supply has, or steps of a rig that states neither
            encoder nor converter.
        SimulationError: if the rig with the effects breaks down.
    """
    settings = HideSettings(**options)
    base = rig if isinstance(rig, Rig) else load_rig(rig)
    hidden = [hidden_effect(base, name, size) for name, size in effects.items()]
    values = library_parameters(base, effects)
    able = [name for name, one in PROTOCOLS.items() if base.takes_load or not one.load]
    return recorded(
        base,
        base.with_parameters(each_muscle(base, values)),
        hidden,
        values,
        dataclasses.replace(settings, protocols=tuple(settings.protocols or able)),
        reference=reference(rig),
        experiment=library_experiment,
        simulate=_simulated,
        progress=progress,
    )


def hidden_effect(rig: Rig, name: str, size: float) -> HiddenEffect:
    """What is hidden by an effect of the library, for the ground truth."""
    known = rig_effect(rig, name)
    return HiddenEffect(
        name=name,
        size=size,
        unit="typical sizes",
        stands_for=(known.claim,),
        families=(known.family,),
    )


def library_parameters(rig: Rig, effects: Mapping[str, float]) -> dict[str, float]:
    """Rig parameter -> value that makes effects of the library, each of a size [SI]."""
    values: dict[str, float] = {}
    for name, size in effects.items():
        known = rig_effect(rig, name)
        own = at_size(rig, known, size)
        if not math.isfinite(size) or (size and own == at_size(rig, known, 0.0)):
            raise InputError(f"{name}: a size of {size:g} hides nothing; give one such as 1")
        for parameter, before in itertools.product(own, values):
            # That of a single muscle is the same number as that of all.
            one_muscle = parameter.endswith(f":{before}") or before.endswith(f":{parameter}")
            if one_muscle or (parameter == before and own[parameter] != values[before]):
                raise InputError(
                    f"{name}: another hidden effect has set {before}; hide one of the two"
                )
        values |= own
    return values


def library_experiment(rig: Rig, name: str, seed: int, duration: float | None) -> Experiment:
    """The input of a protocol, or of a machine that moves the joints.

    Raises:
        InputError: for an unknown name, or a motion that the rig cannot have.
    """
    if name in IMPOSED_MOTIONS:
        return IMPOSED_MOTIONS[name].experiment(rig, seed, duration)
    return protocol(name).experiment(
        seed, duration, muscles=len(rig.muscles), supply=rig.supply_pressure
    )


def reference(rig: RigLike) -> str:
    """Name or path by which a recording finds its rig."""
    if not isinstance(rig, Rig):
        return str(rig)
    folder = rig.file.folder
    return folder.name if folder.parent == shipped_rigs() else str(folder)


def recorded(
    rig: Rig,
    changed: Rig,
    effects: Sequence[HiddenEffect],
    values: Mapping[str, float],
    settings: HideSettings,
    *,
    reference: str,
    experiment: Callable[[Rig, str, int, float | None], Experiment],
    simulate: Callable[[Jobs, Steps], list[Recording]],
    progress: Progress | None = None,
) -> SyntheticRecording:
    """Noisy recordings of a rig with hidden effects, by any simulator.

    Args:
        rig: without the effects.
        changed: the rig to simulate.
        effects: what is hidden.
        values: rig parameter -> value that means the hidden effects [SI].
        settings: of the recordings; its protocols are the inputs.
        reference: name or path by which the recordings find the rig.
        experiment: rig, protocol, seed and duration [s] to the experiment of a trial.
        simulate: trials, and steps of which each begins one, to recordings as the rig's sensors
            report them without noise.
        progress: called as each trial is simulated.

    Raises:
        InputError: for a protocol that is named twice or needs more pressure than the supply has,
            or steps of a rig that states neither encoder nor converter.
    """
    sensor = rig.sensor or MeasurementChain()
    if settings.quantised and not (sensor.encoder_increments or sensor.pressure_step):
        raise InputError(
            f"`quantised`: {rig.name} states neither encoder nor converter; state them under"
            " [sensor] in its params.toml, or leave it out"
        )
    rng = np.random.default_rng([settings.seed, 77])
    protocols: dict[str, str] = {}
    jobs: list[tuple[Rig, Experiment]] = []
    for protocol_name in settings.protocols:
        for setting, end in enumerate(("", HELD_OUT_SUFFIX)):  # the second setting is held out
            seed = 2 * settings.seed + setting
            made = experiment(rig, protocol_name, seed, settings.duration)
            for repeat in range(1, settings.repeats + 1):
                stem = f"{protocol_name}{end}_{repeat}"
                if stem in protocols:
                    raise InputError(
                        f"`protocols` has {protocol_name} twice; name it once, and ask for more"
                        " `repeats`"
                    )
                protocols[stem] = f"{protocol_name}{end}"
                jobs.append((with_variation(changed, rng, settings.variation), made))
    for above in above_supply(changed.muscles, (made for _, made in jobs)):
        raise InputError(f"{above}; choose other protocols, or raise valve.supply_pressure")
    runs = simulate(jobs, Steps(progress, len(jobs)))
    trials = {
        stem: with_noise(one, rng, settings.noise, coloured=settings.coloured)
        for stem, one in zip(protocols, runs, strict=True)
    }
    if settings.quantised:
        trials = {stem: _in_steps(one, sensor) for stem, one in trials.items()}
    return SyntheticRecording(
        rig=rig,
        reference=reference,
        effects=tuple(effects),
        hidden=values,
        settings=settings,
        trials={stem: _as_recorded(one, settings.measured_drive) for stem, one in trials.items()},
        protocols=protocols,
    )


def _simulated(jobs: Jobs, steps: Steps) -> list[Recording]:
    """The trials as the engine simulates them, and as the rig's sensors report them."""
    done = simulate_batch(jobs, simulated=lambda: steps.begin("simulating trials"))
    runs = [one.completed() for one in done]
    return [
        one if there.sensor is None else distorted(one, there.sensor)
        for one, (there, _) in zip(runs, jobs, strict=True)
    ]


def _in_steps(run: Recording, sensor: MeasurementChain) -> Recording:
    """A recording in steps of the rig's sensors; a machine reads the joint that it moves itself."""
    imposed = np.array([joint in run.drives.imposed for joint in run.joints])
    read = quantised(run, sensor)
    return dataclasses.replace(read, positions=np.where(imposed, run.positions, read.positions))


def _as_recorded(run: Recording, measured: bool) -> Recording:
    """A recording whose drive is what its sensors read, as far as sensors read it."""
    drives, command = run.drives, run.command.copy()
    if measured:
        drives = dataclasses.replace(drives, muscles=("measured",) * len(drives.muscles))
        command[:, : len(drives.muscles)] = run.pressure
    for column, (joint, kind) in enumerate(drives.joints.items(), start=len(drives.muscles)):
        if kind in IMPOSED:
            command[:, column] = run.positions[:, list(run.joints).index(joint)]
    return dataclasses.replace(run, drive=drives.stated(run.muscles), command=command)
