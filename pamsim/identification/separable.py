"""Least squares in which most coefficients enter linearly: several trials, whitened residuals.

Gains, offsets and initial states are solved for exactly at every point of the search, so that only
the poles (and the dead time) are searched: fewer dimensions and far fewer local minima.
Source: variable projection (Golub and Pereyra, SIAM Journal on Numerical Analysis
10, 1973).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray
from pamsim.identification.optimum import Optimum, central_differences
from pamsim.identification.triangular import triangular_factor
from pamsim.inference.bounded_least_squares import bounded_least_squares
from pamsim.inference.trial_noise import WHITE, TrialNoise

_FAR = 1e150  # whose square does not overflow
_FOLLOWED = 4  # of the starts, to the end of a search: most others lead to the same minimum
_DEPENDENT = 1e-12  # singular value over the largest, below which columns are dependent
_STEP = 1e-7  # of a difference, over the width of the bounds
_NARROW = 1e-3  # over the width of the bounds: the size that a coordinate has at least
_FREE_STEP = 1e-6
"""Of a difference, over the size of a coordinate without bounds, 1 at least: a filter with poles
near 1 has rounding errors of 1e-10, which a smaller step would make a part of the slope."""


@dataclass(frozen=True, eq=False)
class LinearPart:
    """The linear coefficients that fit best at one x."""

    theta: FloatArray  # those that all trials share, shape ``(q,)``
    own: list[FloatArray]  # those of each trial, shape ``(l,)``
    blocks: list[FloatArray]  # whitened columns of each trial, its own first and its output last
    noise: TrialNoise  # whitened them

    @property
    def residual(self) -> FloatArray:
        """Whitened residual, shape ``(N,)``."""
        pairs = zip(self.blocks, self.own, strict=True)
        return np.concatenate(
            [b[:, -1] - b[:, :-1] @ np.append(eta, self.theta) for b, eta in pairs]
        )


@dataclass(frozen=True, eq=False)
class Held:
    """What is known of the numbers of a problem before its fit."""

    origin: FloatArray  # of theta, which is ``origin + directions @ free``, shape ``(q,)``
    directions: FloatArray  # in which it is fitted, shape ``(q, f)``
    # the first coefficient of every trial's own; None if that is fitted
    offset: float | None = None

    @property
    def nothing(self) -> bool:
        """Whether all is fitted."""
        count, free = self.directions.shape
        return self.offset is None and count == free

    def optimum(self, at: Optimum) -> Optimum:
        """Return theta in full at an optimum of what was fitted."""
        q, free = self.directions.shape
        p = at.coordinates.size - free
        matrix = np.zeros((p + q, p + free))
        matrix[:p, :p], matrix[p:, p:] = np.eye(p), self.directions
        return at.moved(np.append(np.zeros(p), self.origin), matrix)


def check_held(values: Mapping[str, float], known: Sequence[str]) -> None:
    """Refuse to hold what is no number of a model, or no finite one."""
    for name, value in values.items():
        if name not in known:
            raise InputError(f"`held`: {name!r} cannot be held; {nearest(name, known)}")
        if not np.isfinite(value):
            raise InputError(f"`held`: {name} = {value!r} is not finite; give a number")


@dataclass(frozen=True, eq=False)
class Separable:
    """Predictions ``known(x) + shared(x) @ theta + own(x) @ eta_i`` of trials i."""

    outputs: tuple[FloatArray, ...]  # one measured output per trial, shape ``(N_i,)``
    # ``(x, i)`` -> columns whose coefficients all trials share, shape ``(N_i, q)``
    shared: Callable[[FloatArray, int], FloatArray]
    # ``(x, i)`` -> columns with coefficients of each trial's own, shape ``(N_i, l)``
    own: Callable[[FloatArray, int], FloatArray]
    lower: FloatArray  # bounds of x, shape ``(p,)``
    upper: FloatArray  # same
    sample_times: tuple[float, ...]  # of the trials [s]; those of one share a model of their noise
    # ``(x, i)`` -> part without coefficients, shape ``(N_i,)``; None for none
    known: Callable[[FloatArray, int], FloatArray] | None = None

    def predicted(self, x: FloatArray, i: int, theta: FloatArray, eta: FloatArray) -> FloatArray:
        """Return the prediction of a trial, shape ``(N_i,)``."""
        run = self.shared(x, i) @ theta + self.own(x, i) @ eta
        return run if self.known is None else run + self.known(x, i)

    def unknown(self, x: FloatArray, i: int) -> FloatArray:
        """Return what theta and eta are to explain of a trial's output, shape ``(N_i,)``."""
        return self.outputs[i] if self.known is None else self.outputs[i] - self.known(x, i)

    def holding(self, held: Held) -> Separable:
        """Return the problem of what is not held."""
        if held.nothing:
            return self
        first = int(held.offset is not None)

        def known(x: FloatArray, i: int) -> FloatArray:
            return self.shared(x, i) @ held.origin + (held.offset or 0.0) * self.own(x, i)[:, 0]

        return replace(
            self,
            shared=lambda x, i: self.shared(x, i) @ held.directions,
            own=lambda x, i: self.own(x, i)[:, first:],
            known=known,
        )

    def jacobian(self, x: FloatArray, part: LinearPart) -> FloatArray:
        """Return the slope of the residual at x, shape ``(N, p)``, for a search.

        The linear coefficients are held, then what they can take up is removed: of the exact slope
        that leaves out only what is orthogonal to the residual, so that the gradient is exact.

        Source: Kaufman (BIT 15, 1975).
        """
        theta, edge = part.theta, self.upper - self.lower
        step = np.where(np.isfinite(edge), _STEP * edge, _FREE_STEP * np.maximum(1.0, np.abs(x)))
        step = np.where(x + step > self.upper, -step, step)
        jacobians: list[FloatArray] = []
        factors: list[FloatArray] = []
        for i, (block, eta) in enumerate(zip(part.blocks, part.own, strict=True)):
            slope = np.empty((block.shape[0], x.size))
            for k, at in enumerate(x + np.diag(step)):
                slope[:, k] = self.predicted(at, i, theta, eta)
            here = block[:, :-1] @ np.append(eta, theta)
            if self.known is not None:
                here = here + part.noise.whiten(self.known(x, i), i)
            slope = part.noise.whiten(slope, i)
            slope -= here[:, np.newaxis]
            slope /= step
            jacobians.append(slope)
            factors.append(triangular_factor(np.hstack([block[:, :-1], slope])))
        taken, each = _linear_solution(factors, part.own[0].size, theta.size)
        return np.concatenate(
            [
                block[:, :-1] @ np.concatenate([own, taken]) - slope
                for block, own, slope in zip(part.blocks, each, jacobians, strict=True)
            ]
        )

    def linear_part(self, x: FloatArray, noise: TrialNoise = WHITE) -> LinearPart:
        """Return the best linear coefficients at x; NaN where the columns overflow."""
        with np.errstate(over="ignore", invalid="ignore"):
            blocks: list[FloatArray] = []
            own = 0
            for i in range(len(self.outputs)):
                columns = self.own(x, i)
                own = columns.shape[1]
                table = [columns, self.shared(x, i), self.unknown(x, i)]
                blocks.append(noise.whiten(np.column_stack(table), i))
            # The triangular factors hold all that a solution needs, in a few rows.
            factors = [triangular_factor(block) for block in blocks]
            count = blocks[0].shape[1] - 1
            if not all(np.max(np.abs(factor)) <= _FAR for factor in factors):
                lost = np.full(count, np.nan)
                return LinearPart(lost[own:], [lost[:own]] * len(blocks), blocks, noise)
            theta, etas = _linear_solution(factors, own, count - own)
            return LinearPart(theta[:, 0], [eta[:, 0] for eta in etas], blocks, noise)


def _linear_solution(
    factors: Sequence[FloatArray], own: int, shared: int
) -> tuple[FloatArray, list[FloatArray]]:
    """Coefficients of columns that explain targets best: the shared ones, and each trial's own.

    The factors are triangular, of so many own columns of a trial, then shared ones, then targets.
    """
    first = own + shared
    rest = np.concatenate([factor[own:, own:] for factor in factors])
    theta = scaled_solution(rest[:, :shared], rest[:, shared:])
    etas = [
        scaled_solution(r[:own, :own], r[:own, first:] - r[:own, own:first] @ theta)
        for r in factors
    ]
    return theta, etas


def scaled_solution(design: FloatArray, target: FloatArray) -> FloatArray:
    """Return a least-squares solution by columns of the same length: units do not matter."""
    scale = column_scale(design)
    return (np.linalg.lstsq(design / scale, target, rcond=None)[0].T / scale).T


def column_scale(columns: FloatArray) -> FloatArray:
    """Return the length of each column; 1 of a column of zeros."""
    norms = np.linalg.norm(columns, axis=0)
    return np.where(norms > 0.0, norms, 1.0)


@dataclass(frozen=True, eq=False)
class Solution:
    """An optimum of a separable problem."""

    x: FloatArray  # shape ``(p,)``
    theta: FloatArray  # shape ``(q,)``
    cost: float  # sum of squares of the whitened residual
    settled: bool  # whether the optimiser stopped because it had converged

    @property
    def coordinates(self) -> FloatArray:
        """X and theta, shape ``(p + q,)``."""
        return np.append(self.x, self.theta)


def minimise(
    problem: Separable, starts: Sequence[FloatArray], noise: TrialNoise = WHITE
) -> Solution:
    """Search from the best few of the starts."""
    if len(starts) > 1:
        # Roughly first: most starts lead to the same minimum, and one end point of it is enough.
        rough, _ = _search(problem, starts, noise, tolerance=1e-4, steps=30)
        starts = [rough.x]
    return _search(problem, starts, noise, tolerance=1e-11, steps=150)[0]


def rough_minimum(problem: Separable, starts: Sequence[FloatArray]) -> tuple[Solution, FloatArray]:
    """Search from the best two of the starts until little is gained: for a scan of structures.

    The residual there, shape ``(N,)``, comes with it.
    """
    found, part = _search(problem, starts, WHITE, tolerance=1e-4, steps=20, follow=2)
    return found, part.residual


def _search(
    problem: Separable,
    starts: Sequence[FloatArray],
    noise: TrialNoise,
    *,
    tolerance: float,
    steps: int,
    follow: int = _FOLLOWED,
) -> tuple[Solution, LinearPart]:
    last: tuple[FloatArray, LinearPart] | None = None

    def linear_part(x: FloatArray) -> LinearPart:
        nonlocal last
        if last is None or not np.array_equal(x, last[0]):
            last = x.copy(), problem.linear_part(x, noise)
        return last[1]

    def residual(x: FloatArray) -> FloatArray | None:
        part = linear_part(x)
        return part.residual if np.all(np.isfinite(part.theta)) else None

    found = bounded_least_squares(
        residual,
        starts,
        lower=problem.lower,
        upper=problem.upper,
        jacobian=lambda x, _: problem.jacobian(x, linear_part(x)),
        tolerance=tolerance,
        gradient_tolerance=1e-14,
        max_steps=steps,
        follow=follow,
    )
    part = linear_part(found.x)
    return Solution(found.x, part.theta, found.cost, found.converged), part


@dataclass(frozen=True, eq=False)
class Linearised:
    """Residual and Jacobian at a point, per trial, each trial's own columns projected out."""

    # measured minus predicted, whitened, one per trial, shape ``(N_i,)``
    residuals: tuple[FloatArray, ...]
    # of the prediction to (x, theta), whitened, one per trial, ``(N_i, p + q)``
    jacobians: tuple[FloatArray, ...]
    own: int  # number of coefficients of the trials' own, summed
    noise: TrialNoise  # the model that whitened both
    # residual, own columns and Jacobian of each trial before whitening: the own columns are
    # orthonormal after it, and the Jacobian is orthogonal to them
    plain: tuple[tuple[FloatArray, FloatArray, FloatArray], ...]
    sample_times: tuple[float, ...]  # of the trials [s]
    exact: bool  # whether no column of the Jacobian is a difference


def linearise(
    problem: Separable, x: FloatArray, theta: FloatArray, noise: TrialNoise
) -> Linearised:
    """Differentiate the prediction by central differences; the noise model whitens all."""
    plain: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    count = 0
    least = _NARROW * (problem.upper - problem.lower)
    for i in range(len(problem.outputs)):
        shared, own = problem.shared(x, i), problem.own(x, i)
        # Nothing is a trial's own where its offset is held.
        whitened = noise.whiten(own, i) if own.size else own
        basis, sizes, back = np.linalg.svd(whitened, full_matrices=False)
        some = sizes > _DEPENDENT * np.max(sizes, initial=0.0)
        basis, back = basis[:, some], back[some].T / sizes[some]
        left = problem.unknown(x, i) - shared @ theta
        eta = back @ (basis.T @ noise.whiten(left, i))

        def predicted(at: FloatArray, i: int = i, eta: FloatArray = eta) -> FloatArray:
            return problem.predicted(at, i, theta, eta)

        jacobian = np.hstack([central_differences(predicted, x, least), shared])
        rest = jacobian - own @ (back @ (basis.T @ noise.whiten(jacobian, i)))
        plain.append((left - own @ eta, own @ back, rest))
        count += own.shape[1]
    residuals = tuple(noise.whiten(residual, i) for i, (residual, _, _) in enumerate(plain))
    jacobians = tuple(noise.whiten(jacobian, i) for i, (_, _, jacobian) in enumerate(plain))
    times = problem.sample_times
    return Linearised(residuals, jacobians, count, noise, tuple(plain), times, x.size == 0)
