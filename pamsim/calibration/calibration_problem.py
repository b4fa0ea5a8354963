"""Measurements and a rig as the residuals that a calibration makes small."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pamsim.calibration.possible_cases import possible
from pamsim.comparison.free_parameters import FreedParameter, rig_values
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.trial_prediction import CHANNELS, Prediction, TrialPredictor
from pamsim.core.errors import ParameterError
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.inference.residual_block import Blocks

_REMEMBERED = 4
"""Simulated vectors: those that a fit comes back to with other starts are the last ones."""


class CalibrationProblem:
    """Residuals of a rig against measurements, as a function of its freed parameters.

    The rig is compared with ``data``; its ``freed`` parameters are in the order of the vectors.
    See `TrialPredictor` for what else it takes and raises.
    """

    def __init__(
        self,
        rig: Rig,
        data: CalibrationData,
        freed: Sequence[FreedParameter],
        *,
        channels: Sequence[str] = CHANNELS,
        threads: int | None = None,
        simulated: Callable[[], None] | None = None,
    ) -> None:
        self.rig = rig
        self.freed = tuple(freed)
        self.predictor = TrialPredictor(
            rig, data, channels=channels, threads=threads, simulated=simulated
        )
        self._start = np.array([one.free.start for one in freed])
        self._linearised = False
        self._simulated: dict[bytes, Prediction | None] = {}

    @property
    def data(self) -> CalibrationData:
        """What the rig is compared with."""
        return self.predictor.data

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
        new = {
            key: vector
            for key, vector in zip(keys, vectors, strict=True)
            if key not in self._simulated
        }
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
            return self.rig.with_parameters(rig_values(self.freed, vector.tolist()))
        except ParameterError:  # an open end of a range, such as a length of exactly 0
            return None
