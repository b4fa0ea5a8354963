"""Fit simulator parameters to several trials by bounded least squares in units of the noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.encoding import CheckpointFile, to_dict
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.bounded_least_squares import latin_hypercube
from pamsim.inference.difference_jacobian import BatchedResidual
from pamsim.inference.fit_summary import judged, summarise_fit
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.search import NEAR, RowWeights, SearchEnd, SearchState, search
from pamsim.inference.simulator_fit import SearchProgress, Simulate, SimulatorFit

_SHARPENED = 3  # times that differences are taken at the optimum
_STRAIGHT = 0.5  # standard errors over which a Jacobian is as good as one taken after them
_SAME = 1e-6  # relative difference of numbers of one fit, written and read

_ON_BOUND = 1e-3  # of the range
_INSIDE = 0.05  # of the range: where a start on a bound is moved to
_TRIES = 3  # further sets of starts drawn where simulations diverge
_FEWEST = 8  # drawn at a time, so that they spread


def fit_simulator(
    simulate: Simulate,
    parameters: Sequence[FreeParameter],
    *,
    starts: int = 1,
    seed: int = 0,
    max_iterations: int = 100,
    central: bool = True,
    rough: bool = False,
    jacobian: FloatArray | None = None,
    progress: Callable[[SearchProgress], None] | None = None,
    checkpoint: CheckpointFile | None = None,
) -> SimulatorFit:
    """Fit parameters of a simulator to what was measured.

    Every residual counts in units of its channel's noise, which is estimated on the way. The search
    is a trust-region method within the ranges (`bounded_least_squares`), from the nominal values
    and further starts; a simulation that diverges shortens its step. The same seed gives the same
    result. The simulator is called with all vectors of a Jacobian at once. A step that goes as the
    Jacobian said updates it (`secant_update`); after any other, differences are taken again.

    Args:
        simulate: parameter vectors, shape (k, p) [parameter units], to the residual blocks of each.
        parameters: ranges, starts, priors.
        starts: how many to follow; the best counts, the others show whether it is the only optimum.
        seed: of the starts.
        max_iterations: steps tried per start.
        central: differences at the optimum, from which it is sharpened and judged, to both sides,
            for 2 p simulations, rather than to one.
        rough: True ends each search near the optimum, with the noise estimated once, and judges
            from the Jacobian of the search: a place to begin a better fit from.
        jacobian: of the residual per range where the parameters start, (n, p), known nearly; the
            first differences if left out.
        progress: called after each Jacobian.
        checkpoint: keeps finished starts and the current one; an interrupted fit that is called
            again with it goes on from there.

    Returns:
        The fit; read its status before its numbers.

    Raises:
        InputError: no parameters, a name twice, no starts or steps, a seed below 0, a simulation
            that diverges everywhere, residuals whose layout changes, another fit's checkpoint.
    """
    _check(parameters, starts, max_iterations, seed)
    residual = BatchedResidual(simulate, parameters)
    starting = _starting_places(residual, parameters, starts, seed)
    first = starting[0][1]
    cost = RowWeights(residual, parameters, first)
    about = {
        "parameters": parameters,
        "trials": [
            [p.block.trial, p.block.channel, p.block.residual.size] for p in residual.places
        ],
        "residuals": cost.noise.estimate(first),
        "options": {
            "starts": starts,
            "seed": seed,
            "max_iterations": max_iterations,
            "rough": rough,
        },
    }
    state = _FitState(checkpoint, to_dict(about), residual)

    def note(now: SearchState) -> None:
        state.reached(now)
        if progress is not None:
            miss = residual.at(now.place)
            assert miss is not None
            progress(
                SearchProgress(
                    start=len(state.finished),
                    starts=len(starting),
                    iteration=now.iterations,
                    cost=float(np.mean((cost.weight(now.noise) * miss) ** 2)),
                )
            )

    while len(state.finished) < len(starting):
        begin = state.current
        if begin is None:
            place, miss = starting[len(state.finished)]
            residual.begin(place, miss, None if state.finished else jacobian)
            begin = SearchState(place, cost.noise.estimate(miss))
        state.finish(search(cost, begin, max_iterations, note, rough=rough, arrived=NEAR))
    places = [place for place, _ in starting]
    best = min(state.finished, key=lambda end: end.objective)
    if not rough:
        best = _sharpened(cost, parameters, best, max_iterations, note, central=central)
    followed = residual.followed(best.state.place, cost.weight(best.state.noise))
    return summarise_fit(cost, parameters, places, state.finished, best, followed)


def shown(
    simulate: Simulate, parameters: Sequence[FreeParameter]
) -> tuple[NDArray[np.bool_], FloatArray]:
    """Which parameters the data show where the search begins, (p,), and the Jacobian there.

    One is shown if its whole range moves the residual by more than the noise: alone, it would then
    be known better than by its range. The Jacobian (n, p) is that of the residual, per range.

    Raises:
        InputError: for a simulation that diverges everywhere.
    """
    residual = BatchedResidual(simulate, parameters)
    ((place, first),) = _starting_places(residual, parameters, 1, 0)
    cost = RowWeights(residual, parameters, first)
    jacobian = residual.jacobian(place)
    weight = cost.weight(cost.noise.estimate(first))
    return np.linalg.norm(weight[:, np.newaxis] * jacobian, axis=0) > 1.0, jacobian


def _starting_places(
    residual: BatchedResidual, parameters: Sequence[FreeParameter], starts: int, seed: int
) -> list[tuple[FloatArray, FloatArray]]:
    """Find places where the simulation does not diverge.

    On a bound many parameters have no slope (friction 0, a dead zone of 0), and the search would
    stay there; a nominal value on a bound is moved inside by 5 % of the range.

    The first is the nominal one, unless it diverges, the others are a Latin hypercube. Places are
    (p,), in the unit cube, each with its residual (n,); there are fewer than ``starts`` if
    simulations diverge almost everywhere.

    Raises:
        InputError: all tried diverge.
    """
    rng = np.random.default_rng(seed)
    nominal = residual.scale.to_unit(np.array([p.start for p in parameters]))
    nominal = np.where(nominal < _ON_BOUND, _INSIDE, nominal)
    nominal = np.where(nominal > 1.0 - _ON_BOUND, 1.0 - _INSIDE, nominal)
    drawn = np.vstack([nominal, _spread(rng, starts - 1, nominal.size)])
    good: list[tuple[FloatArray, FloatArray]] = []
    tried = 0
    for _ in range(1 + _TRIES):
        tried += len(drawn)
        good += [
            (place, misfit)
            for place, misfit in zip(drawn, residual.many(drawn), strict=True)
            if misfit is not None
        ]
        if len(good) >= starts:
            return good[:starts]
        drawn = _spread(rng, max(starts - len(good), _FEWEST), nominal.size)
    if not good:
        raise InputError(
            f"the simulation diverges at all {tried} starts tried; narrow the ranges of"
            f" {', '.join(p.name for p in parameters)} or start nearer to the rig"
        )
    return good


def _spread(rng: np.random.Generator, count: int, size: int) -> FloatArray:
    return _INSIDE + (1.0 - 2.0 * _INSIDE) * latin_hypercube(rng, count, size)


def _sharpened(
    cost: RowWeights,
    parameters: Sequence[FreeParameter],
    end: SearchEnd,
    max_iterations: int,
    note: Callable[[SearchState], None],
    *,
    central: bool,
) -> SearchEnd:
    """Search on from an end until differences taken there agree that it is the optimum."""
    for _ in range(_SHARPENED):
        jacobian = cost.residual.jacobian(end.state.place, central=central)
        short = judged(cost, parameters, end, jacobian).short
        if not end.converged or end.state.steps >= max_iterations:
            break
        end = search(cost, replace(end.state, round=1), max_iterations, note)
        if short < _STRAIGHT:
            break
    return end


def _check(parameters: Sequence[FreeParameter], starts: int, steps: int, seed: int) -> None:
    if not parameters:
        raise InputError("no parameter to fit; free at least one")
    names = [p.name for p in parameters]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"parameter {twice[0]!r} is given twice")
    if starts < 1 or steps < 1:
        raise InputError(f"{starts} starts of {steps} steps: at least one of each is needed")
    if seed < 0:
        raise InputError(f"`seed` is {seed}; it must be 0 or above")


class _FitState:
    """What is not lost when a fit is interrupted: finished starts and the current one.

    ``about`` is what the fit is about, JSON-safe. The residual's counters are carried on.

    Raises:
        InputError: the checkpoint belongs to another fit.
    """

    def __init__(
        self, checkpoint: CheckpointFile | None, about: dict[str, Any], residual: BatchedResidual
    ) -> None:
        self._checkpoint, self._about, self._residual = checkpoint, about, residual
        self.finished: list[SearchEnd] = []
        self.current: SearchState | None = None
        saved = None if checkpoint is None else checkpoint.load()
        if saved is None:
            return
        for what, now in about.items():
            if not _equal(saved.get("identity", {}).get(what), now):
                raise InputError(
                    f"the checkpoint belongs to another fit: its {what} differ; remove it"
                    " to start again"
                )
        self.finished = [
            SearchEnd(**{**end, "state": _read(end["state"])}) for end in saved["finished"]
        ]
        self.current = None if saved["current"] is None else _read(saved["current"])
        residual.evaluations += saved["evaluations"]
        residual.calls += saved["calls"]
        residual.diverged += saved["diverged"]

    def reached(self, state: SearchState) -> None:
        self.current = state
        self._save()

    def finish(self, end: SearchEnd) -> None:
        self.finished.append(end)
        self.current = None
        self._save()

    def _save(self) -> None:
        if self._checkpoint is not None:
            state = {
                "identity": self._about,
                "finished": self.finished,
                "current": self.current,
                "evaluations": self._residual.evaluations,
                "calls": self._residual.calls,
                "diverged": self._residual.diverged,
            }
            self._checkpoint.save(to_dict(state))


def _read(saved: Mapping[str, Any]) -> SearchState:
    return SearchState(**{**saved, "place": np.array(saved["place"], dtype=np.float64)})


def _equal(saved: Any, now: Any) -> bool:
    if isinstance(saved, dict) and isinstance(now, dict):
        return saved.keys() == now.keys() and all(_equal(saved[k], now[k]) for k in saved)
    if isinstance(saved, list) and isinstance(now, list):
        return len(saved) == len(now) and all(map(_equal, saved, now))
    if isinstance(saved, float) and isinstance(now, float):
        return abs(saved - now) <= _SAME * max(abs(saved), abs(now))
    return saved == now
