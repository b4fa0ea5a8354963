"""What a recorded trial must satisfy: commands, an increasing clock, values in their named units.

Nothing is rescaled without a word: a likely wrong unit is refused with the factor that corrects it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import PA_PER_KPA
from pamsim.physics.air import ATMOSPHERE
from pamsim.recordings.columns import Columns

FEWEST_ROWS = 8
LONGEST_GAP = 5.0  # of the clock, in median steps
LEAST_KPA, HIGHEST_KPA = 20.0, 5e3  # fluidic muscles work at some bar

_JITTER = 0.01  # share of the median step from which a clock is said not to be uniform
_LOWEST_GAUGE_KPA = -20.0  # zero errors of sensors are smaller, and the rigs have no vacuum
_FEW_DEG = 1.6  # what a quarter turn reads if written in rad
_WIDE_KPA = 200.0  # pressure difference that turns any free arm by more than that
LARGEST = {"n": (1e6, "N"), "nm": (1e6, "N*m"), "mm": (1e5, "mm")}
"""End of a column's name -> largest number and its unit: a hundred times and more of what the
largest muscles sold pull, 6 kN, and of their lengths."""
_COMMAND = re.compile(r"u\d+|.+_set_kpa|.+_valve")
# Unit, how many of it make a kPa, and how far a held pressure may be from its set point.
_MEANT = (
    ("bar", 0.01, 2.0),
    ("MPa", 0.001, 2.0),
    ("Pa", 1e3, 2.0),
    ("psi", 0.145038, 1.05),
    ("mbar", 10.0, 1.05),
    ("mmHg", 7.50062, 1.05),
)

_NEAR, _SPREAD = 0.05, 0.3
"""Of an atmosphere: by how much the middle of what a pressure reads above its set point may be off
one, and how far its quartiles may be apart, since it takes its time to follow."""


def clock(columns: Columns) -> str:
    """A note if the clock of a trial is not uniform, else nothing.

    Raises:
        InputError: too few rows, time that does not increase, a gap, milliseconds for seconds.
    """
    time, lines, path = columns.values["time_s"], columns.lines, columns.path
    if time.size < FEWEST_ROWS:
        raise InputError(
            f"{path}: {time.size} rows are too few to compare with anything; a trial needs"
            f" {FEWEST_ROWS} or more"
        )
    steps = np.diff(time, prepend=-np.inf)
    columns.refuse(
        steps <= 0.0,
        lambda i: (
            f"time_s = {time[i]:g} does not come after {time[i - 1]:g} in line {lines[i - 1]};"
            " sort the rows and drop repeated times, or state `wraps` of a clock that begins again"
        ),
    )
    steps[0] = median = float(np.median(steps[1:]))
    columns.refuse(
        steps > LONGEST_GAP * median,
        lambda i: (
            f"the clock jumps from {time[i - 1]:g} to {time[i]:g} s, {steps[i] / median:.3g} times"
            " its usual step; split the trial there into two files"
        ),
    )
    if median >= 0.5 and time[-1] - time[0] > 1e3:
        raise InputError(
            f"{path}: time_s steps by {median:g} and runs to {time[-1]:g}: no muscle can be seen"
            " moving at that pace; if the column holds milliseconds, divide it by 1000"
        )
    if np.max(np.abs(steps - median)) <= _JITTER * median:
        return ""
    return f"steps of the clock are not uniform: {steps.min():.4g} to {steps.max():.4g} s"


def units(columns: Columns, drives: Sequence[tuple[str, str]]) -> None:
    """Refuse commands, (column, kind of drive) each, pressures and angles beyond their range."""
    for name, kind in drives:
        measured = f"{name.removesuffix('_set_kpa')}_kpa"
        if kind in ("valve", "pulse"):
            percent = np.abs(columns.values[name]).max() > 2.0
            hint = "; if it is percent, divide the column by 100" if percent else ""
            columns.require_range(name, -1.0, 1.0, f"is outside [-1, 1]{hint}")
        elif kind == "pressure_set":
            vacuum = "is negative; pressures are gauge, and a muscle has no vacuum"
            columns.require_range(name, 0.0, np.inf, vacuum)
            if measured in columns.values:
                _against_set_point(columns, name, measured)
    below = "lies far below the atmosphere; pressures are gauge: correct the sensor's zero"
    counts = "is more than a turn; the column must hold deg, not counts of an encoder"
    for name, value in columns.values.items():
        if name.endswith("_kpa"):
            above = (
                f"is {value.max() / 100.0:.4g} bar, too much for a muscle; if the column holds"
                " mbar, divide it by 10, if Pa by 1000"
            )
            columns.require_range(name, _LOWEST_GAUGE_KPA, HIGHEST_KPA, below, above)
        elif name.endswith("_deg"):
            columns.require_range(name, -360.0, 360.0, counts)
        elif (ending := name.rpartition("_")[2]) in LARGEST:
            most, unit = LARGEST[ending]
            too_much = f"is more than any muscle makes; the column must hold {unit}"
            columns.require_range(name, -most, most, too_much)


def units_of_all(trials: Sequence[Columns]) -> None:
    """Refuse a whole recording whose pressures or angles are too small for their unit.

    One trial may well be a small one; all of them together are not.
    """
    tops = [
        (float(value.max()), name, columns.path)
        for columns in trials
        # A trial of vented muscles shows nothing but noise.
        if any(_COMMAND.fullmatch(n) and v.max() > 0.0 for n, v in columns.values.items())
        for name, value in columns.values.items()
        if name.endswith("_kpa")
    ]
    if tops:
        require_muscle_pressure(*max(tops, key=lambda entry: entry[0]))
    # A held arm that is pulled at barely turns: then there are forces to see.
    turned = [columns for columns in trials if "angle_deg" in columns.values]
    if not turned or any(name.startswith("force") for c in trials for name in c.values):
        return
    most = max(float(np.ptp(columns.values["angle_deg"])) for columns in turned)
    pairs = (
        (columns.values.get(f"p1{end}"), columns.values.get(f"p2{end}"))
        for columns in turned
        for end in ("_kpa", "_set_kpa")
    )
    apart = (float(np.ptp(a - b)) for a, b in pairs if a is not None and b is not None)
    widest = max(apart, default=0.0)
    if widest > _WIDE_KPA and 0.1 < most < _FEW_DEG:
        raise InputError(
            f"{turned[0].path}: angle_deg never moves by more than {most:.3g}, though the"
            f" pressures move {widest:.0f} kPa apart; if the columns hold rad, multiply them by"
            " 57.29578"
        )


def require_muscle_pressure(top: float, name: str, path: Path) -> None:
    """Refuse the highest pressure of a file [kPa] if only one in another unit is so low."""
    if 0.0 < top < LEAST_KPA:
        raise InputError(
            f"{path}: no pressure is above {name} = {top:g}, too little for a muscle; if the"
            " columns hold bar, multiply them by 100, if MPa by 1000"
        )


def _against_set_point(columns: Columns, set_point: str, measured: str) -> None:
    """A held pressure follows its set point.

    A constant ratio far from 1 is another unit, an atmosphere more is no gauge pressure.
    """
    wanted, got = columns.values[set_point], columns.values[measured]
    one = ATMOSPHERE / PA_PER_KPA
    low, middle, top = np.quantile(got - wanted, (0.25, 0.5, 0.75))
    follows = np.ptp(wanted) > 0.5 * one and top - low < _SPREAD * one
    if follows and abs(middle - one) < _NEAR * one:
        raise InputError(
            f"{columns.path}: {measured} is {middle:.0f} kPa above {set_point}, as an absolute"
            f" pressure is; pressures are gauge: subtract {one:g} kPa from {measured}"
        )
    high = wanted > max(0.5 * float(np.max(wanted)), 1e-9)
    if np.count_nonzero(high) < FEWEST_ROWS:
        return
    # Quartiles, because the pressure takes its time to follow, and because the noise of a sensor
    # without supply has no ratio that stays.
    low, middle, top = np.quantile(got[high] / wanted[high], (0.25, 0.5, 0.75))
    for unit, ratio, slack in _MEANT:
        for name, expected in ((measured, ratio), (set_point, 1.0 / ratio)):
            # Measured in Pa and set in MPa are one ratio: only one gives a muscle's pressure.
            meant = float(np.max(columns.values[name])) / ratio
            likely = LEAST_KPA < meant < HIGHEST_KPA
            if likely and expected / slack < low and top < expected * slack:
                raise InputError(
                    f"{columns.path}: {measured} is {middle:.3g} times {set_point}, so that one of"
                    f" them is not kPa: {name} looks like {unit}; multiply it by {1 / ratio:.4g}"
                )
