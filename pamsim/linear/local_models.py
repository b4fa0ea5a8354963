"""Local linear models against the operating point: the map that gain scheduling starts from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.errors import InputError
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.identified_model import FitStatus, IdentifiedModel
from pamsim.linear.operating_regression import Dependence, dependence
from pamsim.linear.signal_record import SignalRecord

_NORMAL = 1.959964


@dataclass(frozen=True)
class OperatingPoint:
    """Where a local model holds.

    Attributes:
        pressure: mean pressure level [Pa, gauge].
        load: mass on the arm [kg].
        direction: +1 rising, -1 falling, 0 both.
        amplitude: half the peak to peak of the input [input unit].
    """

    pressure: float
    load: float = 0.0
    direction: int = 0
    amplitude: float = 0.0


@dataclass(frozen=True, eq=False)
class LocalModel:
    """One fit and the point it holds at.

    Attributes:
        point: the operating point.
        fit: the model there.
    """

    point: OperatingPoint
    fit: IdentifiedModel


@dataclass(frozen=True, eq=False)
class LocalModelMap:
    """All local models, in the order given, and what changes between them.

    Attributes:
        models: one per operating point.
        dependences: one per parameter that at least two trusted fits determine.
    """

    models: tuple[LocalModel, ...]
    dependences: tuple[Dependence, ...]

    def __getitem__(self, parameter: str) -> Dependence:
        """Return how ``parameter``, such as ``K``, changes over the map."""
        for item in self.dependences:
            if item.parameter == parameter:
                return item
        known = ", ".join(item.parameter for item in self.dependences) or "none"
        raise InputError(f"no dependence of {parameter!r} in this map; it has {known}")


def local_models(
    records_with_points: Sequence[tuple[SignalRecord | Sequence[SignalRecord], OperatingPoint]],
    *,
    order: int,
    zeros: int = 0,
    dead_time: bool = False,
    real_lags: bool = True,
    start: str = "rest",
) -> LocalModelMap:
    """Fit one model per operating point and say what changes between the points.

    Args:
        records_with_points: trials, one or several, and the point they were made at.
        order: as in :func:`pamsim.linear.continuous_fit.fit_continuous`, as are the others.
        zeros: number of zeros.
        dead_time: whether to estimate a dead time.
        real_lags: real time constants, or any stable poles.
        start: ``rest`` or ``free``.

    Returns:
        The map.

    Raises:
        InputError: no points, or as ``fit_continuous``.
    """
    models: list[LocalModel] = []
    for given, point in records_with_points:
        fit = fit_continuous(
            [given] if isinstance(given, SignalRecord) else given,
            order=order,
            zeros=zeros,
            dead_time=dead_time,
            real_lags=real_lags,
            start=start,
        )
        models.append(LocalModel(point, fit))
    return local_model_map(models)


def local_model_map(models: Sequence[LocalModel]) -> LocalModelMap:
    """Say what changes between local models that are already fitted.

    Only fits with the status ``converged`` enter the regressions; all stay in the table.

    Args:
        models: the local models.

    Returns:
        The map.

    Raises:
        InputError: no models.
    """
    if not models:
        raise InputError("no local models given; give at least one operating point")
    trusted = [model for model in models if model.fit.status is FitStatus.CONVERGED]
    names = list(dict.fromkeys(e.name for model in trusted for e in model.fit.estimates))
    found = (_dependence(name, trusted) for name in names)
    return LocalModelMap(tuple(models), tuple(item for item in found if item is not None))


def _dependence(name: str, models: Sequence[LocalModel]) -> Dependence | None:
    logarithmic = name[0] in "Twz" and name != "Tz"
    rows: list[tuple[float, float, OperatingPoint]] = []
    for model in models:
        for item in model.fit.estimates:
            if item.name != name or item.interval95 is None:
                continue
            low, high = item.interval95
            if logarithmic:
                error = float(np.log(high / low)) / (2.0 * _NORMAL)
                rows.append((float(np.log(item.value)), error, model.point))
            elif item.value > low:
                # A dead time's interval may be cut at 0 below: its upper half is whole.
                rows.append((item.value, (high - item.value) / _NORMAL, model.point))
    rows = [row for row in rows if np.isfinite(row[1]) and row[1] > 0.0]
    if len(rows) < 2:
        return None
    values, errors = (np.array([row[k] for row in rows]) for k in (0, 1))
    points = [row[2] for row in rows]
    regressors = {
        kind: np.array([float(getattr(point, kind)) for point in points])
        for kind in ("pressure", "load", "direction", "amplitude")
    }
    return dependence(name, values, errors, regressors, logarithmic=logarithmic)
