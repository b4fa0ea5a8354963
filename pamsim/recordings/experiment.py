"""An experiment: commands, start and sampling of a run, independent of any engine."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.limits import RUN_SAMPLES
from pamsim.core.parameters import check_value, quantity, specs
from pamsim.core.units import FloatArray
from pamsim.recordings.signals import DRIVES, IMPOSED, Drive, DriveLike

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline

_LOWEST_READING = -2e4  # of a gauge pressure [Pa]
_NONE_IN_KPA = 1e3  # of no muscle [kPa]; the same number of Pa moves none


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Commands over time, the state they start from, and how the run is sampled.

    A value of a command is held until the next; between measured pressures, torques and forces it
    runs straight, and an imposed motion is smooth. See `pamsim.recordings.signals` for drives.

    Attributes:
        drive: one kind for all muscles, or muscle or driven joint -> kind; others are free.
        command_time: (k,) times at which the command takes a new value [s], increasing from 0.
        command_value: (k, m + j), a column per muscle, then one per driven joint, in the order of
            ``drive``, else of the rig: opening or duty in [-1, 1], gauge pressure [Pa], 0 of a
            sealed muscle, torque [N m], force [N], angle [rad] or position [m].
        start_pressure: (m,) gauge pressures at rest before time 0 [Pa], under what acts on joints.
        duration: [s].
        sample_rate: of recording and of changes of command [Hz].
        load: mass on the arm [kg].
        settle: time allowed to come to rest at the start pressures [s].
        approach: time at its beginning in which it goes on to come to rest [s]: creep is relaxed
            at the end of it, and first stroke and softening begin there.
        name: for messages and legends.
    """

    drive: DriveLike
    command_time: FloatArray
    command_value: FloatArray
    start_pressure: FloatArray
    duration: float = quantity("(0, 1e6] s", "duration")
    sample_rate: float = quantity("(0, 1e5] Hz", "sample_rate", 500.0)
    load: float = quantity("[0, 1e4] kg", "load", 0.0)
    settle: float = quantity("[0, 1e4] s", "settle", 4.0)
    approach: float = quantity("[0, 1e6] s", "approach", 0.0)
    name: str = ""

    def __post_init__(self) -> None:
        """Check everything that can be checked without the rig.

        Raises:
            InputError: for an unknown drive, NaN, unsorted times, impossible pressures.
            ParameterError: for a number out of range.
        """
        time = np.atleast_1d(np.asarray(self.command_time, dtype=float))
        value = np.atleast_2d(np.asarray(self.command_value, dtype=float))
        start = np.atleast_1d(np.asarray(self.start_pressure, dtype=float))
        arrays = {"command_time": time, "command_value": value, "start_pressure": start}
        drives = Drive.of(self.drive, value.shape[1])
        for name, values in arrays.items():
            odd = np.flatnonzero(~np.isfinite(values))
            if odd.size:
                raise InputError(
                    f"{name.replace('_', ' ')} has {values.flat[odd[0]]} at entry {odd[0]}; give"
                    " finite numbers"
                )
            object.__setattr__(self, name, values)
        if len(time) == 0 or len(start) == 0:
            raise InputError("an experiment needs a command: give a time and a value per muscle")
        columns = len(start) + len(drives.joints)
        if time.ndim != 1 or value.shape != (len(time), columns):
            raise InputError(
                f"command values have shape {value.shape}; {len(time)} times and {len(start)}"
                f" muscles need ({len(time)}, {columns})"
            )
        if time[0] != 0.0 or np.any(np.diff(time) <= 0.0):
            raise InputError("command times must start at 0 and increase")
        _check_values(drives, value, start)
        for name, spec in specs(Experiment):
            check_value(f"experiment.{name}", getattr(self, name), spec)
        samples = self.duration * self.sample_rate
        if round(samples) < 1:
            raise InputError(
                f"{self.duration:g} s at {self.sample_rate:g} Hz end before the second sample: give"
                " a higher sample rate or a longer duration"
            )
        if samples > RUN_SAMPLES:
            raise InputError(
                f"{self.duration:g} s at {self.sample_rate:g} Hz are {samples:,.0f} samples; a run"
                f" has {RUN_SAMPLES:,} at most: lower the sample rate, or simulate parts"
            )

    @cached_property
    def drives(self) -> Drive:
        """``drive`` of every column."""
        return Drive.of(self.drive, self.command_value.shape[1])

    @cached_property
    def _motions(self) -> dict[int, CubicHermiteSpline]:
        """Imposed motion of each column: cubics with one slope where they meet.

        A motion whose speed jumped would take an infinite force. The slope is that of the parabola
        through a value and its neighbours.
        """
        from scipy.interpolate import CubicHermiteSpline

        time, edge_order = self.command_time, 2 if len(self.command_time) > 2 else 1
        return {
            column: CubicHermiteSpline(
                time, values, np.gradient(values, time, edge_order=edge_order)
            )
            for column, values in enumerate(self.command_value.T)
            if self.drives.kinds[column] in IMPOSED
        }

    def command_at(self, times: ArrayLike) -> FloatArray:
        """Command (n, m + j) at times (n,) [s], not before 0 where values are held.

        It is the last value, or between two values as its drive says.
        """
        at = np.asarray(times, dtype=float)
        if all(self.drives.between):
            found = np.empty((at.size, self.command_value.shape[1]))
        else:
            # A breakpoint written k * 0.002 must not miss the sample k / 500 by rounding.
            late = at * (1.0 + 1e-12) + 1e-12
            index = np.searchsorted(self.command_time, late, side="right") - 1
            found = self.command_value[np.maximum(index, 0)]
        for column, kind in enumerate(self.drives.kinds):
            values = self.command_value[:, column]
            if kind in IMPOSED and len(values) > 1:
                found[:, column] = self._motions[column](np.minimum(at, self.command_time[-1]))
            elif DRIVES[kind].between:
                found[:, column] = np.interp(at, self.command_time, values)
        return found


def _check_values(drives: Drive, value: FloatArray, start: FloatArray) -> None:
    """Refuse values that their column's drive cannot have."""
    kinds = np.array(drives.kinds)
    pressures = np.append(start, value[:, kinds == "pressure_set"])
    if np.any(pressures < 0.0):
        raise InputError(
            f"pressure {pressures.min() / 1e3:g} kPa is negative; give 0 or more: pressures are"
            " gauge, 0 is the atmosphere, and the rig has no vacuum"
        )
    # A sensor at a vented muscle may read a little below the atmosphere, but never a vacuum.
    readings = value[:, kinds == "measured"]
    if np.any(readings < _LOWEST_READING):
        raise InputError(
            f"a measured pressure of {readings.min() / 1e3:g} kPa is no gauge pressure of a"
            " muscle; give gauge pressures, 0 at the atmosphere"
        )
    shares = value[:, np.isin(kinds, ("valve", "pulse"))]
    if np.any(np.abs(shares) > 1.0):
        raise InputError(
            f"valve command {shares.flat[np.argmax(np.abs(shares))]:g} is outside [-1, 1]"
        )
    if np.any(value[:, kinds == "sealed"] != 0.0):
        raise InputError("a sealed muscle takes no command: give 0 in its column")


def pressure_step(
    start_pressure: ArrayLike,
    final_pressure: ArrayLike,
    *,
    duration: float,
    load: float = 0.0,
    sample_rate: float = 500.0,
    name: str = "",
) -> Experiment:
    """Experiment in which the set points jump at time 0.

    Args:
        start_pressure: (m,) gauge pressures at rest [Pa].
        final_pressure: (m,) gauge pressures from time 0 [Pa].
        duration: [s].
        load: [kg].
        sample_rate: [Hz].
        name: for messages and legends.

    Warns:
        UserWarning: if all are whole numbers below 1000, which may be meant in kPa.

    Raises:
        InputError: if there are not as many pressures before as after; as `Experiment`.
        ParameterError: as `Experiment`.
    """
    start, final = np.asarray(start_pressure, dtype=float), np.asarray(final_pressure, dtype=float)
    if start.size != final.size:
        raise InputError(
            f"{start.size} start pressures and {final.size} final ones; give one of each for every"
            " muscle"
        )
    both = np.append(start, final)
    if 0.0 < both.max(initial=0.0) < _NONE_IN_KPA and not np.any(both % 1.0):
        warnings.warn(
            f"the highest pressure is {both.max():g} Pa, at which no muscle moves; for"
            f" {both.max():g} kPa, write {both.max():g}e3",
            stacklevel=2,
        )
    return Experiment(
        drive="pressure_set",
        command_time=np.zeros(1),
        command_value=np.atleast_2d(final),
        start_pressure=start,
        duration=duration,
        load=load,
        sample_rate=sample_rate,
        name=name,
    )
