"""Fit the best reversible curve to a loop, alone and with one effect that may open it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.evidence import Improvement, Share, compare_rows, share_of_rows
from pamsim.diagnosis.method.loop_effects import LoopEffect
from pamsim.diagnosis.method.verdict_thresholds import (
    FEWEST_LEVELS,
    SIGNIFICANCE,
    TIE_ERRORS,
    TIE_SHARE,
)
from pamsim.inference.leave_one_out import jackknife_reach95
from pamsim.inference.permutation import sign_flips, upper_p_value

_EXCHANGES = 1_999
_NOTHING = 1e-9  # of a column: what is left of it is rounding


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
    """A reversible curve with one effect.

    Attributes:
        effect: the effect and its form; None for the curve alone.
        opening: largest rising less falling output at one level [unit of the output], with its
            sign; 0 for the curve alone.
        interval95: of the opening, by leaving out levels.
        shape: its number.
        residual: (n,) fitted minus measured [unit of the output].
        unseen: (n,) the same, each reading predicted from the others.
        improvement: over the curve alone at unseen readings; None for that.
        p_value: that the best effect fits as well by chance, by exchanging readings.
    """

    effect: LoopEffect | None
    opening: float
    interval95: tuple[float, float]
    shape: float
    residual: FloatArray
    unseen: FloatArray
    improvement: Improvement | None
    p_value: float

    @property
    def rms(self) -> float:
        """Root mean square of the residual [unit of the output]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def unseen_rms(self) -> float:
        """Root mean square at unseen readings [unit of the output]."""
        return float(np.sqrt(np.mean(self.unseen**2)))

    @property
    def accepted(self) -> bool:
        """Whether it may be claimed: significantly better, and with an opening that is not 0."""
        better = self.improvement is not None and self.improvement.p_value < SIGNIFICANCE
        known = self.interval95[0] * self.interval95[1] > 0.0
        return better and self.p_value < SIGNIFICANCE and known


class LoopFitter:
    """Least squares of the curve and one signal.

    The curve has one free value per level, so only the deviation of a signal from its mean at each
    level is left to fit.

    Args:
        loop: readings.
        effects: what may open it.
        seed: random seed of exchanges and sign flips.

    Raises:
        InputError: if fewer than five levels were read on both branches.
    """

    def __init__(self, loop: Loop, effects: Sequence[LoopEffect], seed: int) -> None:
        self.loop = loop
        self.seed = seed
        self.levels, self.level = np.unique(np.round(loop.input, 9), return_inverse=True)
        self.count = np.bincount(self.level)
        up, down = (self._summed(side) > 0.0 for side in self._sides())
        self.both = up & down
        if int(self.both.sum()) < FEWEST_LEVELS:
            raise InputError(
                f"{int(self.both.sum())} levels were read on both branches; a loop needs"
                f" {FEWEST_LEVELS}"
            )
        self.weight = np.ones(loop.output.size) if loop.error is None else 1.0 / loop.error
        path = (loop.input - loop.input.min()) / np.ptp(loop.input)
        self.signals = {e.form: [(s, e.signal(path, s)) for s in e.shapes] for e in effects}
        self.effects = {e.form: e for e in effects}
        self.measured = self._about_mean(loop.output)

    def base(self) -> LoopModel:
        """The reversible curve alone."""
        return LoopModel(
            effect=None,
            opening=0.0,
            interval95=(0.0, 0.0),
            shape=0.0,
            residual=-self.measured / self.weight,
            unseen=self._unseen([])[0],
            improvement=None,
            p_value=1.0,
        )

    def models(self, base: LoopModel) -> list[LoopModel]:
        """Every effect beside the curve."""
        p_values = self._p_values(self.measured, None, list(self.signals))
        return [
            self._model(form, base, p_values[form])
            for form in self.signals
            if np.isfinite(p_values[form])
        ]

    def branches(self, values: FloatArray) -> FloatArray:
        """Means over rising and over falling readings at each level that has both, (2, m)."""
        return np.array(
            [
                self._summed(values * side)[self.both] / self._summed(side)[self.both]
                for side in self._sides()
            ]
        )

    def difference_error(self) -> FloatArray | None:
        """Standard error of rising less falling at each level that has both, (m,), if known."""
        if self.loop.error is None:
            return None
        counts = np.array([self._summed(side)[self.both] for side in self._sides()])
        return np.sqrt(np.sum(self.branches(self.loop.error**2) / counts, axis=0))

    def loss(self, model: LoopModel) -> float:
        """Mean square at unseen readings, in units of their errors where these are known."""
        return float(np.mean((model.unseen * self.weight) ** 2))

    def share(self, model: LoopModel, base: LoopModel) -> Share:
        """Share of the base model's mean square at unseen readings that a model removes."""
        # A level's sum over its readings, so that the mean over levels is that over readings.
        before, after = (self._per_level(m.unseen) * self.count**0.5 for m in (base, model))
        return share_of_rows(before, after)

    def tied(self, other: LoopModel, best: LoopModel, base: LoopModel) -> bool:
        """Whether another model predicts unseen readings as well and leaves nothing to the best."""
        behind = compare_rows(
            self._per_level(other.unseen), self._per_level(best.unseen), seed=self.seed
        )
        most = self.loss(base) - self.loss(best)
        explains = self.loss(base) - self.loss(other) > TIE_SHARE * most
        if behind.standard_errors >= TIE_ERRORS or not explains or other.p_value >= SIGNIFICANCE:
            return False
        return self.remainder(other, [best]) >= SIGNIFICANCE

    def remainder(self, model: LoopModel, others: Sequence[LoopModel]) -> float:
        """p-value that the best of other effects explains what a model leaves only by chance.

        Without repeats this is the only test of a remainder that a loop allows.
        """
        if not others:
            return 1.0
        assert model.effect is not None
        used = dict(self.signals[model.effect.form])[model.shape]
        left = -model.residual * self.weight
        forms = [other.effect.form for other in others if other.effect is not None]
        p_values = self._p_values(left, self._about_mean(used), forms)
        return float(np.fmin.reduce([*p_values.values(), 1.0]))

    def direction(self) -> float:
        """Two-sided p-value of the mean difference between the branches, by exchanges."""
        spread = np.sqrt(self._summed(1.0 / self.weight**2) / self.count)[self.both]
        value = np.sort(self._apart(self.loop.output) / spread)
        rng = np.random.default_rng(self.seed)
        signs = np.concatenate(list(sign_flips(_EXCHANGES, value.size, rng)))
        return upper_p_value(np.abs(signs @ value), abs(float(value.sum())))

    def _model(self, form: str, base: LoopModel, p_value: float) -> LoopModel:
        own = self.signals[form]
        signals = [signal for _, signal in own]
        number, sizes = self._fits(signals)
        signal = signals[number]
        unseen, openings = self._unseen(signals)
        reach = float(jackknife_reach95(openings[:, np.newaxis])[0])
        opening = self._opening(signal, sizes[number])
        fitted = sizes[number] * self._about_mean(signal)
        return LoopModel(
            effect=self.effects[form],
            opening=opening,
            interval95=(opening - reach, opening + reach),
            shape=own[number][0],
            residual=(fitted - self.measured) / self.weight,
            unseen=unseen,
            improvement=compare_rows(
                self._per_level(base.unseen), self._per_level(unseen), seed=self.seed
            ),
            p_value=p_value,
        )

    def _summed(self, values: FloatArray) -> FloatArray:
        """Sums over the readings of each level."""
        sums = np.bincount(self.level, weights=values, minlength=self.levels.size)
        return sums.astype(np.float64)

    def _about_mean(self, values: FloatArray) -> FloatArray:
        """Values about their weighted mean at each level, in units of the readings' errors."""
        square = self.weight**2
        mean = self._summed(values * square) / self._summed(square)
        return (values - mean[self.level]) * self.weight

    def _per_level(self, error: FloatArray) -> FloatArray:
        """Root mean square of weighted errors at each level: readings there are not independent."""
        return np.sqrt(self._summed((error * self.weight) ** 2) / self.count)

    def _sides(self) -> tuple[FloatArray, FloatArray]:
        """1 for each rising reading, and 1 for each falling one, (n,)."""
        return self.loop.rising.astype(float), (~self.loop.rising).astype(float)

    def _apart(self, values: FloatArray) -> FloatArray:
        """Mean of rising less mean of falling values at each level that has both, (m,)."""
        rising, falling = self.branches(values)
        return rising - falling

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

        The shape is chosen again each time, from readings at other levels. The level's own value
        rests on its other reading, so that only what separates the branches predicts the one
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

    def _p_values(
        self, misfit: FloatArray, used: FloatArray | None, forms: Sequence[str]
    ) -> dict[str, float]:
        """P-values by exchanges, corrected for choosing the best of some forms and their shapes.

        Args:
            misfit: (n,) measured minus a model, in units of the readings' errors.
            used: (n,) the signal of that model, which is projected out of the others.
            forms: that are tried beside it.

        Returns:
            Form -> p-value; NaN for a form that opens nothing at these levels.
        """
        rng = np.random.default_rng(self.seed)
        signs = np.concatenate(list(sign_flips(_EXCHANGES, self.levels.size, rng)))
        exchanged = (signs[:, self.level] * misfit).T
        own = dict.fromkeys(forms, float("nan"))
        best = np.zeros(_EXCHANGES)
        for form in forms:
            for _, signal in self.signals[form]:
                column = self._about_mean(signal)
                if used is not None:
                    column = column - used * float(used @ column) / float(used @ used)
                size = float(np.linalg.norm(column))
                if size > _NOTHING:
                    column = column / size
                    best = np.maximum(best, (column @ exchanged) ** 2)
                    own[form] = float(np.fmax(own[form], float(column @ misfit) ** 2))
        return {
            form: upper_p_value(best, reached) if np.isfinite(reached) else float("nan")
            for form, reached in own.items()
        }
