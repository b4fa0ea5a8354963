"""Refits to the trials that are not held out: nuisance parameters and effects together."""

from __future__ import annotations

import json
from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pamsim.comparison.candidate import of_all
from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.signature import TangentSpace
from pamsim.inference.bounded_least_squares import (
    BreakdownError,
    Fit,
    Jacobian,
    bounded_least_squares,
)
from pamsim.inference.difference_jacobian import Residuals, difference_jacobian, secant_updated
from pamsim.inference.free_parameter import FreeParameter, SearchScale

Remembered = MutableMapping[str, Mapping[str, Any]]
"""Fits that are done: what was fitted from where -> ``place``, ``cost`` and ``jacobian``.

The Jacobian is that of the descent, which its steps have updated: one that is computed again where
the fit ended is another, and all that follows from it would be.
"""

_STEP = 1e-4  # of a range, for differences: wide enough to bridge the kinks of switching valves
_TOLERANCE, _LAST_TOLERANCE = 1e-3, 1e-5  # of cost and place; while comparing, at the end
_FAR = 1.0  # fall of the loss beyond which a kept Jacobian is no longer good
_LEEWAY = 1.5  # factor on what a Jacobian promises: it is of first order

EDGE = 1e-3
"""Share of a range from its ends that counts as an end."""


@dataclass(frozen=True, kw_only=True)
class Refit:
    """The end of a fit.

    Attributes:
        parameters: p that were fitted.
        values: name -> value [SI].
        residual: (n,) of all trials, held out ones too [SI].
        cost: mean square over the fitted trials, in units of the noise.
        jacobian: (f, p) change of the weighted residual of the fitted trials per range.
        at_bound: names that ended on their range's ends.
    """

    parameters: tuple[FreeParameter, ...]
    values: dict[str, float]
    residual: FloatArray
    cost: float
    jacobian: FloatArray
    at_bound: tuple[str, ...]


class Fitter:
    """Fits by Gauss-Newton steps within ranges, with a Jacobian kept where it hardly changes.

    The Jacobian of the nuisance parameters is computed once, at the fit of the base model, and
    serves every effect that changes little: such a fit costs its own columns and the steps. While
    a fit goes on, each step's own change of the residual updates the Jacobian.

    Args:
        simulator: of all trials.
        floor: of the noise.
        remembered: fits of an interrupted run; new ones are added.
    """

    def __init__(
        self,
        simulator: TrialSimulator,
        floor: NoiseFloor,
        remembered: Remembered | None = None,
    ) -> None:
        self.simulator = simulator
        self.floor = floor
        self.fitted = simulator.fitted
        self._remembered: Remembered = {} if remembered is None else remembered
        fitted = simulator.layout.trials(held_out=False)
        weights = simulator.layout.weights(floor.sd)[self.fitted]
        channels = len(simulator.layout.channels)
        self.weights = weights / np.sqrt(len(fitted) * channels)
        self._jacobian: dict[str, FloatArray] = {}

    def weighted(self, residual: FloatArray) -> FloatArray:
        """Rows (f,) of the fitted trials out of (n,) [SI] in units of noise.

        Their sum of squares is the mean loss.
        """
        return residual[self.fitted] * self.weights

    def unexplained(self, fit: Refit) -> tuple[TangentSpace, FloatArray]:
        """What a fit misses that its own parameters cannot explain, to first order.

        Args:
            fit: of any parameters.

        Returns:
            The tangent space of its parameters, and measured minus simulated (f,) projected by it,
            in units of noise.
        """
        space = TangentSpace(fit.jacobian)
        return space, space.project_out(-self.weighted(fit.residual))

    def changes(
        self, sets: Sequence[Mapping[str, float]], at: FloatArray
    ) -> list[FloatArray | None]:
        """How parameter sets change the weighted residual.

        Args:
            sets: values by name [SI].
            at: (f,) weighted residual to compare with.

        Returns:
            For each (f,), or None where the simulation breaks down.
        """
        return [
            None if rows is None else rows * self.weights - at
            for rows in self.simulator.fit_rows(sets)
        ]

    def jacobian(
        self, parameters: Sequence[FreeParameter], values: Mapping[str, float], at: FloatArray
    ) -> FloatArray:
        """Change of the weighted residual per range of each parameter, shape (f, p).

        Args:
            parameters: p of them.
            values: of all that is not at the rig's own value [SI].
            at: (f,) weighted residual there, in coarse steps.
        """
        place = SearchScale(parameters).place(values)
        return difference_jacobian(self._residuals(parameters, values), place, at, _STEP)

    def keep_jacobian(self, fit: Refit) -> None:
        """Use the Jacobian at a fit of nuisance parameters for all later fits."""
        self._jacobian = {p.name: fit.jacobian[:, i] for i, p in enumerate(fit.parameters)}

    def fit(
        self,
        parameters: Sequence[FreeParameter],
        starts: Sequence[Mapping[str, float]],
        *,
        most: int = 12,
        worth: float = np.inf,
    ) -> Refit:
        """Fit from one or more starts; the best end counts.

        Args:
            parameters: p of them.
            starts: name -> value for each [SI].
            most: steps tried.
            worth: cost that a fit must come to. One that promises less ends where it is, but not
                before its first step: some effects, such as a slow valve, grow with the square of
                their size, so that a small start promises next to nothing.

        Raises:
            InputError: if the simulation breaks down at every start.
        """
        key = json.dumps([[p.name for p in parameters], [dict(s) for s in starts]])
        known = self._remembered.get(key)
        if known is not None:
            place = np.array(known["place"], dtype=np.float64)
            return self._finished(parameters, place, float(known["cost"]), known["jacobian"])
        fits = [self._search(parameters, start, most, worth) for start in starts]
        best = min((f for f in fits if f is not None), key=lambda f: f.cost, default=None)
        if best is None:
            names = ", ".join(p.name for p in parameters)
            raise InputError(f"the simulation breaks down wherever a fit of {names} begins")
        jacobian = np.ascontiguousarray(best.jacobian)
        self._remembered[key] = {
            "place": best.x.tolist(),
            "cost": best.cost,
            "jacobian": jacobian,
        }
        return self._finished(parameters, best.x, best.cost, jacobian)

    def _search(
        self,
        parameters: Sequence[FreeParameter],
        start: Mapping[str, float],
        most: int,
        worth: float,
    ) -> Fit | None:
        scale = SearchScale(parameters)
        begin = np.clip(scale.place(start), EDGE, 1.0 - EDGE)

        def jacobian(kept: Mapping[str, FloatArray]) -> Jacobian:
            return secant_updated(
                lambda place, here: self._columns(parameters, scale.values(place), here, kept)
            )

        def descended(place: FloatArray, kept: Mapping[str, FloatArray]) -> Fit | None:
            return self.steps(parameters, place, jacobian(kept), most, worth=worth)

        fit = descended(begin, self._jacobian)
        if fit is not None and self._jacobian and fit.start_cost - fit.cost > _FAR:
            return descended(fit.x, {}) or fit
        return fit

    def steps(
        self,
        parameters: Sequence[FreeParameter],
        begin: FloatArray,
        jacobian: Jacobian,
        most: int,
        *,
        fine: bool = False,
        worth: float = np.inf,
    ) -> Fit | None:
        """Descend from a place.

        Args:
            parameters: p of them.
            begin: (p,) in the unit cube of their ranges.
            jacobian: place and residual there to (f, p).
            most: steps tried.
            fine: whether in fine steps, and to the last of what they resolve.
            worth: see `fit`.

        Returns:
            The end; None if the simulation breaks down at the beginning.
        """
        judged = 0

        def give_up(residual: FloatArray, columns: FloatArray) -> bool:
            nonlocal judged
            judged += 1
            return judged > 1 and _promised(residual, columns) > worth

        try:
            return bounded_least_squares(
                self._residuals(parameters, {}, fine=fine),
                [begin],
                jacobian=jacobian,
                tolerance=_LAST_TOLERANCE if fine else _TOLERANCE,
                gradient_tolerance=1e-10,
                max_steps=most,
                give_up=give_up,
            )
        except BreakdownError:
            return None

    def _residuals(
        self,
        parameters: Sequence[FreeParameter],
        others: Mapping[str, float],
        *,
        fine: bool = False,
    ) -> Residuals:
        """Weighted residual (f,) as a function of the parameters' places, beside other values."""
        scale = SearchScale(parameters)

        def residuals(places: FloatArray) -> list[FloatArray | None]:
            sets = [{**others, **scale.values(place)} for place in places]
            return [
                None if rows is None else rows * self.weights
                for rows in self.simulator.fit_rows(sets, fine=fine)
            ]

        return residuals

    def _columns(
        self,
        parameters: Sequence[FreeParameter],
        values: Mapping[str, float],
        here: FloatArray,
        kept: Mapping[str, FloatArray],
    ) -> FloatArray:
        """The Jacobian (f, p), with the columns that are kept instead of fresh ones."""
        # Where one muscle has a value of its own, the one for all acts on the others only.
        own_values = {of_all(p.name) for p in parameters}
        kept = {name: column for name, column in kept.items() if name not in own_values}
        fresh = [p for p in parameters if p.name not in kept]
        own = iter(self.jacobian(fresh, values, here).T)
        columns = [kept[p.name] if p.name in kept else next(own) for p in parameters]
        return np.stack(columns, axis=1)

    def _finished(
        self,
        parameters: Sequence[FreeParameter],
        place: FloatArray,
        cost: float,
        jacobian: FloatArray,
    ) -> Refit:
        values = SearchScale(parameters).values(place)
        residual = self.simulator.whole(values)
        if residual is None:
            raise InputError(f"held-out trials break down at {values}")
        return Refit(
            parameters=tuple(parameters),
            values=values,
            residual=residual,
            cost=cost,
            jacobian=jacobian,
            at_bound=at_ends(list(values), place),
        )


def _promised(residual: FloatArray, jacobian: FloatArray) -> float:
    """Cost to which a descent may come from a residual (f,) and its Jacobian (f, p)."""
    cost = float(residual @ residual)
    left = TangentSpace(jacobian).project_out(residual)
    return cost - _LEEWAY * (cost - float(left @ left))


def at_ends(names: Sequence[str], place: FloatArray) -> tuple[str, ...]:
    """Names of the parameters whose place (p,) in the unit cube is at an end."""
    ends = np.minimum(place, 1.0 - place) < EDGE
    return tuple(n for n, end in zip(names, ends, strict=True) if end)
