"""The job ``simulate``: one step response per run, and the figures that are read off it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from pamsim.core.errors import InputError, PamsimError
from pamsim.core.toml_tables import Entry, check_table
from pamsim.core.units import PA_PER_KPA, to_si
from pamsim.engine.batch import simulate_batch
from pamsim.engine.preflight import refuse_above_supply
from pamsim.engine.rig import Rig
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.step_metrics import step_figure_units, step_figures
from pamsim.sweeps.design import FINITE, Value, are_numbers
from pamsim.sweeps.job import RIG, Job, Row, checked_units, loaded, with_values

_Pair: TypeAlias = tuple[Rig, Experiment]
_Varied: TypeAlias = tuple[str, tuple[tuple[str, Value], ...]]

_INPUT = re.compile(r"(start_pressure|final)_[1-9]\d*")
_UNITS = {"pressure_set": "kPa", "valve": "1"}
_OF_MUSCLES = Entry(list, "[...], a number for each muscle", holds=are_numbers)
_EXPERIMENT = {
    "drive": Entry(str, " or ".join(_UNITS), "pressure_set", _UNITS.__contains__),
    "start_pressure": _OF_MUSCLES,
    "final": _OF_MUSCLES,
    "duration": replace(FINITE, write="the length of each run in seconds"),
    "load": replace(FINITE, default=0.0),
    "sample_hz": replace(FINITE, default=200.0),
    "settle": replace(FINITE, default=4.0),
}
BLOCK = 128
"""Runs in a block: each block loads the rig."""


@dataclass(frozen=True, kw_only=True)
class SimulateStep(Job):
    """Step responses of a rig."""

    rig: str  # name or folder, where no factor chooses it
    drive: str  # ``pressure_set`` or ``valve``
    start_pressure: tuple[float, ...]  # of each muscle [kPa]
    final: tuple[float, ...]  # command of each muscle from time 0 on [kPa], or opening [-]
    duration: float  # [s]
    load: float  # [kg]
    sample_hz: float  # sampling rate [Hz]
    settle: float  # time allowed to come to rest before [s]
    units: Mapping[str, str]  # factor -> unit of its values

    def rows(self, runs: Sequence[Mapping[str, Value]], threads: int | None) -> list[Row]:
        """One row per run, failed runs included; see `pamsim.sweeps.job.Job`."""
        rigs = loaded(str(run.get(RIG, self.rig)) for run in runs)
        varied: dict[_Varied, Rig] = {}
        jobs: dict[int, _Pair] = {}
        found: dict[int, Row] = {}
        for place, run in enumerate(runs):
            try:
                jobs[place] = self._prepared(rigs, run, varied)
            except PamsimError as error:
                found[place] = self.refused(error)
        for place, result in zip(jobs, _recordings([*jobs.values()], threads), strict=True):
            failed = isinstance(result, str)
            found[place] = self.refused(result) if failed else self._figures(result)
        return [found[place] for place in range(len(runs))]

    def _prepared(
        self, rigs: Mapping[str, Rig], run: Mapping[str, Value], known: dict[_Varied, Rig]
    ) -> _Pair:
        """Rig and experiment of a run; runs with equal numbers share a rig, and its rest."""
        inputs = _input_units(self.drive, len(self.final))
        given = {
            name: to_si(float(run[name]), self.units[name], unit, where=f"vary.{name}")
            for name, unit in inputs.items()
            if name in run
        }
        start, final = (
            np.array([given.get(f"{key}_{i}", value) for i, value in enumerate(usual, 1)])
            for key, usual in (("start_pressure", self.start_pressure), ("final", self.final))
        )
        rest = {name: value for name, value in run.items() if name not in {RIG, *inputs}}
        key = str(run.get(RIG, self.rig)), tuple(rest.items())
        if key not in known:
            known[key] = with_values(rigs[key[0]], rest, self.units)
        varied = known[key]
        experiment = Experiment(
            drive=self.drive,
            command_time=np.zeros(1),
            command_value=(PA_PER_KPA if self.drive == "pressure_set" else 1.0) * final[None],
            start_pressure=PA_PER_KPA * start,
            duration=self.duration,
            sample_rate=self.sample_hz,
            load=given.get("load", self.load),
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


def _input_units(drive: str, muscles: int) -> dict[str, str]:
    """Number of an experiment that may vary -> its unit."""
    numbers = range(1, muscles + 1)
    start = {f"start_pressure_{i}": "kPa" for i in numbers}
    return {"load": "kg", **start, **{f"final_{i}": _UNITS[drive] for i in numbers}}


def _recordings(jobs: Sequence[_Pair], threads: int | None) -> list[Recording | str]:
    """Recordings of all jobs; of one that is refused, why."""
    try:
        return list(simulate_batch(jobs, threads=threads))
    except PamsimError as error:
        if len(jobs) == 1:
            return [str(error)]
    return [one for job in jobs for one in _recordings([job], threads)]


def simulate_step(
    table: Mapping[str, Any], rig: str, first: Rig, units: Mapping[str, str]
) -> SimulateStep:
    """The job as a study states it in its table ``experiment``.

    The rig is a name or folder, where no factor chooses it; ``first`` is that rig, or the first of
    those that a factor chooses from. Units are those of factors as stated, without ``rig``.

    Raises:
        InputError: for an experiment or a factor that does not fit the rig.
    """
    stated, muscles = check_table(table, _EXPERIMENT, "experiment"), len(first.muscles)
    for key in ("start_pressure", "final"):
        if len(stated[key]) != muscles:
            raise InputError(
                f"experiment.{key} must list a number for each of the {muscles} muscles"
            )
        stated[key] = tuple(map(float, stated[key]))
    for key in ("duration", "load", "sample_hz", "settle"):
        stated[key] = float(stated[key])
    inputs = _input_units(stated["drive"], muscles)
    for name in units:
        if _INPUT.fullmatch(name) and name not in inputs:
            raise InputError(f"vary.{name}: {first.name} has {muscles} muscles")
    return SimulateStep(
        rig=rig,
        units=checked_units(first, units, inputs),
        outputs=step_figure_units(first.names),
        runs_in_block=BLOCK,
        **stated,
    )
