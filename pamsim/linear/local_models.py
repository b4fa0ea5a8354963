"""Local linear models over the operating point, as gain scheduling uses them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.errors import InputError
from pamsim.linear.identified_model import FitStatus, IdentifiedModel
from pamsim.linear.operating_regression import Dependence, dependence


@dataclass(frozen=True)
class OperatingPoint:
    """Where a local model is valid.

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
    """A model and the operating point it is valid at.

    Attributes:
        point: the operating point.
        fit: the model there.
    """

    point: OperatingPoint
    fit: IdentifiedModel


@dataclass(frozen=True, eq=False)
class LocalModelMap:
    """All local models, in the order given, and how parameters depend on the point.

    Attributes:
        models: one per operating point.
        dependences: one per parameter that at least two converged fits determine.
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


def local_model_map(models: Sequence[LocalModel]) -> LocalModelMap:
    """Regress the parameters of local models on their operating points.

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
    converged = [model for model in models if model.fit.status is FitStatus.CONVERGED]
    names = list(dict.fromkeys(e.name for model in converged for e in model.fit.estimates))
    dependences = (_dependence(name, converged) for name in names)
    return LocalModelMap(tuple(models), tuple(item for item in dependences if item is not None))


def _dependence(name: str, models: Sequence[LocalModel]) -> Dependence | None:
    logarithmic = name[0] in "Twz" and name != "Tz"
    rows: list[tuple[float, float, OperatingPoint]] = []
    for model in models:
        for item in model.fit.estimates:
            if item.name != name or item.interval95 is None:
                continue
            low, high = item.interval95
            if logarithmic:
                error = float(np.log(high / low)) / (2.0 * model.fit.quantile)
                rows.append((float(np.log(item.value)), error, model.point))
            elif item.value > low:
                # A dead time's interval may be cut at 0 below: its upper half is whole.
                rows.append((item.value, (high - item.value) / model.fit.quantile, model.point))
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
