"""Fit the best reversible curve to a loop, alone and with one signal that may open it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from pamsim.core.errors import InputError
from pamsim.diagnosis.method.loop_effects import LoopEffect
from pamsim.diagnosis.method.loop_model import Loop, LoopModel
from pamsim.diagnosis.method.row_evidence import compare_rows
from pamsim.diagnosis.method.row_model import SIGNIFICANCE
from pamsim.diagnosis.method.verdict import TIE_ERRORS

FloatArray = NDArray[np.float64]

_EXCHANGES = 1_999
_FEWEST_LEVELS = 5
_NOTHING = 1e-9  # of a column: what is left of it is rounding


class LoopFitter:
    """Least squares of the curve and one signal, which the curve's free values make simple.

    Beside one free value per level only what a signal does about its mean there is left to fit.

    Args:
        loop: readings.
        candidates: what may open it.
        seed: of exchanges and sign flips.

    Raises:
        InputError: if fewer than five levels were read on both branches.
    """

    def __init__(self, loop: Loop, candidates: Sequence[LoopEffect], seed: int) -> None:
        self.loop = loop
        self.seed = seed
        self.levels, self.level = np.unique(np.round(loop.input, 9), return_inverse=True)
        self.count = np.bincount(self.level)
        up = self._summed(loop.rising.astype(float)) > 0.0
        down = self._summed((~loop.rising).astype(float)) > 0.0
        self.both = up & down
        if int(self.both.sum()) < _FEWEST_LEVELS:
            raise InputError(
                f"{int(self.both.sum())} levels were read on both branches; a loop needs"
                f" {_FEWEST_LEVELS} to tell what opens it"
            )
        self.weight = np.ones(loop.output.size) if loop.error is None else 1.0 / loop.error
        path = (loop.input - loop.input.min()) / np.ptp(loop.input)
        self.signals = {c.name: [(s, c.signal(path, s)) for s in c.shapes] for c in candidates}
        self.effects = {c.name: c for c in candidates}
        self.measured = self._about_mean(loop.output)
        self.difference = self._apart(loop.output)

    def base(self) -> LoopModel:
        """The reversible curve alone."""
        return LoopModel(
            effect=None,
            opening=0.0,
            interval95=(0.0, 0.0),
            shape=0.0,
            residual=-self.measured / self.weight,
            unseen=self._unseen([])[0],
            gain=None,
            luck=1.0,
        )

    def models(self, base: LoopModel) -> list[LoopModel]:
        """Every candidate beside the curve."""
        luck = self._luck(self.measured, None, list(self.signals))
        return [
            self._model(name, base, luck[name]) for name in self.signals if np.isfinite(luck[name])
        ]

    def loss(self, model: LoopModel) -> float:
        """Mean square at unseen readings, in units of their errors where these are known."""
        return float(np.mean((model.unseen * self.weight) ** 2))

    def tied(self, other: LoopModel, best: LoopModel, base: LoopModel) -> bool:
        """Whether another model predicts unseen readings as well and leaves nothing to the best."""
        behind = compare_rows(
            self._per_level(other.unseen), self._per_level(best.unseen), seed=self.seed
        )
        half = self.loss(base) - self.loss(other) > 0.5 * (self.loss(base) - self.loss(best))
        if behind.in_errors >= TIE_ERRORS or not half or other.luck >= SIGNIFICANCE:
            return False
        taken = dict(self.signals[other.name])[other.shape]
        left = -other.residual * self.weight
        return self._luck(left, self._about_mean(taken), [best.name])[best.name] >= SIGNIFICANCE

    def direction(self) -> float:
        """Two-sided chance that branches differ on the average as they do, by exchanges."""
        spread = np.sqrt(self._summed(1.0 / self.weight**2) / self.count)[self.both]
        value = np.sort(self.difference / spread)
        signs = np.random.default_rng(self.seed).choice([-1.0, 1.0], (_EXCHANGES, value.size))
        beyond = np.abs(signs @ value) >= abs(float(value.sum())) * (1.0 - 1e-12)
        return (1 + int(np.sum(beyond))) / (1 + _EXCHANGES)

    def _model(self, name: str, base: LoopModel, luck: float) -> LoopModel:
        own = self.signals[name]
        signals = [signal for _, signal in own]
        number, sizes = self._fits(signals)
        signal = signals[number]
        unseen, openings = self._unseen(signals)
        count = openings.size
        scatter = np.sum((openings - openings.mean()) ** 2)
        reach = float(student.ppf(0.975, count - 1) * np.sqrt((count - 1) / count * scatter))
        opening = self._opening(signal, sizes[number])
        fitted = sizes[number] * self._about_mean(signal)
        return LoopModel(
            effect=self.effects[name],
            opening=opening,
            interval95=(opening - reach, opening + reach),
            shape=own[number][0],
            residual=(fitted - self.measured) / self.weight,
            unseen=unseen,
            gain=compare_rows(
                self._per_level(base.unseen), self._per_level(unseen), seed=self.seed
            ),
            luck=luck,
        )

    def _summed(self, values: FloatArray) -> FloatArray:
        """Sums over the readings of each level."""
        found = np.bincount(self.level, weights=values, minlength=self.levels.size)
        return found.astype(np.float64)

    def _about_mean(self, values: FloatArray) -> FloatArray:
        """Values about their weighted mean at each level, in units of the readings' errors."""
        square = self.weight**2
        mean = self._summed(values * square) / self._summed(square)
        return (values - mean[self.level]) * self.weight

    def _per_level(self, error: FloatArray) -> FloatArray:
        """Root mean square of weighted errors at each level: readings there are not independent."""
        return np.sqrt(self._summed((error * self.weight) ** 2) / self.count)

    def _apart(self, values: FloatArray) -> FloatArray:
        """Mean of rising less mean of falling values at each level that has both, (m,)."""
        up, down = self.loop.rising.astype(float), (~self.loop.rising).astype(float)
        with np.errstate(invalid="ignore"):
            means = [self._summed(values * side) / self._summed(side) for side in (up, down)]
        return (means[0] - means[1])[self.both]

    def _opening(self, signal: FloatArray, size: float) -> float:
        """Largest rising less falling value of a signal at one level, times its size."""
        return size * float(max(self._apart(signal), key=abs))

    def _fits(
        self, signals: Sequence[FloatArray], without: int | None = None
    ) -> tuple[int, list[float]]:
        """Number of the signal that fits best, and the sizes of all, with a level left out."""
        gains: list[float] = []
        sizes: list[float] = []
        for signal in signals:
            column = self._about_mean(signal)
            along, own = self._summed(column * self.measured), self._summed(column**2)
            if without is not None:
                along[without] = own[without] = 0.0
            total = float(own.sum())
            size = float(along.sum()) / total if total > _NOTHING else 0.0
            sizes.append(size)
            gains.append(size * size * total)
        return int(np.argmax(gains)), sizes

    def _unseen(self, signals: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Errors at readings left out, and the opening without each level.

        The shape is chosen anew each time, from readings at other levels. The level's own value
        rests on its other reading, so that only what tells the branches apart predicts the one
        that is left out.
        """
        output = self.loop.output
        errors, openings = np.zeros(output.size), np.zeros(self.levels.size)
        for level in range(self.levels.size):
            signal, size = np.zeros(output.size), 0.0
            if signals:
                number, sizes = self._fits(signals, level)
                signal, size = signals[number], sizes[number]
                openings[level] = self._opening(signal, size)
            here = np.flatnonzero(self.level == level)
            for i in here:
                others = here[here != i]
                if others.size > 0:
                    step = size * float(signal[i] - np.mean(signal[others]))
                    errors[i] = float(np.mean(output[others])) + step - output[i]
        return errors, openings

    def _luck(
        self, misfit: FloatArray, taken: FloatArray | None, names: Sequence[str]
    ) -> dict[str, float]:
        """Chance that the best of some effects and their shapes fits as well after exchanges.

        Args:
            misfit: (n,) measured minus a model, in units of the readings' errors.
            taken: (n,) a column of that model, which no effect may fit again.
            names: of the effects that are tried beside it.

        Returns:
            Name -> chance; NaN for an effect that opens nothing at these levels.
        """
        rng = np.random.default_rng(self.seed)
        signs = rng.choice([-1.0, 1.0], (_EXCHANGES, self.levels.size))
        exchanged = (signs[:, self.level] * misfit).T
        own = dict.fromkeys(names, float("nan"))
        best = np.zeros(_EXCHANGES)
        for name in names:
            for _, signal in self.signals[name]:
                column = self._about_mean(signal)
                if taken is not None:
                    column = column - taken * float(taken @ column) / float(taken @ taken)
                size = float(np.linalg.norm(column))
                if size > _NOTHING:
                    column = column / size
                    best = np.maximum(best, (column @ exchanged) ** 2)
                    own[name] = float(np.fmax(own[name], float(column @ misfit) ** 2))
        return {
            name: (1 + int(np.sum(best >= reached * (1.0 - 1e-12)))) / (1 + _EXCHANGES)
            if np.isfinite(reached)
            else float("nan")
            for name, reached in own.items()
        }
