"""A handed-in simulator as residual and Jacobian: counted, cached, one call for a Jacobian."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.inference.free_parameter import FreeParameter, SearchScale
from pamsim.inference.residual_block import BlockPlace, Simulate, layout, stacked

FloatArray = NDArray[np.float64]

_FORWARD = 1e-5  # step of the search's differences, in ranges: its error is far below the noise
_CENTRAL = 1e-4  # step at the optimum; wide enough to bridge the kinks of switching valves


class BatchedResidual:
    """Residual and Jacobian over places in the unit cube (see `SearchScale`).

    Args:
        simulate: parameter vectors to blocks.
        parameters: p of them.
        places: the blocks, if they are known already.

    Attributes:
        evaluations: simulated parameter vectors so far.
        calls: of ``simulate`` so far.
        diverged: vectors among them that diverged.
    """

    def __init__(
        self,
        simulate: Simulate,
        parameters: Sequence[FreeParameter],
        places: tuple[BlockPlace, ...] = (),
    ) -> None:
        self._simulate = simulate
        self.scale = SearchScale(parameters)
        self.evaluations = self.calls = self.diverged = 0
        self._places = places
        self._last: tuple[FloatArray, FloatArray | None] | None = None
        self._linear: tuple[FloatArray, FloatArray, FloatArray] | None = None

    @property
    def places(self) -> tuple[BlockPlace, ...]:
        """The blocks, known once a simulation has not diverged."""
        return self._places

    def many(self, at: FloatArray) -> list[FloatArray | None]:
        """Residuals at several places, in one call.

        Args:
            at: shape (k, p), in the unit cube.

        Returns:
            For each the stacked residual, shape (n,), or None if the simulation diverged.

        Raises:
            InputError: the callable returned another number of results, or blocks that differ.
        """
        answers = self._simulate(self.scale.from_unit(at))
        if len(answers) != len(at):
            raise InputError(f"{len(at)} vectors were simulated, {len(answers)} results came back")
        self.calls += 1
        self.evaluations += len(at)
        residuals: list[FloatArray | None] = []
        for blocks in answers:
            if blocks is not None and not self._places:
                self._places = layout(blocks)
            residuals.append(stacked(blocks, self._places))
        self.diverged += sum(r is None for r in residuals)
        return residuals

    def at(self, place: FloatArray) -> FloatArray | None:
        """Residual at one place, shape (n,), or None if the simulation diverged."""
        if self._linear is not None and np.array_equal(self._linear[0], place):
            return self._linear[1]
        if self._last is None or not np.array_equal(self._last[0], place):
            self._last = place.copy(), self.many(place[np.newaxis])[0]
        return self._last[1]

    def remember(self, place: FloatArray, residual: FloatArray) -> None:
        """Take note of a residual from `many`, so that it is not simulated again."""
        self._last = place.copy(), residual

    def jacobian(self, place: FloatArray, *, central: bool = False) -> FloatArray:
        """Differences of the residual, all perturbed vectors in one call.

        A perturbation that diverges is tried to the other side, in a second call; if that diverges
        too, its column is zero.

        Args:
            place: shape (p,), where the simulation does not diverge.
            central: differences to both sides instead of one.

        Returns:
            Change of the residual per range, shape (n, p).
        """
        if not central and self._linear is not None and np.array_equal(self._linear[0], place):
            return self._linear[2]
        middle = self.at(place)
        assert middle is not None
        size = _CENTRAL if central else _FORWARD
        inward = np.where(
            place > 0.5, -size, size
        )  # a step over a bound would cost nothing but sense
        steps = np.diag(inward)
        sets = np.vstack(
            [place + steps, np.clip(place - steps, 0.0, 1.0)] if central else [place + steps]
        )
        found = self.many(sets)
        lost = [i for i in range(place.size) if found[i] is None]
        if lost and not central:
            other = self.many(np.clip(place - steps[lost], 0.0, 1.0))
            back = dict(zip(lost, other, strict=True))
        else:
            back = {i: found[place.size + i] for i in range(place.size)} if central else {}
        columns: list[FloatArray] = []
        for i in range(place.size):
            ends = [(place[i], middle)]
            ahead, behind = found[i], back.get(i)
            if ahead is not None:
                ends.insert(0, (place[i] + inward[i], ahead))
            if behind is not None:
                ends.append((float(np.clip(place[i] - inward[i], 0.0, 1.0)), behind))
            run = ends[0][0] - ends[-1][0]
            columns.append((ends[0][1] - ends[-1][1]) / run if run else np.zeros_like(middle))
        matrix = np.stack(columns, axis=1)
        if not central:
            self._linear = place.copy(), middle, matrix
        return matrix
