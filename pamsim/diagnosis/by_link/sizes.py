"""How well the parameters of a fitted model are known, by the scatter of inputs and of noise.

Two standard errors are made, and the wider one counts. One is that of the noise alone. The other is
the jackknife over inputs, each left out with all of its repeats: what a formula gets wrong differs
from input to input, so that it holds where the formula is not exact, seen or not. Of one input or
two, units are left out instead: trials, which show what differs from trial to trial and nothing of
the formula, or parts of trials, which show what differs along them. Both are linear about the fit.
An interval lies about the size that shorter time steps would lead to, and holds the fitted one. It
ends where the parameter's range does: a friction below zero was not tried.

Source: J. Tukey, Annals of Mathematical Statistics 29 (1958) (jackknife); D. Freedman, The American
Statistician 60 (2006), on what such errors mean where the model is wrong.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student_t

from pamsim.comparison.chain_runs import MIDDLE
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.link_fit import PRIOR, LinkFitter, LinkModel

_FEWEST = 3  # inputs that are left out one by one: of two, Student's quantile is 12.7


@dataclass(frozen=True, kw_only=True)
class Size:
    """Value of a parameter."""

    value: float  # as fitted [SI]
    interval95: tuple[float, float]  # 95 % interval [SI]; infinite where the data do not show it


def sizes(fitter: LinkFitter, model: LinkModel) -> dict[str, Size]:
    """Parameters of a fitted model's effects, each with its interval."""
    errors = SizeErrors(fitter, model)
    shorter = errors.of_time_steps()
    found: dict[str, Size] = {}
    for parameter in (p for effect in model.effects for p in effect.parameters):
        name = parameter.name
        if name not in model.sensitivities:
            continue
        value, ends = model.values[name], (-np.inf, np.inf)
        (reach,) = errors.reach({name: np.ones(1)}).tolist()
        if np.isfinite(reach):
            middle = value + shorter[name]
            ends = max(parameter.low, middle - reach), min(parameter.high, middle + reach)
        found[name] = Size(value=value, interval95=(min(value, ends[0]), max(value, ends[1])))
    return found


class SizeErrors:
    """Errors of the parameters of a fitted model, and of sums of them."""

    def __init__(self, fitter: LinkFitter, model: LinkModel) -> None:
        self._fitter, self._model = fitter, model
        self._names = list(model.sensitivities)
        jacobian, nuisance = model.jacobian(), fitter.nuisance
        weight = np.array([1.0 / PRIOR if n in nuisance else 0.0 for n in self._names])
        stated = np.array(
            [
                (model.values[n] - nuisance[n]) / abs(nuisance[n]) if n in nuisance else 0.0
                for n in self._names
            ]
        )
        square, slope = jacobian.T @ jacobian + np.diag(weight**2), jacobian.T @ model.rows
        self._jacobian, self._inverse = jacobian, np.linalg.pinv(square, hermitian=True)
        group_of = fitter.units.fitted.group_of
        if np.unique(group_of).size < _FEWEST:
            group_of = fitter.units.fitted.unit_of
        moved: list[FloatArray] = []
        for group in np.unique(group_of):
            own = group_of == group
            left = square - jacobian[own].T @ jacobian[own]
            force = slope - jacobian[own].T @ model.rows[own] + weight**2 * stated
            moved.append(-np.linalg.pinv(left, hermitian=True) @ force)
        self._spread = np.array(moved) - np.mean(moved, axis=0)  # (groups, p)

    def reach(self, weights: Mapping[str, FloatArray]) -> FloatArray:
        """Half width of the 95 % intervals of sums of parameters, (n,), by their weights (n,).

        Infinite where the data do not show one of them.
        """
        columns: list[FloatArray] = []
        unseen = np.zeros(len(next(iter(weights.values()))), dtype=bool)
        for name, column in zip(self._names, self._jacobian.T, strict=True):
            own = np.asarray(weights.get(name, np.zeros(unseen.size)))
            columns.append(own * self._fitter.scale(name, self._model.effects))
            if not np.any(column):
                unseen |= own != 0.0
        of_each = np.stack(columns, axis=1)
        noise = np.einsum("np,pq,nq->n", of_each, self._inverse, of_each)
        count = len(self._spread)
        parts = (count - 1) / count * np.sum((of_each @ self._spread.T) ** 2, axis=1)
        quantile = float(student_t.ppf(0.975, max(count - 1, 1)))
        reach = np.maximum(1.96 * np.sqrt(np.clip(noise, 0.0, None)), quantile * np.sqrt(parts))
        return np.where(unseen, np.inf, reach)

    def of_time_steps(self) -> dict[str, float]:
        """By how much shorter time steps would move each parameter."""
        rows = _of_time_steps(self._fitter, self._model)
        shifts = (-self._inverse @ (self._jacobian.T @ rows)).tolist()
        return {
            name: shift * self._fitter.scale(name, self._model.effects)
            for name, shift in zip(self._names, shifts, strict=True)
        }


def sharpened(fitter: LinkFitter, model: LinkModel) -> LinkModel:
    """A model with the sensitivities of the time steps that its fit has ended in.

    Fits take theirs from long steps, which may hide what is as short as they are: a lag of 4 ms
    changed next to nothing in steps of 5 ms.
    """
    names = list(model.sensitivities)
    sets, steps = fitter.moved(model, names)
    base, *moved = fitter.in_steps(model, [model.values, *sets], fitter.short)
    if base is None:
        return model
    found = {
        name: model.sensitivities[name] if r is None else fitter.whiten(r - base) / step
        for name, step, r in zip(names, steps, moved, strict=True)
    }
    return replace(model, sensitivities=found)


def _of_time_steps(fitter: LinkFitter, model: LinkModel) -> FloatArray:
    """Change of a model's rows (f,) if these time steps went to zero, to first order."""
    longer, shorter = (fitter.in_steps(model, [model.values], n)[0] for n in (MIDDLE, 1))
    if longer is None or shorter is None:
        return np.zeros_like(model.rows)
    return fitter.short * fitter.whiten(shorter - longer)
