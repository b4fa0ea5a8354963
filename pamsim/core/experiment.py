"""An experiment: commands, start and sampling of a run, independent of any engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, check_value

COMMAND_UNITS = {"valve": "1", "pulse": "1", "pressure": "Pa", "measured": "Pa"}
"""Kinds of command: signed valve opening, signed pulse duty, gauge pressure set point, and the
gauge pressure that was measured, which the muscles then have whatever valves and air would do."""

_LOWEST_READING = -2e4  # of a gauge pressure [Pa]


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Commands over time, the state they start from, and how the run is sampled.

    Attributes:
        command: ``valve``, ``pulse``, ``pressure`` or ``measured``.
        command_time: (k,) times at which the command takes a new value [s], increasing from 0.
        command_value: (k, m) values, one column per muscle: opening or duty in [-1, 1], or gauge
            pressure [Pa]. A value is held until the next; between measured pressures it runs
            straight.
        start_pressure: (m,) gauge pressures the rig rests at before time 0 [Pa].
        duration: [s].
        sample_rate: of recording and of changes of command [Hz].
        load: mass on the arm [kg].
        settle: time allowed to come to rest at the start pressures [s].
        name: for messages and legends.
    """

    command: str
    command_time: NDArray[np.float64]
    command_value: NDArray[np.float64]
    start_pressure: NDArray[np.float64]
    duration: float
    sample_rate: float = 500.0
    load: float = 0.0
    settle: float = 4.0
    name: str = ""

    def __post_init__(self) -> None:
        """Check everything that can be checked without the rig.

        Raises:
            InputError: for an unknown command, NaN, unsorted times, impossible pressures.
            ParameterError: for a number out of range.
        """
        if self.command not in COMMAND_UNITS:
            raise InputError(f"no command {self.command!r}; {nearest(self.command, COMMAND_UNITS)}")
        time = np.atleast_1d(np.asarray(self.command_time, dtype=float))
        value = np.atleast_2d(np.asarray(self.command_value, dtype=float))
        start = np.atleast_1d(np.asarray(self.start_pressure, dtype=float))
        _require_finite("command time", time)
        _require_finite("command value", value)
        _require_finite("start pressure", start)
        if len(time) == 0 or len(start) == 0:
            raise InputError("an experiment needs a command: give a time and a value per muscle")
        if time.ndim != 1 or value.shape != (len(time), len(start)):
            raise InputError(
                f"command values have shape {value.shape}; {len(time)} times and {len(start)}"
                f" muscles need ({len(time)}, {len(start)})"
            )
        if time[0] != 0.0 or np.any(np.diff(time) <= 0.0):
            raise InputError("command times must start at 0 and increase")
        commanded = value.ravel() if self.command == "pressure" else start
        pressures = np.concatenate([start, commanded])
        if np.any(pressures < 0.0):
            raise InputError(
                f"pressure {pressures.min() / 1e3:g} kPa is negative; pressures are gauge, 0 is the"
                " atmosphere, and the rig has no vacuum"
            )
        # A sensor at a vented muscle may read a little below the atmosphere, but never a vacuum.
        if self.command == "measured" and np.any(value < _LOWEST_READING):
            raise InputError(
                f"a measured pressure of {value.min() / 1e3:g} kPa is no gauge pressure of a"
                " muscle; give gauge pressures, 0 at the atmosphere"
            )
        if COMMAND_UNITS[self.command] == "1" and np.any(np.abs(value) > 1.0):
            raise InputError(
                f"valve command {value.flat[np.argmax(np.abs(value))]:g} is outside [-1, 1]"
            )
        for name, high, unit in (
            ("duration", 1e6, "s"),
            ("sample_rate", 1e5, "Hz"),
        ):
            spec = FieldSpec(unit=unit, high=high, doc=name, low=0.0, low_open=True)
            check_value(f"experiment.{name}", getattr(self, name), spec)
        for name, high, unit in (("load", 1e4, "kg"), ("settle", 1e4, "s")):
            spec = FieldSpec(unit=unit, high=high, doc=name, low=0.0, low_open=False)
            check_value(f"experiment.{name}", getattr(self, name), spec)
        object.__setattr__(self, "command_time", time)
        object.__setattr__(self, "command_value", value)
        object.__setattr__(self, "start_pressure", start)

    def command_at(self, times: ArrayLike) -> NDArray[np.float64]:
        """Command at given times: the last value, or on the line between two measured ones.

        Args:
            times: (n,) [s], not before 0.

        Returns:
            (n, m) command values.
        """
        if self.command == "measured":
            at = np.asarray(times, dtype=float)
            found = np.empty((at.size, self.command_value.shape[1]))
            for muscle, column in enumerate(self.command_value.T):
                found[:, muscle] = np.interp(at, self.command_time, column)
            return found
        # A breakpoint written k * 0.002 must not miss the sample k / 500 by rounding.
        late = np.asarray(times) * (1.0 + 1e-12) + 1e-12
        index = np.searchsorted(self.command_time, late, side="right") - 1
        return self.command_value[np.maximum(index, 0)]


def pressure_step(
    start_pressure: ArrayLike,
    final_pressure: ArrayLike,
    *,
    duration: float,
    load: float = 0.0,
    sample_rate: float = 500.0,
    name: str = "",
) -> Experiment:
    """Experiment in which the set points jump from one pair of pressures to another at time 0.

    Args:
        start_pressure: (m,) gauge pressures at rest [Pa].
        final_pressure: (m,) gauge pressures from time 0 [Pa].
        duration: [s].
        load: [kg].
        sample_rate: [Hz].
        name: for messages and legends.

    Raises:
        InputError: as `Experiment`.
    """
    return Experiment(
        command="pressure",
        command_time=np.zeros(1),
        command_value=np.atleast_2d(np.asarray(final_pressure, dtype=float)),
        start_pressure=np.asarray(start_pressure, dtype=float),
        duration=duration,
        load=load,
        sample_rate=sample_rate,
        name=name,
    )


def _require_finite(what: str, values: NDArray[np.float64]) -> None:
    if not np.all(np.isfinite(values)):
        where = int(np.flatnonzero(~np.isfinite(values.ravel()))[0])
        raise InputError(
            f"{what} has {values.ravel()[where]} at entry {where}; give finite numbers"
        )
