"""Synthetic recordings: simulate a rig in which effects are hidden."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pamsim.comparison.effects_on_rig import at_size, rig_effect
from pamsim.comparison.protocols import HELD_OUT_SUFFIX, protocol
from pamsim.core.errors import InputError
from pamsim.core.experiment import Experiment
from pamsim.core.recording import Recording
from pamsim.engine.batch import simulate_batch
from pamsim.engine.rig import Rig, load_rig
from pamsim.engine.simulate import simulate
from pamsim.signals.sensors import distorted
from pamsim.store.rig_file import shipped_rigs
from pamsim.twins.independent_models.catalog import ORDER, OUTSIDE, independent_model
from pamsim.twins.independent_models.independent_model import IndependentModel, StepHook
from pamsim.twins.independent_models.plant import RunContext
from pamsim.twins.noise import with_noise, with_variation
from pamsim.twins.synthetic_recording import HiddenEffect, HideSettings, SyntheticRecording

_Models = Sequence[tuple[IndependentModel, float]]


def hide(
    rig: str | os.PathLike[str] | Rig, effects: Mapping[str, float], **options: Any
) -> SyntheticRecording:
    """Simulate recordings of a rig in which effects are hidden.

    The same seed gives the same recordings bit for bit.

    Args:
        rig: without the effects: name of a shipped rig, rig folder, or a loaded rig.
        effects: name -> size in units of the effect's typical one; names of the library
            (`pamsim.effects.catalog`) or from outside it (`pamsim.twins.independent_models`).
        options: fields of `HideSettings`.

    Returns:
        The recordings and the ground truth; ``save(folder)`` writes both.

    Raises:
        InputError: for an unknown effect, protocol or formulation, an effect that the rig cannot
            have or that has no independent formulation, a size without meaning, or no repeats.
        SimulationError: if the rig with the effects breaks down.
    """
    settings = HideSettings(**options)
    base = rig if isinstance(rig, Rig) else load_rig(rig)
    hidden, models = _resolved(base, effects, settings)
    values = _parameters(base, effects, models)
    changed = base.with_parameters(values)
    rng = np.random.default_rng([settings.seed, 77])
    protocols: dict[str, str] = {}
    jobs: list[tuple[Rig, Experiment]] = []
    for name in settings.protocols:
        for setting, end in enumerate(("", HELD_OUT_SUFFIX)):
            experiment = protocol(name).experiment(2 * settings.seed + setting, settings.duration)
            for repeat in range(1, settings.repeats + 1):
                protocols[f"{name}{end}_{repeat}"] = f"{name}{end}"
                jobs.append((with_variation(changed, rng, settings.variation), experiment))
    # What an independent model makes is also simulated in finer steps than a diagnosis takes.
    timestep = None if settings.formulation == "library" else 0.5 * base.model.opt.timestep
    runs = [
        _measured(run.completed(), changed, models)
        for run in _simulated(jobs, models, settings.seed, timestep)
    ]
    return SyntheticRecording(
        rig=base,
        reference=_reference(rig),
        effects=hidden,
        hidden=values,
        settings=settings,
        trials={
            stem: with_noise(run, rng, settings.noise, coloured=settings.coloured)
            for stem, run in zip(protocols, runs, strict=True)
        },
        protocols=protocols,
    )


def _resolved(
    rig: Rig, effects: Mapping[str, float], settings: HideSettings
) -> tuple[tuple[HiddenEffect, ...], _Models]:
    """What is hidden, and the independent models among it in the order in which they act."""
    hidden: list[HiddenEffect] = []
    models: list[tuple[IndependentModel, float]] = []
    for name, size in effects.items():
        model = independent_model(name, formulation=settings.formulation)
        if model is not None:
            if not (size > 0.0 or model.signed):
                raise InputError(f"{name}: the size must be above 0, not {size:g}")
            models.append((model, size))
        hidden.append(
            HiddenEffect(
                name=name,
                size=size,
                formulation="library" if model is None else model.formulation,
                resembles=OUTSIDE[name].resembles
                if name in OUTSIDE
                else (rig_effect(rig, name).name,),
            )
        )
    models.sort(key=lambda pair: ORDER.index(pair[0].name))
    return tuple(hidden), models


def _parameters(rig: Rig, effects: Mapping[str, float], models: _Models) -> dict[str, float]:
    """Rig parameters that make the effects [SI]."""
    independent = {model.name: model for model, _ in models}
    values: dict[str, float] = {}
    for name, size in effects.items():
        if name not in independent:
            values |= at_size(rig, rig_effect(rig, name), size)
        elif (parameters := independent[name].parameters) is not None:
            values |= parameters(rig, size)
    return values


def _simulated(
    jobs: Sequence[tuple[Rig, Experiment]], models: _Models, seed: int, timestep: float | None
) -> list[Recording]:
    laws = [(model.law, size) for model, size in models if model.law is not None]
    if not laws:
        return simulate_batch(jobs, timestep=timestep)
    runs: list[Recording] = []
    for number, (rig, experiment) in enumerate(jobs):
        context = RunContext(rig=rig, experiment=experiment, seed=seed, number=number)
        hook = StepHook(context, [law(size, context) for law, size in laws])
        runs.append(simulate(rig, experiment, timestep=timestep, each_step=hook))
    return runs


def _measured(run: Recording, rig: Rig, models: _Models) -> Recording:
    """A run as the rig's sensors report it, noise aside."""
    measured = run if rig.sensor is None else distorted(run, rig.sensor)
    for model, size in models:
        if model.measured is not None:
            measured = model.measured(measured, size)
    return measured


def _reference(rig: str | os.PathLike[str] | Rig) -> str:
    """Name or path by which a recording finds its rig."""
    if not isinstance(rig, Rig):
        return str(rig)
    folder = rig.file.folder
    return folder.name if folder.parent == shipped_rigs() else str(folder)
