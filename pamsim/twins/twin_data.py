"""Twin data: recordings of a rig in which effects are hidden, with noise and variation."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from pamsim.comparison.effects_on_rig import at_size
from pamsim.comparison.protocols import HELD_OUT_SUFFIX, PROTOCOLS, protocol
from pamsim.core.errors import InputError, nearest
from pamsim.core.experiment import Experiment
from pamsim.core.recording import Recording
from pamsim.core.units import DEG_PER_RAD
from pamsim.effects.catalog import effect
from pamsim.engine.batch import simulate_batch
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.engine.simulate import simulate
from pamsim.signals.sensors import distorted
from pamsim.twins.independent_models.catalog import ORDER, foreign_truth
from pamsim.twins.independent_models.independent_model import Hook, Truth
from pamsim.twins.independent_models.plant import Occasion

FloatArray = NDArray[np.float64]

ANGLE_NOISE, PRESSURE_NOISE, FORCE_NOISE = 0.05 / DEG_PER_RAD, 400.0, 1.5
"""Standard deviations of sensor noise [rad, Pa, N]: an encoder of 2500 increments, transducers of
1 MPa with 12 bits, load cells of 2 kN."""

TIERS = ("same", "different")
"""Whether effects of the library are hidden as it formulates them, or otherwise: another formula at
half the rig's time step, so that what a diagnosis simulates is not what made the data."""

DRIFT = 0.3
"""Correlation time of coloured noise [s]."""

# What differs a little from one trial to the next: warmth, seating of the muscle, supply.
_VARYING = (
    "force.scale",
    "passive.stiffness",
    "valve.conductance_fill",
    "valve.conductance_exhaust",
)


@dataclass(frozen=True, kw_only=True)
class TwinSettings:
    """How twin data are made.

    Attributes:
        protocols: names of the inputs.
        repeats: of each, in each of its two settings.
        duration: of a trial [s]; the protocols' own if left out.
        coloured: True for noise half of which drifts (AR(1)), False for white noise.
        noise: factor on the sensors' noise.
        variation: relative standard deviation of what differs from trial to trial.
        forces: whether muscle forces are measured.
        tier: one of `TIERS`.
        seed: of everything random.
    """

    protocols: tuple[str, ...] = tuple(PROTOCOLS)
    repeats: int = 4
    duration: float | None = None
    coloured: bool = False
    noise: float = 1.0
    variation: float = 0.003
    forces: bool = True
    tier: str = "same"
    seed: int = 0


@dataclass(frozen=True, kw_only=True)
class TwinData:
    """Recordings with hidden effects, and what was hidden.

    Attributes:
        trials: file stem -> noisy recording.
        protocols: file stem -> protocol.
        hidden: rig parameter -> value that makes the effects [SI].
        formulations: name -> the law in words, of what the library does not formulate so.
        rig: the rig with the hidden parameters.
    """

    trials: Mapping[str, Recording]
    protocols: Mapping[str, str]
    hidden: Mapping[str, float]
    formulations: Mapping[str, str]
    rig: Rig


def twin_data(
    rig: Rig, effects: Sequence[tuple[str, float]], settings: TwinSettings | None = None
) -> TwinData:
    """Record a rig in which effects are hidden.

    Args:
        rig: without the effects.
        effects: names, of the library or from outside, and sizes in units of the typical one.
        settings: see `TwinSettings`.

    Raises:
        InputError: for an unknown effect, protocol or tier, an effect that the rig cannot have or
            that has no other formulation.
        SimulationError: if the rig with the effects breaks down.
    """
    chosen = settings or TwinSettings()
    if chosen.repeats < 1:
        raise InputError(f"{chosen.repeats} repeats: at least one trial is needed")
    if chosen.tier not in TIERS:
        raise InputError(f"no tier {chosen.tier!r}; {nearest(chosen.tier, TIERS)}")
    differently = chosen.tier == "different"
    hidden: dict[str, float] = {}
    foreign: list[tuple[Truth, float]] = []
    for name, size in effects:
        truth = foreign_truth(name, differently=differently)
        if truth is None:
            hidden |= at_size(rig, effect(name), size)
            continue
        if not (size > 0.0 or truth.signed):
            raise InputError(f"{name}: a size of {size:g} means nothing; give one above 0")
        foreign.append((truth, size))
        if truth.parameters is not None:
            hidden |= truth.parameters(rig, size)
    foreign.sort(key=lambda pair: ORDER.index(pair[0].name))
    changed = rig.with_parameters(hidden)
    rng = np.random.default_rng([chosen.seed, 77])
    stems: dict[str, str] = {}
    jobs: list[tuple[Rig, Experiment]] = []
    for name in chosen.protocols:
        for setting, end in enumerate(("", HELD_OUT_SUFFIX)):
            experiment = protocol(name).experiment(2 * chosen.seed + setting, chosen.duration)
            for repeat in range(1, chosen.repeats + 1):
                stems[f"{name}{end}_{repeat}"] = f"{name}{end}"
                jobs.append((_varied(changed, rng, chosen.variation), experiment))
    timestep = 0.5 * rig.model.opt.timestep if differently else None
    runs = [
        _seen(run.completed(), changed, foreign)
        for run in _simulated(jobs, foreign, chosen.seed, timestep)
    ]
    trials = {stem: _noisy(run, rng, chosen) for stem, run in zip(stems, runs, strict=True)}
    return TwinData(
        trials=trials,
        protocols=stems,
        hidden=hidden,
        formulations={truth.name: truth.formulation for truth, _ in foreign},
        rig=changed,
    )


def _simulated(
    jobs: Sequence[tuple[Rig, Experiment]],
    foreign: Sequence[tuple[Truth, float]],
    seed: int,
    timestep: float | None,
) -> list[Recording]:
    lasting = [(truth.law, size) for truth, size in foreign if truth.law is not None]
    if not lasting:
        return simulate_batch(jobs, timestep=timestep)
    runs = []
    for number, (rig, experiment) in enumerate(jobs):
        occasion = Occasion(rig=rig, experiment=experiment, seed=seed, number=number)
        hook = Hook(occasion, [law(size, occasion) for law, size in lasting])
        runs.append(simulate(rig, experiment, timestep=timestep, each_step=hook))
    return runs


def _seen(run: Recording, rig: Rig, foreign: Sequence[tuple[Truth, float]]) -> Recording:
    seen = run if rig.sensor is None else distorted(run, rig.sensor)
    for truth, size in foreign:
        if truth.seen is not None:
            seen = truth.seen(seen, size)
    return seen


def _varied(rig: Rig, rng: np.random.Generator, variation: float) -> Rig:
    """The rig as it is in one trial; muscles vary together, whatever sets them apart stays."""
    factors = 1.0 + variation * rng.standard_normal(len(_VARYING))
    values = {
        f"{muscle}:{name}": rig_parameter(rig, f"{muscle}:{name}").value * factor
        for name, factor in zip(_VARYING, factors, strict=True)
        for muscle in rig.muscles
    }
    return rig.with_parameters(values) if variation else rig


def _noisy(run: Recording, rng: np.random.Generator, settings: TwinSettings) -> Recording:
    def off(shape: tuple[int, ...], sd: float) -> FloatArray:
        return settings.noise * sd * _unit_noise(rng, shape, settings.coloured, _rate(run))

    return dataclasses.replace(
        run,
        angle=run.angle + off(run.angle.shape, ANGLE_NOISE),
        pressure=run.pressure + off(run.pressure.shape, PRESSURE_NOISE),
        tension=run.tension + off(run.tension.shape, FORCE_NOISE),
    )


def _rate(run: Recording) -> float:
    return float(run.meta["sample_hz"])


def _unit_noise(
    rng: np.random.Generator, shape: tuple[int, ...], coloured: bool, rate: float
) -> FloatArray:
    """Noise of unit variance along the first axis."""
    white = rng.standard_normal(shape)
    if not coloured:
        return white
    keep = np.exp(-1.0 / (rate * DRIFT))
    drive = rng.standard_normal(shape)
    drive[0] /= np.sqrt(1.0 - keep**2)  # the drift has been going on for long
    drift: Any = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], drive, axis=0)
    return np.asarray(np.sqrt(0.5) * (white + drift))
