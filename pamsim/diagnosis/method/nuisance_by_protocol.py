"""Nuisance parameters by protocol: a complete model needs the same values everywhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats

from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.inference.free_parameter import SearchScale

_alexandergovern: Any = scipy.stats.alexandergovern


@dataclass(frozen=True, kw_only=True)
class NuisanceByProtocol:
    """One nuisance parameter, fitted to every protocol by itself.

    Attributes:
        parameter: its name.
        p_value: of one value for all protocols (Alexander-Govern, trials are the units); 1 where
            there are too few trials.
        values: protocol -> value and 95 % interval [SI]; the other parameters stay at the fit.
    """

    parameter: str
    p_value: float
    values: Mapping[str, tuple[float, float, float]]


def nuisance_by_protocol(fitter: Fitter, base: Refit) -> tuple[NuisanceByProtocol, ...]:
    """One Gauss-Newton step per trial and parameter from the fit of the base model.

    Args:
        fitter: of the trials.
        base: fit of the base model, with its Jacobian.

    Returns:
        One per parameter, the least homogeneous first.
    """
    weighted = fitter.weighted(base.residual)
    scale = SearchScale(base.parameters)
    at = scale.place(base.values)
    rows: dict[str, dict[str, list[slice]]] = {}
    layout = fitter.simulator.layout
    for place in layout.uncut(layout.fitted_places):
        trials = rows.setdefault(place.block.protocol, {})
        trials.setdefault(place.block.trial, []).append(place.rows)
    fitted: list[NuisanceByProtocol] = []
    for i, parameter in enumerate(base.parameters):
        samples: dict[str, FloatArray] = {}
        for protocol, trials in rows.items():
            steps = []
            for parts in trials.values():
                slope = np.concatenate([base.jacobian[r, i] for r in parts])
                missed = np.concatenate([weighted[r] for r in parts])
                square = float(slope @ slope)
                steps.append(-float(slope @ missed) / square if square > 0.0 else np.nan)
            samples[protocol] = np.array(steps)
        known = [s for s in samples.values() if s.size > 1 and np.ptp(s) > 0.0]
        p_value = float(_alexandergovern(*known).pvalue) if len(known) > 1 else 1.0

        def value(step: float, i: int = i) -> float:
            place = at.copy()
            place[i] = min(max(at[i] + step, 0.0), 1.0)
            return float(scale.from_unit(place)[i])

        values: dict[str, tuple[float, float, float]] = {}
        for protocol, steps in samples.items():
            mean = float(np.mean(steps))
            reach = np.inf
            if steps.size > 1:
                quantile = float(scipy.stats.t.ppf(0.975, steps.size - 1))
                reach = quantile * float(np.std(steps, ddof=1)) / np.sqrt(steps.size)
            if np.isfinite(mean):
                values[protocol] = (value(mean), value(mean - reach), value(mean + reach))
        fitted.append(NuisanceByProtocol(parameter=parameter.name, p_value=p_value, values=values))
    return tuple(sorted(fitted, key=lambda r: r.p_value))
