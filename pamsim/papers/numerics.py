"""Printed numbers of a paper, what their rounding leaves open; roots, derivatives and RMS."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.optimize
from scipy.special import stdtrit

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray
from pamsim.recordings.printed import Printed, printed_document

# scipy carries no types: what it returns is Any at this file's boundary.
_brentq: Any = scipy.optimize.brentq
_curve_fit: Any = scipy.optimize.curve_fit

_STEP = 1e-30


def rms(values: FloatArray | Sequence[float]) -> float:
    """Root of the mean square, in the unit of the values."""
    return float(np.sqrt(np.mean(np.square(values))))


def least_squares(
    function: Callable[..., FloatArray],
    wanted: FloatArray,
    start: Sequence[float] | FloatArray,
    **options: Any,
) -> tuple[FloatArray, FloatArray]:
    """Numbers at which a function of them is nearest to (n,) wanted values.

    Beside them half their linearised 95 % intervals. The options are those of scipy's
    ``least_squares``.
    """
    values, covariance = _curve_fit(
        lambda _, *v: function(*v), None, wanted, start, **{"method": "trf", **options}
    )
    student = stdtrit(len(wanted) - len(values), 0.975)
    return values, student * np.sqrt(np.diag(covariance))


def root(function: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Where a function with different signs at both ends is zero (Brent's method).

    The tolerance is that of the result, in its unit.
    """
    return float(_brentq(function, low, high, xtol=tolerance))


def derivative(function: Callable[[Any], Any], place: float) -> float:
    """Derivative by a complex step, as `jacobian`, of an analytic function of one number."""
    return float(function(complex(place, _STEP)).imag) / _STEP


def jacobian(function: Callable[[Any], Any], place: Sequence[float]) -> FloatArray:
    """Derivatives (n, m) by complex steps, exact to rounding.

    The function, analytic of (m,) complex numbers, gives (n,) values. (Squire, Trapp, SIAM Review
    40, 1998, 110.)
    """
    steps = np.asarray(place) + 1j * _STEP * np.eye(len(place))
    return np.stack([np.imag(function(step)) for step in steps], axis=1) / _STEP


def propagated(function: Callable[..., float], *numbers: Printed) -> Printed:
    """A function of printed numbers, with how far their rounding lets it move.

    Half a unit of the result is the sum of what half a unit of each number moves it.
    """
    (result,) = propagated_each(lambda *values: [function(*values)], *numbers)
    return result


def propagated_each(
    function: Callable[..., Sequence[float]], *numbers: Printed
) -> tuple[Printed, ...]:
    """As `propagated`, for a function with several results."""
    middle = [number.value for number in numbers]
    value = np.asarray(function(*middle), dtype=np.float64)
    moved = np.zeros_like(value)
    for index, number in enumerate(numbers):
        ends = (
            function(*middle[:index], middle[index] + side * number.half_unit, *middle[index + 1 :])
            for side in (-1.0, 1.0)
        )
        moved += np.max([np.abs(np.asarray(end) - value) for end in ends], axis=0)
    return tuple(map(Printed, value.tolist(), moved.tolist()))


def half_unit(decimals: int) -> float:
    """Half a unit of the last of so many digits printed after the point."""
    return 0.5 * 10.0**-decimals


class PrintedNumbers(NamedTuple):
    """The entries of a table of ``<paper>.toml``, in their printed units, by name.

    Each raises an `InputError` if there is no such entry.
    """

    paper: str
    table: str = "number"

    def all_digits(self, name: str) -> tuple[Printed, ...]:
        """All numbers of an entry, with their digits."""
        entries = _document(self.paper)[self.table]
        if name not in entries:
            raise InputError(f"{self.paper} prints no {name!r}; {nearest(name, entries)}")
        return tuple(several(self.quoted(f"${self.table}.{name}")))

    def digits(self, name: str) -> Printed:
        """The only number of an entry, with its digits."""
        (number,) = self.all_digits(name)
        return number

    def values(self, name: str) -> tuple[float, ...]:
        """All numbers of an entry, without their digits."""
        return tuple(number.value for number in self.all_digits(name))

    def value(self, name: str) -> float:
        """The only number of an entry, without its digits."""
        return self.digits(name).value

    def quoted(self, printed: Any) -> Any:
        """Printed numbers of a file with their digits, or words; ``$table.key`` is looked up."""
        if isinstance(printed, list):
            return [self.quoted(entry) for entry in printed]
        if isinstance(printed, str) and printed.startswith("$"):
            entry = functools.reduce(
                lambda table, key: table[key], printed[1:].split("."), _document(self.paper)
            )
            return self.quoted(entry["value"] if isinstance(entry, Mapping) else entry)
        if isinstance(printed, str | Printed):
            return printed
        return Printed(float(printed), half_unit(0))  # a whole number is printed to 1


@functools.cache
def _document(paper: str) -> Any:
    return printed_document(f"{paper}.toml", digits=True)


def digits_of(number: float | Printed) -> Printed:
    """A number with its rounding; a computed one has none."""
    return number if isinstance(number, Printed) else Printed(float(number), 0.0)


def several(value: Any) -> Sequence[Any]:
    """Numbers, of which a single one may be given as such."""
    return value if isinstance(value, Sequence) and not isinstance(value, str) else (value,)
