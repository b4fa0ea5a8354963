"""The job ``simulate``: one step response per run, and the figures that are read off it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from pamsim.core.errors import InputError, PamsimError
from pamsim.core.units import PA_PER_KPA, to_si
from pamsim.engine.batch import simulate_batch
from pamsim.engine.preflight import refuse_above_supply
from pamsim.engine.rig import Rig
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.step_metrics import step_figure_units, step_figures
from pamsim.sweeps.factor import Value, number
from pamsim.sweeps.job import Row
from pamsim.sweeps.varied_rig import RIG, check_names, loaded, with_values

_Pair: TypeAlias = tuple[Rig, Experiment]
_Varied: TypeAlias = tuple[str, tuple[tuple[str, Value], ...]]

_INPUT = re.compile(r"(start_pressure|final)_([1-9]\d*)")
_UNITS = {"pressure_set": "kPa", "valve": "1"}
_KEYS = {
    "drive", "start_pressure", "final", "duration", "load", "sample_hz", "settle",
}  # fmt: skip
BLOCK = 128
"""Runs in a block: each block loads the rig."""


@dataclass(frozen=True, kw_only=True)
class SimulateStep:
    """Step responses of a rig.

    Attributes:
        rig: name or folder, where no factor chooses it.
        drive: ``pressure_set`` or ``valve``.
        start_pressure: of each muscle [kPa].
        final: command of each muscle from time 0 on [kPa], or opening [-].
        duration: [s].
        load: [kg].
        sample_hz: sampling rate [Hz].
        settle: time allowed to come to rest before [s].
        units: factor -> unit of its values.
        outputs: column of a row -> unit.
    """

    rig: str
    drive: str
    start_pressure: tuple[float, ...]
    final: tuple[float, ...]
    duration: float
    load: float = 0.0
    sample_hz: float = 200.0
    settle: float = 4.0
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    outputs: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def columns(self) -> Mapping[str, str]:
        """Column of its rows -> unit; ``text`` for text."""
        return {**self.outputs, "outcome": "text", "message": "text"}

    @property
    def runs_in_block(self) -> int:
        """Runs that are worth a task of their own."""
        return BLOCK

    def rows(self, runs: Sequence[Mapping[str, Value]], threads: int | None) -> list[Row]:
        """One row per run, failed runs included; see `pamsim.sweeps.job.Job`."""
        rigs = loaded(str(run.get(RIG, self.rig)) for run in runs)
        varied: dict[_Varied, Rig] = {}
        found: list[Row | None] = [None] * len(runs)
        jobs: list[tuple[int, _Pair]] = []
        for place, run in enumerate(runs):
            try:
                jobs.append((place, self._prepared(rigs[str(run.get(RIG, self.rig))], run, varied)))
            except PamsimError as error:
                found[place] = self._failed(str(error))
        for (place, _), result in zip(
            jobs, _recordings([j for _, j in jobs], threads), strict=True
        ):
            found[place] = (
                self._failed(result) if isinstance(result, str) else self._figures(result)
            )
        return [row for row in found if row is not None]

    def _prepared(self, rig: Rig, run: Mapping[str, Value], known: dict[_Varied, Rig]) -> _Pair:
        """Rig and experiment of a run; runs with equal numbers share a rig, and its rest."""
        load, start, final = self.load, list(self.start_pressure), list(self.final)
        rest: dict[str, Value] = {}
        for name, value in run.items():
            place = _INPUT.fullmatch(name)
            if name == "load":
                load = to_si(float(value), self.units[name], "kg", where="vary.load")
            elif place is not None:
                pressure = self.drive == "pressure_set" or place[1] == "start_pressure"
                unit = "kPa" if pressure else "1"
                number = to_si(float(value), self.units[name], unit, where=f"vary.{name}")
                (start if place[1] == "start_pressure" else final)[int(place[2]) - 1] = number
            elif name != RIG:
                rest[name] = value
        scale = PA_PER_KPA if self.drive == "pressure_set" else 1.0
        key = str(run.get(RIG, self.rig)), tuple(rest.items())
        if key not in known:
            known[key] = with_values(rig, rest, self.units)
        varied = known[key]
        experiment = Experiment(
            drive=self.drive,
            command_time=np.zeros(1),
            command_value=scale * np.array([final]),
            start_pressure=PA_PER_KPA * np.array(start),
            duration=self.duration,
            sample_rate=self.sample_hz,
            load=load,
            settle=self.settle,
            name="step",
        )
        refuse_above_supply(varied.muscles, experiment)
        return varied, experiment

    def _figures(self, recording: Recording) -> Row:
        figures = step_figures(recording) if recording.outcome is Outcome.COMPLETED else {}
        return {
            **{name: figures.get(name, math.nan) for name in self.outputs},
            "outcome": recording.outcome.value,
            "message": recording.message,
        }

    def _failed(self, message: str) -> Row:
        return {**dict.fromkeys(self.outputs, math.nan), "outcome": "refused", "message": message}


def _recordings(jobs: Sequence[_Pair], threads: int | None) -> list[Recording | str]:
    """Recordings of all jobs; of one that is refused, why."""
    try:
        return list(simulate_batch(jobs, threads=threads))
    except PamsimError as error:
        if len(jobs) == 1:
            return [str(error)]
    return [one for job in jobs for one in _recordings([job], threads)]


def simulate_step(
    table: Mapping[str, Any], rig: str, rigs: Sequence[str], units: Mapping[str, str]
) -> SimulateStep:
    """The job as a study states it.

    Args:
        table: its table ``experiment``.
        rig: name or folder of the rig.
        rigs: those that a factor chooses from; empty where none does.
        units: factor -> unit as stated, without ``rig``.

    Raises:
        InputError: for an experiment or a factor that does not fit the rig.
    """
    unknown = sorted(set(table) - _KEYS)
    if unknown:
        raise InputError(f"experiment.{unknown[0]} is not known; it has {', '.join(sorted(_KEYS))}")
    first = next(iter(loaded(rigs or [rig]).values()))
    drive = table.get("drive", "pressure_set")
    if drive not in _UNITS:
        raise InputError(f"experiment.drive is {drive!r}; it may be {' or '.join(_UNITS)}")
    muscles = len(first.muscles)
    numbers = {
        key: number(f"experiment.{key}", table[key])
        for key in ("duration", "load", "sample_hz", "settle")
        if key in table
    }
    if "duration" not in numbers:
        raise InputError("experiment.duration is missing: the length of each run in seconds")
    own: dict[str, str] = {}
    found: dict[str, str] = {}
    for name, unit in units.items():
        place = _INPUT.fullmatch(name)
        if name == "load":
            found[name] = unit or "kg"
            to_si(1.0, found[name], "kg", where="vary.load")
        elif place is not None:
            if int(place[2]) > muscles:
                raise InputError(f"vary.{name}: {first.name} has {muscles} muscles")
            si = "kPa" if place[1] == "start_pressure" else _UNITS[drive]
            found[name] = unit or si
            to_si(1.0, found[name], si, where=f"vary.{name}")
        else:
            own[name] = unit
    return SimulateStep(
        rig=rig,
        drive=drive,
        start_pressure=_per_muscle("start_pressure", table, muscles),
        final=_per_muscle("final", table, muscles),
        units={**found, **check_names(first, own)},
        outputs=step_figure_units(first.names),
        **numbers,
    )


def _per_muscle(key: str, table: Mapping[str, Any], muscles: int) -> tuple[float, ...]:
    values = table.get(key)
    if not isinstance(values, list) or len(values) != muscles:
        raise InputError(f"experiment.{key} must list a number for each of the {muscles} muscles")
    return tuple(number(f"experiment.{key}", value) for value in values)
