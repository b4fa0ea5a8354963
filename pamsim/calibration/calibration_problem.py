"""Measurements and a rig as the residuals that a calibration makes small."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from pamsim.comparison.free_parameters import FreedParameter, rig_values
from pamsim.comparison.trial_prediction import Prediction, TrialPredictor
from pamsim.core.errors import InputError, ParameterError
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.inference.simulator_fit import Blocks

Case = TypeVar("Case")
Found = TypeVar("Found")

_REMEMBERED = 4
"""Simulated vectors: those that a fit comes back to with other starts are the last ones."""


def possible(
    simulate: Callable[[Sequence[Case]], Sequence[Found | None]],
    cases: Sequence[Case],
    *,
    begun: bool,
) -> list[Found | None]:
    """What cases such as rigs give when simulated together; None for those that cannot begin.

    A muscle that would be longer than its fibres is a reason to search elsewhere, but not at the
    rig as it is: until any has ``begun``, what is wrong is raised.

    Raises:
        InputError: if the first cases cannot begin.
    """
    try:
        return list(simulate(cases))
    except InputError:
        if not begun:
            raise
        if len(cases) == 1:
            return [None]
    return [found for case in cases for found in possible(simulate, [case], begun=True)]


class CalibrationProblem:
    """Residuals of a predictor's rig against measurements, by its freed parameters."""

    def __init__(self, predictor: TrialPredictor, freed: Sequence[FreedParameter]) -> None:
        self.predictor, self.freed = predictor, tuple(freed)
        self._start = np.array([one.free.start for one in freed])
        self._linearised = False
        self._simulated: dict[bytes, Prediction | None] = {}

    def __call__(self, vectors: FloatArray) -> list[Blocks | None]:
        """Blocks of residuals, simulated minus measured, of parameter vectors (k, p) [SI].

        None for one whose simulation broke down.
        """
        return [
            None if prediction is None else self.predictor.blocks(prediction)
            for prediction in self.predictions(vectors)
        ]

    def predictions(self, vectors: FloatArray) -> list[Prediction | None]:
        """Predictions of many parameter vectors; None where a run broke down."""
        if not self._linearised:
            self.linearise_starts(self._start)
        return [
            None if found is None else self.predictor.adjusted(found)
            for found in self._as_simulated(np.atleast_2d(vectors))
        ]

    def _as_simulated(self, vectors: FloatArray) -> list[Prediction | None]:
        """Predictions from the starts as read; those of the last few vectors are remembered."""
        keys = [vector.tobytes() for vector in vectors]
        pairs = zip(keys, vectors, strict=True)
        new = {key: vector for key, vector in pairs if key not in self._simulated}
        if new:
            rigs = [self._rig(vector) for vector in new.values()]
            found = possible(self.predictor.as_simulated, rigs, begun=bool(self._simulated))
            self._simulated.update(zip(new, found, strict=True))
        answer = [self._simulated[key] for key in keys]
        used = [*self._simulated, *keys, self._start.tobytes()]  # a fit is compared with its start
        last = [key for key in dict.fromkeys(reversed(used)) if key in self._simulated]
        self._simulated = {key: self._simulated[key] for key in reversed(last[:_REMEMBERED])}
        return answer

    def linearise_starts(self, vector: FloatArray) -> None:
        """Take the trials' starts at a parameter vector, (p,) [SI]; see `TrialPredictor`.

        Done at the freed parameters' starts before the first prediction, and to be done again where
        a fit has ended.
        """
        self._linearised = True
        (simulated,) = self._as_simulated(np.atleast_2d(vector))
        if simulated is None:
            self.predictor.linearise_starts(None)
        else:
            self.predictor.linearise_starts(self._rig(vector), simulated=simulated)

    def _rig(self, vector: FloatArray) -> Rig | None:
        try:
            return self.predictor.rig.with_parameters(rig_values(self.freed, vector.tolist()))
        except ParameterError:  # an open end of a range, such as a length of exactly 0
            return None
