"""The jobs ``diagnose`` and ``calibrate``: recordings of a varied rig, examined with its model."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

from pamsim.calibration.calibrate import calibrate
from pamsim.comparison.effects_on_rig import at_size, rig_effect
from pamsim.comparison.measurements import read_calibration_data
from pamsim.comparison.readable_unit import readable, readable_interval, readable_unit
from pamsim.core.errors import InputError, PamsimError
from pamsim.core.toml_tables import Entry, check_table
from pamsim.core.units import to_si
from pamsim.diagnosis.options import Options
from pamsim.diagnosis.recordings import diagnose_recordings
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.sweeps.design import FINITE, Value, are_numbers
from pamsim.sweeps.job import RIG, Job, Row, checked_units, is_effect, loaded, with_values
from pamsim.twins.hide import hide

_Interval: TypeAlias = tuple[float, float] | None
_Found: TypeAlias = tuple[dict[str, str], dict[str, tuple[float, _Interval]]]
"""Texts of a row; parameter -> estimate and 95 % interval [SI]."""

_NAMES = Entry(list, "a list of names", None, lambda names: all(isinstance(n, str) for n in names))
_WHOLE = Entry(int, "a whole number", None)
_NUMBER = replace(FINITE, default=None)
_FLAG = Entry(bool, "true or false", None)
_ENDS = Entry(list | tuple, "[low, high]", holds=lambda ends: len(ends) == 2 and are_numbers(ends))

_RECORDED = {
    "protocols": _NAMES, "repeats": _WHOLE, "duration": _NUMBER, "coloured": _FLAG,
    "noise": _NUMBER, "variation": _NUMBER, "forces": _FLAG, "quantised": _FLAG,
    "measured_drive": _FLAG, "seed": _WHOLE,
}  # fmt: skip
"""Options of `pamsim.twins.hide.hide`."""

_EXAMINED = {
    "diagnose": {
        "effects": _NAMES, "without": _NAMES, "nuisance": _NAMES, "hold_out": _NAMES,
        "alpha": _NUMBER, "material": _NUMBER,
    },
    "calibrate": {
        "free": _NAMES, "bounds": Entry(Mapping, "a table", None), "prior": _FLAG,
        "channels": _NAMES, "hold_out": _NAMES, "starts": _WHOLE,
    },
}  # fmt: skip
"""Options of `pamsim.diagnosis.options.Options` and `pamsim.calibration.calibrate.calibrate`."""

_TEXTS = {"diagnose": ("verdict", "named"), "calibrate": ("status",)}
_INPUTS = {"seed": "1", "repeats": "1", "duration": "s", "noise": "1", "variation": "1"}
"""Options of the recordings that may vary -> unit."""

_PARTS = ("found", "low", "high", "true", "inside")


@dataclass(frozen=True, kw_only=True)
class Examine(Job):
    """Synthetic recordings of a rig with other parameters and effects, diagnosed or calibrated."""

    job: str  # ``diagnose`` or ``calibrate``
    rig: str  # name or folder, where no factor chooses it
    recorded: Mapping[str, Any]  # options of the recordings
    examined: Mapping[str, Any]  # options of the diagnosis or calibration
    units: Mapping[str, str]  # factor -> unit of its values
    # Rig parameters whose estimates are compared with their true values
    parameters: tuple[str, ...]

    def rows(self, runs: Sequence[Mapping[str, Value]], threads: int | None) -> list[Row]:
        """One row per run, failed runs included; see `pamsim.sweeps.job.Job`."""
        return [self._row(run, threads) for run in runs]

    def _row(self, run: Mapping[str, Value], threads: int | None) -> Row:
        (rig,) = loaded([str(run.get(RIG, self.rig))]).values()
        began = time.perf_counter()
        try:
            truth, (texts, estimates) = self._examined(rig, run, threads)
        except PamsimError as error:
            return self.refused(error)
        row = {**self.refused(""), **texts, "outcome": "completed"}
        for name in self.parameters:
            planted = rig_parameter(truth, name)
            true = row[f"true.{name}"] = readable(planted, planted.value)
            if name in estimates:
                value, interval = estimates[name]
                row[f"found.{name}"] = readable(planted, value)
                ends = readable_interval(planted, interval)
                if ends is not None:
                    row[f"low.{name}"], row[f"high.{name}"] = ends
                    row[f"inside.{name}"] = float(ends[0] <= true <= ends[1])
        return {**row, "seconds": time.perf_counter() - began}

    def _examined(
        self, rig: Rig, run: Mapping[str, Value], threads: int | None
    ) -> tuple[Rig, _Found]:
        """The rig that was recorded, and what was found in its recordings."""
        options = dict(self.recorded)
        effects: dict[str, float] = {}
        changed: dict[str, Value] = {}
        for name, value in run.items():
            if name in _INPUTS:
                given = to_si(float(value), self.units[name], _INPUTS[name], where=f"vary.{name}")
                whole = _RECORDED[name] is _WHOLE
                if whole and not given.is_integer():
                    raise InputError(f"vary.{name} is {given:g}; it must be a whole number")
                options[name] = int(given) if whole else given
            elif name != RIG and is_effect(rig, name):
                effects[name] = float(value)
            elif name != RIG:
                changed[name] = value
        recording = hide(
            with_values(rig, changed, self.units),
            {name: size for name, size in effects.items() if size},
            **options,
        )
        with tempfile.TemporaryDirectory() as folder:
            place = Path(folder) / "recording"
            recording.save(place)
            found = _FIND[self.job]([place], rig=rig, threads=threads, **self.examined)
        return recording.rig.with_parameters(recording.hidden), found


def _diagnosed(places: Sequence[Path], **options: Any) -> _Found:
    data = read_calibration_data(places)
    found = diagnose_recordings(data, options.pop("rig"), Options(**options))
    estimates: dict[str, tuple[float, _Interval]] = {
        name: (size.value_si, size.interval95_si)
        for effect in found.effects
        for name, size in effect.sizes.items()
    }
    named = " + ".join(e.name for e in found.effects if e.certain["name"])
    return {"verdict": found.verdict.value, "named": named}, estimates


def _calibrated(places: Sequence[Path], **options: Any) -> _Found:
    fit = calibrate(places, **options).fit
    return {"status": fit.status.value}, {p.name: (p.value, p.interval95) for p in fit.parameters}


_FIND: Mapping[str, Callable[..., _Found]] = {"diagnose": _diagnosed, "calibrate": _calibrated}


def examine(
    job: str, table: Mapping[str, Any], rig: str, first: Rig, units: Mapping[str, str]
) -> Examine:
    """The job ``diagnose`` or ``calibrate`` as a study states it.

    The other arguments are those of `pamsim.sweeps.simulated.simulate_step`.

    Raises:
        InputError: for an option or a factor that does not fit the job or the rig.
    """
    stated = check_table(table, {**_RECORDED, **_EXAMINED[job]}, "experiment")
    options = {key: stated[key] for key in table}
    if "bounds" in options:
        own = dict.fromkeys(options["bounds"], _ENDS)
        options["bounds"] = check_table(options["bounds"], own, "experiment.bounds")
    known_units = checked_units(first, units, _INPUTS)
    own = [name for name in known_units if name not in _INPUTS]
    effects = [name for name in own if is_effect(first, name)]
    if job == "calibrate":
        free = options.setdefault("free", [name for name in own if name not in effects])
        if not free:
            raise InputError("experiment.free is missing: the parameters to calibrate")
        judged = [name for name in free if "=" not in name]
    else:
        judged = [p for e in effects for p in at_size(first, rig_effect(first, e), 1.0)]
    numbers = {
        f"{part}.{name}": "1" if part == "inside" else readable_unit(rig_parameter(first, name))
        for name in judged
        for part in _PARTS
    }
    return Examine(
        outputs={**numbers, "seconds": "s", **dict.fromkeys(_TEXTS[job], "text")},
        job=job,
        rig=rig,
        recorded={key: value for key, value in options.items() if key in _RECORDED},
        examined={key: value for key, value in options.items() if key not in _RECORDED},
        units=known_units,
        parameters=tuple(dict.fromkeys(judged)),
    )
