"""Synthetic recordings: simulate a rig in which effects are hidden."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from pamsim.comparison.effects_on_rig import at_size, forms, rig_effect, rig_name
from pamsim.comparison.imposed_motion import IMPOSED_MOTIONS
from pamsim.comparison.protocols import PROTOCOLS, protocol
from pamsim.core.computation import Progress, Steps
from pamsim.core.errors import InputError, nearest
from pamsim.effects.effect import AT
from pamsim.engine.batch import simulate_batch
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.preflight import above_supply
from pamsim.engine.rig import Rig, load_rig
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Recording
from pamsim.recordings.rig_file import shipped_rigs
from pamsim.recordings.sensors import distorted
from pamsim.recordings.signals import IMPOSED
from pamsim.recordings.trial import HELD_OUT_SUFFIX
from pamsim.twins.hidden.catalog import PLANT_EFFECTS, other_formula
from pamsim.twins.hidden.hidden_effect import PlantEffect
from pamsim.twins.hidden.sensor_effects import reported
from pamsim.twins.noise import quantised, with_noise, with_variation
from pamsim.twins.plant.inputs import INPUTS
from pamsim.twins.plant.read_rig import Numbers, read_rig
from pamsim.twins.plant.run import Timing, run
from pamsim.twins.synthetic_recording import HiddenEffect, HideSettings, SyntheticRecording

_Sized = Sequence[tuple[PlantEffect, float]]


def hide(
    rig: str | os.PathLike[str] | Rig,
    effects: Mapping[str, float],
    *,
    progress: Progress | None = None,
    **options: Any,
) -> SyntheticRecording:
    """Simulate recordings of a rig in which effects are hidden.

    The same seed gives the same recordings bit for bit.

    Args:
        rig: without the effects: name of a shipped rig, rig folder, or a loaded rig.
        effects: name -> size in units of the effect's typical one; names of the library
            (`pamsim.effects.catalog`) or of the independent plant (`pamsim.twins.hidden`).
        progress: called as each trial is simulated.
        options: fields of `HideSettings`.

    Returns:
        The recordings and the ground truth; ``save(folder)`` writes both.

    Raises:
        InputError: for an unknown effect, protocol or formulation, an effect that the rig cannot
            have or that has no other formula, a size without meaning, no repeats, or a protocol
            that needs more pressure than the supply has.
        SimulationError: if the rig with the effects breaks down.
    """
    settings = HideSettings(**options)
    base = rig if isinstance(rig, Rig) else load_rig(rig)
    by_library, by_plant = _resolved(base, effects, settings.formulation)
    values: dict[str, float] = {}
    for name, size in by_library.items():
        values |= at_size(base, rig_effect(base, name), size)
    changed = base.with_parameters(values)
    hidden = [
        HiddenEffect(
            name=name,
            size=size,
            unit="typical sizes",
            formulation="library",
            stands_for=(rig_effect(base, name).claim,),
            families=(rig_effect(base, name).family,),
        )
        for name, size in by_library.items()
    ]
    for one, size in by_plant:
        found, known = _measured_size(base, changed, one, size)
        hidden.append(found)
        values |= known
    rng = np.random.default_rng([settings.seed, 77])
    protocols: dict[str, str] = {}
    jobs: list[tuple[Rig, Experiment]] = []
    for name, experiment in _experiments(base, settings):
        for repeat in range(1, settings.repeats + 1):
            protocols[f"{name}_{repeat}"] = name
            jobs.append((with_variation(changed, rng, settings.variation), experiment))
    for above in above_supply(changed.muscles, (experiment for _, experiment in jobs)):
        raise InputError(f"{above}; choose other protocols, or raise valve.supply_pressure")
    steps = Steps(progress, len(jobs))
    if settings.formulation == "library":
        done = simulate_batch(jobs, simulated=lambda: steps.begin("simulating trials"))
        runs = [one.completed() for one in done]
        if changed.sensor is not None:
            runs = [distorted(one, changed.sensor) for one in runs]
    else:
        runs = []
        for number, (there, experiment) in enumerate(jobs):
            steps.begin("simulating trials")
            seed = [settings.seed, number]
            runs.append(_in_plant(there, experiment, by_plant, seed, settings.step))
    trials = {
        stem: with_noise(one, rng, settings.noise, coloured=settings.coloured)
        for stem, one in zip(protocols, runs, strict=True)
    }
    if settings.quantised:
        trials = {stem: quantised(one, base.sensor) for stem, one in trials.items()}
    trials = {stem: _as_recorded(one, settings.measured_drive) for stem, one in trials.items()}
    return SyntheticRecording(
        rig=base,
        reference=_reference(rig),
        effects=tuple(hidden),
        hidden=values,
        settings=dataclasses.replace(settings, protocols=tuple(_names(base, settings))),
        trials=trials,
        protocols=protocols,
    )


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


def _resolved(
    rig: Rig, effects: Mapping[str, float], formulation: str
) -> tuple[Mapping[str, float], _Sized]:
    """Effects by the library's formula, and those by a formula of the plant, in acting order."""
    by_library: dict[str, float] = {}
    by_plant: list[tuple[PlantEffect, float]] = []
    known = forms(rig)
    for name, size in effects.items():
        if name.partition(AT)[0].partition(":")[0] in known and formulation != "independent":
            by_library[name] = size
            continue
        found = other_formula(name)
        if formulation == "library":
            raise InputError(
                f"{name} is an effect of the independent plant alone; add --formulation independent"
            )
        if not (size > 0.0 or (found.signed and size < 0.0)):
            raise InputError(f"{name}: the size must be above 0, not {size:g}")
        by_plant.append((found, size))
    order = list(PLANT_EFFECTS)
    return by_library, sorted(by_plant, key=lambda pair: order.index(pair[0].name))


def _measured_size(
    base: Rig, changed: Rig, one: PlantEffect, size: float
) -> tuple[HiddenEffect, dict[str, float]]:
    """What is hidden in physical terms, and the library's parameters that mean the same [SI]."""
    physical = size * one.typical
    without = read_rig(changed, 0.0)
    there = without.copy()
    if one.change is not None:
        one.change(there, physical)
    measured = one.measure(there, without, physical)

    def own(name: str) -> float:
        return rig_parameter(base, rig_name(base, name)).value

    known = {rig_name(base, n): v for n, v in one.library(physical, measured, own).items()}
    found = HiddenEffect(
        name=one.name,
        size=physical,
        unit=one.unit,
        formulation=one.formulation,
        stands_for=one.stands_for,
        resembles=one.resembles,
        families=one.families,
        physical=measured,
    )
    return found, known


def _names(rig: Rig, settings: HideSettings) -> Sequence[str]:
    """The inputs: those asked for, else all that the rig can take."""
    if settings.protocols:
        return settings.protocols
    if settings.formulation != "library":
        return list(INPUTS)
    return [name for name, one in PROTOCOLS.items() if rig.takes_load or not one.load]


def _experiments(rig: Rig, settings: HideSettings) -> Iterator[tuple[str, Experiment]]:
    """Every input in its two settings, the second of which is held out."""
    numbers = None if settings.formulation == "library" else read_rig(rig, 0.0)
    muscles = len(rig.muscles)
    for name in _names(rig, settings):
        for setting, end in enumerate(("", HELD_OUT_SUFFIX)):
            seed = 2 * settings.seed + setting
            if name in IMPOSED_MOTIONS:
                yield f"{name}{end}", IMPOSED_MOTIONS[name].experiment(rig, seed, settings.duration)
            elif numbers is None or name in PROTOCOLS:
                made = protocol(name).experiment(seed, settings.duration, muscles=muscles)
                yield f"{name}{end}", made
            elif name in INPUTS:
                made = INPUTS[name].experiment(
                    numbers, seed, settings.duration, loads=rig.takes_load
                )
                yield f"{name}{end}", made
            else:
                known = [*INPUTS, *PROTOCOLS, *IMPOSED_MOTIONS]
                raise InputError(f"no protocol {name!r}; {nearest(name, known)}")


def _in_plant(
    rig: Rig, experiment: Experiment, effects: _Sized, seed: Sequence[int], step: float
) -> Recording:
    """One run of the independent plant, as its sensors report it, noise aside."""
    numbers: Numbers = read_rig(rig, experiment.load)
    timing = Timing()
    for one, size in effects:
        if one.change is not None:
            one.change(numbers, size * one.typical)
        if one.timing is not None:
            timing = one.timing(size * one.typical, tuple(seed))
    found = run(
        numbers,
        experiment,
        rig=rig.name,
        joint=rig.only_joint,
        muscles=tuple(rig.muscles),
        timing=timing,
        step=step,
    )
    if rig.sensor is not None:
        found = reported(found, rig.sensor)
    for one, size in effects:
        if one.sensed is not None:
            found = one.sensed(found, size * one.typical)
    return found


def _reference(rig: str | os.PathLike[str] | Rig) -> str:
    """Name or path by which a recording finds its rig."""
    if not isinstance(rig, Rig):
        return str(rig)
    folder = rig.file.folder
    return folder.name if folder.parent == shipped_rigs() else str(folder)
