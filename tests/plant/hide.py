"""Synthetic recordings by the independent plant, with effects hidden in it.

    python -m tests.plant.hide EFFECTS --out FOLDER [--formulation plant|independent] [...]

Arguments, files and noise are those of `pamsim hide`. The plant simulates, with its own inputs
beside the library's, and hides its own effects (`tests.plant.hidden`) beside the library's.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import click

from pamsim.cli import hide as library
from pamsim.cli.command import Command
from pamsim.comparison.effects_on_rig import forms, rig_name
from pamsim.comparison.protocols import IMPOSED_MOTIONS, PROTOCOLS
from pamsim.core.computation import Progress, Steps
from pamsim.core.errors import InputError, nearest
from pamsim.effects.effect import AT
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig, load_rig
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Recording
from pamsim.twins.hide import (
    Jobs,
    RigLike,
    hidden_effect,
    library_experiment,
    library_parameters,
    recorded,
    reference,
)
from pamsim.twins.synthetic_recording import HiddenEffect, HideSettings, SyntheticRecording
from tests.plant.hidden.catalog import PLANT_EFFECTS, other_formula
from tests.plant.hidden.hidden_effect import PlantEffect, Quantities, Quantity
from tests.plant.hidden.sensor_effects import reported
from tests.plant.inputs import INPUTS
from tests.plant.read_rig import read_rig
from tests.plant.run import STEP, Timing, run

FORMULATIONS = ("plant", "independent")
"""By which formulas the plant has an effect of the library: by the same, or by another."""

_Sized = Sequence[tuple[PlantEffect, float]]


@dataclass(frozen=True, kw_only=True)
class PlantSettings(HideSettings):
    """How recordings of the plant are made: also by which `FORMULATIONS`, in steps up to [s]."""

    formulation: str = "independent"
    step: float = STEP

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.step > 0.0:
            raise InputError(f"step: {self.step:g} s; it must be above 0")
        if self.formulation not in FORMULATIONS:
            raise InputError(
                f"no formulation {self.formulation!r}; {nearest(self.formulation, FORMULATIONS)}"
            )


@dataclass(frozen=True, kw_only=True)
class PlantHidden(HiddenEffect):
    """One effect that was hidden in the plant, by the ``library``'s formula or another in words.

    See `PlantEffect` for what it resembles, and for its size in physical terms.
    """

    formulation: str = "library"
    resembles: tuple[str, ...] = ()
    physical: Quantities = field(default_factory=dict[str, Quantity])


def hide(
    rig: RigLike,
    effects: Mapping[str, float],
    *,
    progress: Progress | None = None,
    **options: Any,
) -> SyntheticRecording:
    """Simulate recordings of the independent plant of a rig in which effects are hidden.

    As `pamsim.hide`, of effects of the library or of `tests.plant.hidden`, with options that are
    fields of `PlantSettings`; of no protocols, all `INPUTS`. Parameters of an effect by another
    formula are those of the library that mean the same size.
    """
    settings = PlantSettings(**options)
    base = rig if isinstance(rig, Rig) else load_rig(rig)
    by_library, by_plant = _resolved(base, effects, settings.formulation)
    values = library_parameters(base, by_library)
    changed = base.with_parameters(values)
    hidden = [PlantHidden(**vars(hidden_effect(base, *one))) for one in by_library.items()]
    for one, size in by_plant:
        found, known = measured_size(base, changed, one, size)
        hidden.append(found)
        values |= known

    def simulate(jobs: Jobs, steps: Steps) -> list[Recording]:
        runs: list[Recording] = []
        for number, (there, experiment) in enumerate(jobs):
            steps.begin("simulating trials")
            seed = (settings.seed, number)
            runs.append(in_plant(there, experiment, by_plant, seed, settings.step))
        return runs

    return recorded(
        base,
        changed,
        hidden,
        values,
        dataclasses.replace(settings, protocols=tuple(settings.protocols or INPUTS)),
        reference=reference(rig),
        experiment=_experiment,
        simulate=simulate,
        progress=progress,
    )


def _resolved(
    rig: Rig, effects: Mapping[str, float], formulation: str
) -> tuple[Mapping[str, float], _Sized]:
    """Effects by the library's formula, and those by a formula of the plant, in acting order."""
    by_library: dict[str, float] = {}
    by_plant: list[tuple[PlantEffect, float]] = []
    known = forms(rig)
    for name, size in effects.items():
        if name.partition(AT)[0].partition(":")[0] in known and formulation == "plant":
            by_library[name] = size
            continue
        found = other_formula(name)
        if not (size > 0.0 or (found.signed and size < 0.0)):
            raise InputError(f"{name}: the size must be above 0, not {size:g}")
        by_plant.append((found, size))
    order = list(PLANT_EFFECTS)
    return by_library, sorted(by_plant, key=lambda pair: order.index(pair[0].name))


def measured_size(
    base: Rig, changed: Rig, one: PlantEffect, size: float
) -> tuple[PlantHidden, dict[str, float]]:
    """What is hidden in physical terms, and the library's parameters that mean the same [SI]."""
    amount = size * one.typical
    without = read_rig(changed, 0.0)
    there = without.copy()
    if one.change is not None:
        one.change(there, amount)
    measured = one.measured(there, without, amount)

    def own(name: str) -> float:
        return rig_parameter(base, rig_name(base, name)).value

    known = {rig_name(base, n): v for n, v in one.in_library(amount, measured, own).items()}
    same = ("name", "unit", "formulation", "stands_for", "resembles", "families")
    stated = {field: getattr(one, field) for field in same}
    return PlantHidden(size=amount, physical=measured, **stated), known


def _experiment(rig: Rig, name: str, seed: int, duration: float | None) -> Experiment:
    """The experiment of an input of the plant or of the library."""
    if name in INPUTS:
        numbers = read_rig(rig, 0.0)
        return INPUTS[name].experiment(numbers, seed, duration, loads=rig.takes_load)
    known = [*INPUTS, *PROTOCOLS, *IMPOSED_MOTIONS]
    if name not in known:
        raise InputError(f"no protocol {name!r}; {nearest(name, known)}")
    return library_experiment(rig, name, seed, duration)


def in_plant(
    rig: Rig, experiment: Experiment, effects: _Sized, seed: tuple[int, ...], step: float
) -> Recording:
    """One run of the plant, as its sensors report it, noise aside."""
    numbers = read_rig(rig, experiment.load)
    timing = Timing()
    for one, size in effects:
        if one.change is not None:
            one.change(numbers, size * one.typical)
        if one.timing is not None:
            timing = one.timing(size * one.typical, seed)
    names = {"rig": rig.name, "joint": rig.only_joint, "muscles": tuple(rig.muscles)}
    found = run(numbers, experiment, **names, timing=timing, step=step)
    if rig.sensor is not None:
        found = reported(found, rig.sensor)
    for one, size in effects:
        if one.sensed is not None:
            found = one.sensed(found, size * one.typical)
    return found


_ARGUMENTS = [one for one in library.command.params if one.name not in ("quiet", "verbose")]


@click.command(name="hide", cls=Command, params=_ARGUMENTS)
@click.option("--formulation", default="independent", show_default=True, help=str(FORMULATIONS))
def command(**given: Any) -> int:
    """Record the independent plant of a rig in which EFFECTS are hidden."""
    return library.record(hide, **given)


if __name__ == "__main__":
    command()
