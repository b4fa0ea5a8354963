"""A loop's readings, and a reversible curve with what may open it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.diagnosis.method.loop_effects import LoopEffect
from pamsim.diagnosis.method.row_evidence import RowGain
from pamsim.diagnosis.method.row_model import SIGNIFICANCE

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Readings along a path of the input, up and down.

    Attributes:
        input: (n,) in the order of the path, such as pressures [Pa].
        output: (n,) such as lengths [m].
        rising: (n,) True on a rising branch.
        error: (n,) standard error of each reading [unit of the output], or None if it is not known.
    """

    input: FloatArray
    output: FloatArray
    rising: NDArray[np.bool_]
    error: FloatArray | None = None


@dataclass(frozen=True, kw_only=True)
class LoopModel:
    """A reversible curve with one candidate.

    Attributes:
        effect: the candidate; None for the curve alone.
        opening: largest rising less falling output at one level [unit of the output], with its
            sign; 0 for the curve alone.
        interval95: of the opening, by leaving out levels.
        shape: its number.
        residual: (n,) fitted minus measured [unit of the output].
        unseen: (n,) the same, each reading predicted from the others.
        gain: over the curve alone at unseen readings; None for that.
        luck: chance that the best candidate fits as well if readings are exchanged.
    """

    effect: LoopEffect | None
    opening: float
    interval95: tuple[float, float]
    shape: float
    residual: FloatArray
    unseen: FloatArray
    gain: RowGain | None
    luck: float

    @property
    def name(self) -> str:
        """Name of the candidate, or ``reversible``."""
        return "reversible" if self.effect is None else self.effect.name

    @property
    def rms(self) -> float:
        """Root mean square of the residual [unit of the output]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def unseen_rms(self) -> float:
        """Root mean square at unseen readings [unit of the output]."""
        return float(np.sqrt(np.mean(self.unseen**2)))

    @property
    def earned(self) -> bool:
        """Whether it may be claimed: better at unseen readings, and by more than luck."""
        better = self.gain is not None and self.gain.p_value < SIGNIFICANCE
        return better and self.luck < SIGNIFICANCE and self.interval95[0] * self.interval95[1] > 0.0
