"""Residuals of many trials as one vector, and what each part of it belongs to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.trial_parts import TrialParts
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.residual_block import BlockPlace, Blocks, layout, stacked

Values = Mapping[str, float]


class SimulateValues(Protocol):
    """The simulator that a diagnosis receives: from parameters to residuals."""

    def __call__(
        self, sets: Sequence[Values], *, held_out: bool, fine: bool
    ) -> Sequence[Blocks | None]:
        """Simulate every trial with several parameter sets.

        Args:
            sets: rig parameters [SI] by name, those left out at the rig's own values.
            held_out: False for the fitted trials alone.
            fine: False for coarser and quicker steps, where there are any.

        Returns:
            For each the residual blocks (simulated minus measured); None where a simulation broke
            down.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class TrialLayout:
    """What the rows of a stacked residual belong to.

    A part of a trial that was cut counts as a trial, see `TrialParts`.

    Attributes:
        places: every channel of every trial.
        held_out: names of the trials that no fit uses.
        origin: part -> the trial that it was cut from.
    """

    places: tuple[BlockPlace, ...]
    held_out: frozenset[str]
    origin: Mapping[str, str] = field(default_factory=dict)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels, in the order of their first trial."""
        return tuple(dict.fromkeys(p.block.channel for p in self.places))

    @property
    def protocol_of(self) -> dict[str, str]:
        """Trial -> protocol."""
        return {p.block.trial: p.block.protocol for p in self.places}

    def trials(self, *, held_out: bool) -> tuple[str, ...]:
        """Names of the trials that are held out, or of those that are fitted."""
        names = dict.fromkeys(p.block.trial for p in self.places)
        return tuple(name for name in names if (name in self.held_out) == held_out)

    @property
    def fitted_places(self) -> tuple[BlockPlace, ...]:
        """Every channel of the fitted trials, with its rows in a stack of these alone."""
        places: list[BlockPlace] = []
        end = 0
        for place in self.places:
            if place.block.trial not in self.held_out:
                count = place.rows.stop - place.rows.start
                places.append(BlockPlace(place.block, slice(end, end + count)))
                end += count
        return tuple(places)

    def uncut(self, places: Iterable[BlockPlace]) -> tuple[BlockPlace, ...]:
        """Places with the parts of each trial together again, as far as they are among these."""
        whole: list[BlockPlace] = []
        for place in places:
            name = self.origin.get(place.block.trial, place.block.trial)
            last = whole[-1] if whole else None
            if last and (last.block.trial, last.block.channel) == (name, place.block.channel):
                joined = np.concatenate([last.block.residual, place.block.residual])
                block = replace(last.block, residual=joined)
                whole[-1] = BlockPlace(block, slice(last.rows.start, place.rows.stop))
            else:
                whole.append(BlockPlace(replace(place.block, trial=name), place.rows))
        return tuple(whole)

    def rows(self, trials: Iterable[str]) -> NDArray[np.bool_]:
        """Mask of the rows of some trials, shape (n,)."""
        wanted = set(trials)
        mask = np.zeros(self.places[-1].rows.stop, dtype=bool)
        for place in self.places:
            mask[place.rows] = place.block.trial in wanted
        return mask

    def weights(self, noise: Mapping[str, float]) -> FloatArray:
        """Inverse noise of each row, shape (n,).

        Every channel of a trial has the same total weight, however often it was sampled.

        Args:
            noise: channel -> standard deviation [SI].
        """
        weights = np.empty(self.places[-1].rows.stop)
        for place in self.places:
            count = place.block.residual.size
            weights[place.rows] = 1.0 / (noise[place.block.channel] * np.sqrt(count))
        return weights


class TrialSimulator:
    """A simulator with stacked residuals, corrected coarse steps and counted runs.

    The error of coarse steps depends little on the parameters: the difference to fine steps at one
    parameter set is added everywhere.

    Args:
        simulate: see `SimulateValues`.
        held_out: names of the trials that no fit uses.
        parts: into which trials are cut; their own held-out parts then count.
    """

    def __init__(
        self,
        simulate: SimulateValues,
        held_out: frozenset[str] = frozenset(),
        parts: TrialParts | None = None,
    ) -> None:
        self.simulate = simulate
        self.held_out = held_out if parts is None else parts.held_out
        self._parts = parts
        self.evaluations = 0
        self._layout: TrialLayout | None = None
        self._is_fitted = np.zeros(0, dtype=bool)
        self._correction = np.zeros(0)

    @property
    def layout(self) -> TrialLayout:
        """What the rows belong to.

        Raises:
            InputError: if no simulation has been completed yet.
        """
        if self._layout is None:
            raise InputError("no simulation has been completed yet; check the rig's parameters")
        return self._layout

    @property
    def fitted(self) -> NDArray[np.bool_]:
        """Mask (n,) of the rows of the fitted trials."""
        return self._is_fitted

    def anchor(self, values: Values) -> FloatArray | None:
        """Simulate in fine steps, and correct coarse ones by the difference from now on.

        Returns:
            Residual of all trials, (n,) [SI], or None if the simulation broke down.
        """
        fine = self.fine(values)
        (coarse,) = self._run([values], held_out=True, fine=False)
        if fine is not None and coarse is not None:
            self._correction = fine - coarse
        return fine

    def fine(self, values: Values) -> FloatArray | None:
        """Residual of all trials in fine steps, (n,) [SI], or None if the simulation broke down."""
        return self._run([values], held_out=True, fine=True)[0]

    def whole(self, values: Values) -> FloatArray | None:
        """Residual of all trials in coarse steps, corrected, (n,) [SI], or None."""
        return self.wholes([values])[0]

    def wholes(self, sets: Sequence[Values]) -> list[FloatArray | None]:
        """The same for several parameter sets in one call."""
        residuals = self._run(sets, held_out=True, fine=False)
        return [None if r is None else r + self._correction for r in residuals]

    def fit_rows(self, sets: Sequence[Values], *, fine: bool = False) -> list[FloatArray | None]:
        """Residuals of the fitted trials, for several parameter sets in one call.

        Args:
            sets: rig parameters by name [SI].
            fine: True for fine steps.

        Returns:
            For each shape (f,) [SI], or None where the simulation broke down.
        """
        residuals = self._run(sets, held_out=False, fine=fine)
        if fine:
            return residuals
        correction = self._correction[self._is_fitted]
        return [None if r is None else r + correction for r in residuals]

    def _run(
        self, sets: Sequence[Values], *, held_out: bool, fine: bool
    ) -> list[FloatArray | None]:
        self.evaluations += len(sets)
        residuals: list[FloatArray | None] = []
        for blocks in self.simulate(sets, held_out=held_out, fine=fine):
            if blocks is not None and self._parts is not None:
                blocks = self._parts.blocks(blocks, held_out=held_out)
            if blocks is not None and self._layout is None and held_out:
                self._layout = TrialLayout(
                    places=layout(blocks),
                    held_out=self.held_out,
                    origin={} if self._parts is None else self._parts.origin,
                )
                self._is_fitted = self._layout.rows(self._layout.trials(held_out=False))
                self._correction = np.zeros(self._is_fitted.size)
            if blocks is None:
                residuals.append(None)
                continue
            places = self.layout.places if held_out else self.layout.fitted_places
            residuals.append(stacked(blocks, places))
        return residuals
